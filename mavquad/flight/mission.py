"""Missions: what is flown, from the point where the law took over, from rest to rest."""

from __future__ import annotations

from bisect import bisect_right

from mavquad.control.reference import Leg, Pose, end_us, hold, plan_leg, sample
from mavquad.flight.mission_params import MissionParams
from mavquad.flight.mission_plan import Stop, motion_channels, plan_mission, stops
from mavquad.frames import unwrap_near
from mavquad.types import ReferencePoint

__all__ = ["Mission", "MissionParams", "Stop", "stops"]


class Mission:
    """A mission laid out from a start pose, on the vehicle's clock."""

    def __init__(self, params: MissionParams, origin: Pose, start_us: int) -> None:
        plan = plan_mission(params)
        self.start_us = start_us
        self._align: Leg | None = None
        self._shift_us = start_us
        yaw0 = origin.yaw_rad
        if plan.first_heading_rad is not None:
            heading = unwrap_near(plan.first_heading_rad, origin.yaw_rad)
            departure_us = start_us + round(params.hover_s * 1e6)
            self._align = plan_leg(params.reference, departure_us, origin, Pose(origin.position_nwu_m, heading))
            self._shift_us += end_us(self._align) - departure_us
            yaw0 = heading - plan.first_heading_rad
        own_s = (plan.own_us + self._shift_us - start_us) * 1e-6
        self.duration_s = params.duration_s or own_s
        self._motions = plan.motions
        self._starts_us = [motion.start_us for motion in plan.motions]
        self._offset = (*origin.position_nwu_m, yaw0)
        self._rest = hold(origin)

    def elapsed_s(self, stamp_us: int) -> float:
        """Time since the start."""
        return (stamp_us - self.start_us) * 1e-6

    def over(self, stamp_us: int) -> bool:
        """Whether its last moment has passed."""
        return self.elapsed_s(stamp_us) >= self.duration_s

    def spans(self) -> list[tuple[float, float, bool]]:
        """When something moves: start and end (s since the start of the mission), and whether along a curve."""
        legs = [] if self._align is None else [(self._align.start_us, self._align)]
        moves = [*legs, *((motion.start_us + self._shift_us, motion) for motion in self._motions)]
        return [
            (self.elapsed_s(start_us), self.elapsed_s(start_us) + motion.duration_s, not isinstance(motion, Leg))
            for start_us, motion in moves
        ]

    def reference(self, stamp_us: int) -> ReferencePoint:
        """The reference at a moment of the vehicle's clock, asked for in any order; at rest before, between and after."""
        since_us = stamp_us - self._shift_us
        number = bisect_right(self._starts_us, since_us) - 1
        if number < 0 or (self._align is not None and stamp_us < self._align.start_us):
            return self._rest if self._align is None else sample(self._align, stamp_us)
        (z0, *z), (yaw0, *yaw), (x0, *x), (y0, *y) = motion_channels(self._motions[number], since_us)
        x_m, y_m, z_m, yaw_rad = self._offset
        return ReferencePoint((z0 + z_m, *z), (yaw0 + yaw_rad, *yaw), (x0 + x_m, *x), (y0 + y_m, *y))
