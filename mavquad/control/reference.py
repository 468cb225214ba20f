"""Rest-to-rest references with four continuous derivatives, and holding still.

A leg is a straight way and a turn, each the step of `trajectories.step` under its own bounds. The slower of the two sets the
time, and the other is stretched to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pydantic import Field

from mavquad.control.trajectories.along import Channels
from mavquad.control.trajectories.chain_rule import Five
from mavquad.control.trajectories.step import Bounds, Step, Times, boxcars, step, stretched
from mavquad.frames import unwrap_near
from mavquad.schema import Section
from mavquad.types import ReferencePoint, Vec3

NOWHERE = 1e-9
"""A way (m) or a turn (rad) shorter than this is none."""
STILL = (0.0, 0.0, 0.0, 0.0)


class ReferenceParams(Section):
    """[mission.reference]: how briskly the reference moves. A mission that would move more briskly is refused."""

    speed_max_m_s: float = Field(default=1.5, gt=0.0, le=20.0)
    """Largest speed of the reference, m/s."""
    acceleration_max_m_s2: float = Field(default=1.2, gt=0.0, le=15.0)
    """Largest acceleration of the reference, m/s^2."""
    jerk_max_m_s3: float = Field(default=2.5, gt=0.0, le=200.0)
    """Largest jerk of the reference, m/s^3: g times how fast it makes the vehicle tilt."""
    snap_max_m_s4: float = Field(default=8.0, gt=0.0, le=5000.0)
    """Largest snap of the reference, m/s^4: g times the angular acceleration that it costs."""
    yaw_rate_max_deg_s: float = Field(default=45.0, gt=0.0, le=360.0)
    """Largest yaw rate of the reference, deg/s."""
    yaw_acceleration_max_deg_s2: float = Field(default=45.0, gt=0.0, le=1000.0)
    """Largest yaw acceleration of the reference, deg/s^2. A quadcopter's yaw is weak."""
    yaw_jerk_max_deg_s3: float = Field(default=60.0, gt=0.0, le=20000.0)
    """Largest third derivative of the reference's yaw, deg/s^3."""
    yaw_snap_max_deg_s4: float = Field(default=120.0, gt=0.0, le=500000.0)
    """Largest fourth derivative of the reference's yaw, deg/s^4."""
    duration_min_s: float = Field(default=1.0, ge=0.1, le=60.0)
    """No leg between two poses is shorter than this, s."""

    def way_bounds(self) -> Bounds:
        """Of the position, m/s to m/s^4."""
        return Bounds(self.speed_max_m_s, self.acceleration_max_m_s2, self.jerk_max_m_s3, self.snap_max_m_s4)

    def turn_bounds(self) -> Bounds:
        """Of the yaw, rad/s to rad/s^4."""
        return Bounds(
            math.radians(self.yaw_rate_max_deg_s),
            math.radians(self.yaw_acceleration_max_deg_s2),
            math.radians(self.yaw_jerk_max_deg_s3),
            math.radians(self.yaw_snap_max_deg_s4),
        )


@dataclass(frozen=True, slots=True)
class Pose:
    """Where to be, and where to look; yaw continuous, not wrapped."""

    position_nwu_m: Vec3
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class Leg:
    """From rest at one pose to rest at another. `way` and `turn` are steps from 0 to 1; None where there is none."""

    start_us: int
    duration_s: float
    origin: Pose
    goal: Pose
    way: Step | None
    turn: Step | None


def plan_leg(params: ReferenceParams, start_us: int, origin: Pose, goal: Pose) -> Leg:
    """The leg that keeps to the limits in the least time; yaw goes the shorter way round."""
    yaw_goal = unwrap_near(goal.yaw_rad, origin.yaw_rad)
    way = _boxcars(math.dist(origin.position_nwu_m, goal.position_nwu_m), params.way_bounds())
    turn = _boxcars(abs(yaw_goal - origin.yaw_rad), params.turn_bounds())
    duration_s = max(params.duration_min_s, *(math.fsum(times) for times in (way, turn) if times), 0.0)
    return Leg(
        start_us,
        duration_s,
        origin,
        Pose(goal.position_nwu_m, yaw_goal),
        step(stretched(way, duration_s)) if way else None,
        step(stretched(turn, duration_s)) if turn else None,
    )


def end_us(leg: Leg) -> int:
    """When the leg is at its goal."""
    return leg.start_us + round(leg.duration_s * 1e6)


def sample(leg: Leg, stamp_us: int) -> ReferencePoint:
    """The reference at a moment: the origin before the leg, the goal after it."""
    z, yaw, x, y = leg_channels(leg, stamp_us)
    return ReferencePoint(z, yaw, x, y)


def leg_channels(leg: Leg, stamp_us: int) -> Channels:
    """The same as plain tuples: z, yaw, x, y."""
    t_s = (stamp_us - leg.start_us) * 1e-6
    if t_s >= leg.duration_s:
        return pose_channels(leg.goal)
    if t_s <= 0.0:
        return pose_channels(leg.origin)
    x0, y0, z0 = leg.origin.position_nwu_m
    x1, y1, z1 = leg.goal.position_nwu_m
    yaw0 = leg.origin.yaw_rad
    yaw = _blend(yaw0, leg.goal.yaw_rad - yaw0, leg.turn.at(t_s)) if leg.turn else (yaw0, *STILL)
    if leg.way is None:
        return ((z0, *STILL), yaw, (x0, *STILL), (y0, *STILL))
    way = leg.way.at(t_s)
    return (_blend(z0, z1 - z0, way), yaw, _blend(x0, x1 - x0, way), _blend(y0, y1 - y0, way))


def hold(pose: Pose) -> ReferencePoint:
    """Stand still at a pose."""
    z, yaw, x, y = pose_channels(pose)
    return ReferencePoint(z, yaw, x, y)


def pose_channels(pose: Pose) -> Channels:
    """The same as plain tuples: z, yaw, x, y."""
    x, y, z = pose.position_nwu_m
    return ((z, *STILL), (pose.yaw_rad, *STILL), (x, *STILL), (y, *STILL))


def shifted(derivatives: tuple[float, ...], ahead_s: float) -> tuple[float, ...]:
    """A channel of a reference (its value and four derivatives) some time later, by its own Taylor series."""
    r0, r1, r2, r3, r4 = derivatives
    if r1 == r2 == r3 == r4 == 0.0:
        return derivatives
    half, third, fourth = ahead_s / 2.0, ahead_s / 3.0, ahead_s / 4.0
    return (
        r0 + ahead_s * (r1 + half * (r2 + third * (r3 + fourth * r4))),
        r1 + ahead_s * (r2 + half * (r3 + third * r4)),
        r2 + ahead_s * (r3 + half * r4),
        r3 + ahead_s * r4,
        r4,
    )


def _boxcars(reach: float, bounds: Bounds) -> Times | None:
    return boxcars(reach, bounds) if reach > NOWHERE else None


def _blend(origin: float, reach: float, s: Five) -> Five:
    return (origin + reach * s[0], reach * s[1], reach * s[2], reach * s[3], reach * s[4])
