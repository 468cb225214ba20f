"""From the parameters of a mission to legs and curves, relative to the place and the moment where the law took over.

The plan does not depend on where that is, so it is made before the flight, checked, and kept. With yaw = "path" its yaws are
true headings, counter-clockwise from north; with "fixed" they count from the heading at the start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from mavquad.control.reference import NOWHERE, Leg, Pose, end_us, leg_channels, plan_leg
from mavquad.control.trajectories import along
from mavquad.control.trajectories.along import Along, Channels
from mavquad.control.trajectories.curves import Circle, Curve, Eight
from mavquad.control.trajectories.heading import unwound
from mavquad.control.trajectories.spline import spline
from mavquad.flight.mission_params import MissionParams, waypoints_nwu_m
from mavquad.flight.trajectory_rows import samples
from mavquad.flight.waypoint_times import waypoint_curve
from mavquad.frames import nwu_from_ned, unwrap_near
from mavquad.types import Vec3

Motion = Leg | Along

START = (0.0, 0.0, 0.0)
LEVEL_WAY_MIN_M = 1e-3
"""A way that leads less far than this horizontally has no direction to look in."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Motions one after the other, at rest between them, and the time of it all.

    `first_heading_rad` is where to look before the first motion; None for as it was.
    """

    motions: tuple[Motion, ...]
    own_us: int
    first_heading_rad: float | None


@dataclass(frozen=True, slots=True)
class Stop:
    """A pose relative to the start, in NED and with yaw clockwise, and how long to stay there."""

    offset_ned_m: Vec3
    turn_deg: float
    stay_s: float


def motion_channels(motion: Motion, stamp_us: int) -> Channels:
    """The channels z, yaw, x, y of a motion, with four derivatives each."""
    return leg_channels(motion, stamp_us) if isinstance(motion, Leg) else along.channels(motion, stamp_us)


def stops(params: MissionParams) -> tuple[Stop, ...]:
    """The stops of a mission that has any, the first one at its start."""
    start = Stop(START, 0.0, params.hover_s)
    side, stay = params.side_m, params.dwell_s
    if params.name == "goto":
        return (start, Stop(params.offset_ned_m, params.offset_turn_deg, stay))
    if params.name != "box":
        return (start,)
    found = [start]
    for lap in range(params.repeat):
        before, turned = lap * params.turn_deg, (lap + 1) * params.turn_deg
        found += [
            Stop((side, 0.0, 0.0), before, stay),
            Stop((side, side, 0.0), before, stay),
            Stop((side, side, 0.0), turned, stay),
            Stop((0.0, side, 0.0), turned, stay),
            Stop((0.0, 0.0, 0.0), turned, stay),
        ]
    return tuple(found)


@lru_cache(maxsize=32)
def plan_mission(params: MissionParams) -> Plan:
    """The plan of a mission.

    Raises:
        NoHeading: yaw = "path" along a curve that reverses or stands still.
    """
    planner = _Planner(params)
    if params.name in ("circle", "figure_eight"):
        planner.follow(_laps(params), params.ramp_s)
    elif params.name == "waypoints":
        curve, ramp_s = waypoint_curve(waypoints_nwu_m(params), params.reference, params.yaw == "path")
        planner.follow(curve, ramp_s)
    elif params.name == "file":
        curve = spline(samples(params.points), params.knot_s)
        for _ in range(params.repeat):
            planner.follow(curve, params.ramp_s)
    else:
        for stop in stops(params)[1:]:
            planner.go(nwu_from_ned(stop.offset_ned_m), -math.radians(stop.turn_deg), stop.stay_s)
    return planner.plan()


def _laps(params: MissionParams) -> Curve:
    if params.name == "circle":
        return Circle(params.radius_m, params.period_s, params.direction == "clockwise", params.repeat)
    return Eight(params.along_m, params.across_m, params.period_s, params.plane == "vertical", params.repeat)


class _Planner:
    """Sets one motion after the other."""

    def __init__(self, params: MissionParams) -> None:
        self._params = params
        self._looks_along = params.yaw == "path"
        self._motions: list[Motion] = []
        self._clock_us = round(params.hover_s * 1e6)
        self._pose = Pose(START, 0.0)
        self._first_heading_rad: float | None = None

    def plan(self) -> Plan:
        return Plan(tuple(self._motions), self._clock_us, self._first_heading_rad)

    def go(self, place: Vec3, yaw_rad: float, stay_s: float) -> None:
        """Straight to a place, turning on the way; or turning first, towards it."""
        if self._looks_along:
            x, y = (b - a for a, b in zip(self._pose.position_nwu_m[:2], place[:2], strict=True))
            if math.hypot(x, y) > LEVEL_WAY_MIN_M:
                self._face(math.atan2(y, x))
            yaw_rad = self._pose.yaw_rad
        if math.dist(place, self._pose.position_nwu_m) > NOWHERE or abs(yaw_rad - self._pose.yaw_rad) > NOWHERE:
            self._leg(Pose(place, yaw_rad))
            self._clock_us += round(stay_s * 1e6)

    def follow(self, curve: Curve, ramp_s: float) -> None:
        """To where a curve begins, and along it."""
        x, y, z, yaw = curve.at(0.0)
        self.go((x[0], y[0], z[0]), yaw[0], self._params.dwell_s)
        if self._looks_along:
            self._face(unwound(curve).angles_rad[0])
        flown = along.along(self._clock_us, curve, ramp_s, self._looks_along, self._pose.yaw_rad)
        self._motions.append(flown)
        self._clock_us += round(flown.duration_s * 1e6)
        up, turn, north, west = along.channels(flown, self._clock_us + 1)
        self._pose = Pose((north[0], west[0], up[0]), turn[0])
        self._clock_us += round(self._params.dwell_s * 1e6)

    def _face(self, heading_rad: float) -> None:
        """Turn on the spot; the first turn is only known when it is known how the vehicle stands."""
        place = self._pose.position_nwu_m
        if self._first_heading_rad is None:
            self._first_heading_rad = heading_rad
            self._pose = Pose(place, heading_rad)
        near = unwrap_near(heading_rad, self._pose.yaw_rad)
        if abs(near - self._pose.yaw_rad) > NOWHERE:
            self._leg(Pose(place, near))

    def _leg(self, goal: Pose) -> None:
        leg = plan_leg(self._params.reference, self._clock_us, self._pose, goal)
        self._motions.append(leg)
        self._pose, self._clock_us = leg.goal, end_us(leg)
