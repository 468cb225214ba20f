"""Missions: a list of stops relative to the point where the law took over, flown leg by leg, each from rest to rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from mavquad.control.reference import Leg, Pose, ReferenceParams, end_us, hold, plan_leg, sample
from mavquad.frames import nwu_from_ned
from mavquad.schema import Section
from mavquad.types import ReferencePoint, Vec3


class MissionParams(Section):
    """What is flown while the law is in control."""

    name: Literal["box", "hover"] = "box"
    """"box": hover, then a square, north and east first, with a turn at its far corner. "hover": stay."""
    duration_s: float = Field(default=0.0, ge=0.0, le=3600.0)
    """How long the law is in control: 0 for the mission's own length; longer holds the last pose, shorter cuts it."""
    hover_s: float = Field(default=6.0, ge=0.0, le=3600.0)
    """Hover at the start."""
    side_m: float = Field(default=2.0, gt=0.0, le=100.0)
    """Side of the box."""
    turn_deg: float = Field(default=90.0, ge=-180.0, le=180.0)
    """Turn of the box, clockwise seen from above."""
    dwell_s: float = Field(default=0.5, ge=0.0, le=60.0)
    """Rest at each corner."""
    reference: ReferenceParams = ReferenceParams()
    """How briskly the legs are flown."""


@dataclass(frozen=True, slots=True)
class Stop:
    """A pose relative to the start, in NED and with yaw clockwise, and how long to stay there."""

    offset_ned_m: Vec3
    turn_deg: float
    stay_s: float


def stops(params: MissionParams) -> tuple[Stop, ...]:
    """The stops of a mission, the first one at its start."""
    start = Stop((0.0, 0.0, 0.0), 0.0, params.hover_s)
    if params.name == "hover":
        return (start,)
    side, turn, stay = params.side_m, params.turn_deg, params.dwell_s
    return (
        start,
        Stop((side, 0.0, 0.0), 0.0, stay),
        Stop((side, side, 0.0), 0.0, stay),
        Stop((side, side, 0.0), turn, stay),
        Stop((0.0, side, 0.0), turn, stay),
        Stop((0.0, 0.0, 0.0), turn, stay),
    )


class Mission:
    """A mission laid out from a start pose, on the vehicle's clock."""

    def __init__(self, params: MissionParams, origin: Pose, start_us: int) -> None:
        self._legs: list[Leg] = []
        pose, clock_us = origin, start_us
        for number, stop in enumerate(stops(params)):
            if number > 0:
                leg = plan_leg(params.reference, clock_us, pose, _pose(origin, stop))
                self._legs.append(leg)
                pose, clock_us = leg.goal, end_us(leg)
            clock_us += round(stop.stay_s * 1e6)
        own_s = (clock_us - start_us) * 1e-6
        self.start_us = start_us
        self.duration_s = params.duration_s or own_s
        self._origin = origin

    def elapsed_s(self, stamp_us: int) -> float:
        """Time since the start."""
        return (stamp_us - self.start_us) * 1e-6

    def over(self, stamp_us: int) -> bool:
        """Whether its last moment has passed."""
        return self.elapsed_s(stamp_us) >= self.duration_s

    def reference(self, stamp_us: int) -> ReferencePoint:
        """The reference at a moment of the vehicle's clock; at rest before the first leg and after the last."""
        for leg in reversed(self._legs):
            if stamp_us >= leg.start_us:
                return sample(leg, stamp_us)
        return hold(self._origin)


def _pose(origin: Pose, stop: Stop) -> Pose:
    x, y, z = (o + d for o, d in zip(origin.position_nwu_m, nwu_from_ned(stop.offset_ned_m), strict=True))
    # Yaw grows counter-clockwise with z up.
    return Pose((x, y, z), origin.yaw_rad - math.radians(stop.turn_deg))
