"""Guards: named predicates over what was last measured; the first that trips ends our control."""

from __future__ import annotations

import math

from pydantic import Field

from mavquad.flight.guard_set import GuardSections
from mavquad.flight.guard_types import HOLD as HOLD
from mavquad.flight.guard_types import LAND as LAND
from mavquad.flight.guard_types import PILOT as PILOT
from mavquad.flight.guard_types import RETURN as RETURN
from mavquad.flight.guard_types import Reaction as Reaction
from mavquad.flight.guard_types import Tripped as Tripped
from mavquad.types import Attitude, Position


class GuardParams(GuardSections):
    """Limits beyond which the law's control ends and the vehicle is handed back to the autopilot."""

    stale_attitude_s: float = Field(default=0.2, ge=0.02, le=1.0)
    """An attitude older than this; at depths rate and attitude, whose inner loops keep the vehicle upright meanwhile."""
    stale_attitude_at_torque_s: float = Field(default=0.05, ge=0.02, le=1.0)
    """The same at depth torque, where nothing does: PX4 holds the last torque, and tumbles with it within a second."""
    late_position_s: float = Field(default=0.1, ge=0.02, le=2.0)
    """A position older than this: the law flies on its prediction, with a share of its thrust and tilt that shrinks to
    nothing at `stale_position_s`."""
    stale_position_s: float = Field(default=0.5, ge=0.02, le=2.0)
    """A position older than this."""
    stale_reaction: Reaction = LAND
    """What follows a pose that is too old: hold, land, return or pilot (see the tables below)."""
    tilt_deg: float = Field(default=65.0, gt=5.0, le=85.0)
    """Angle between the vehicle's vertical axis and the true vertical."""
    tilt_reaction: Reaction = LAND
    """What follows."""
    radius_m: float = Field(default=20.0, gt=0.5)
    """Horizontal distance from the point of the hand-over."""
    ceiling_m: float = Field(default=20.0, gt=0.5)
    """Height above the arming point."""
    floor_m: float = Field(default=0.5, ge=0.0)
    """Height above the arming point."""
    volume_reaction: Reaction = LAND
    """What follows when it leaves the volume that radius, ceiling and floor enclose."""


def tilt_rad(attitude: Attitude) -> float:
    """Angle between body z and the vertical: cos(tilt) is the (3, 3) entry of the rotation matrix."""
    return math.acos(max(-1.0, min(1.0, math.cos(attitude.roll_rad) * math.cos(attitude.pitch_rad))))


def check(
    params: GuardParams,
    attitude: Attitude,
    position: Position,
    origin_nwu_m: tuple[float, float, float],
    ground_m: float,
) -> Tripped | None:
    """The first guard that trips on fresh measurements, or None.

    Args:
        params: the limits.
        attitude: last measured.
        position: last measured.
        origin_nwu_m: where the law took over.
        ground_m: z (up) of the arming point.
    """
    tilt_deg = math.degrees(tilt_rad(attitude))
    if tilt_deg > params.tilt_deg:
        return Tripped("tilt", f"tilt is {tilt_deg:.0f} degrees, {params.tilt_deg:g} allowed", params.tilt_reaction)
    x, y, z = position.position_nwu_m
    radius_m = math.hypot(x - origin_nwu_m[0], y - origin_nwu_m[1])
    if radius_m > params.radius_m:
        return Tripped(
            "volume",
            f"{radius_m:.1f} m from the hand-over point, {params.radius_m:g} m allowed",
            params.volume_reaction,
        )
    height_m = z - ground_m
    if not params.floor_m <= height_m <= params.ceiling_m:
        allowed = f"{params.floor_m:g} to {params.ceiling_m:g} m allowed"
        return Tripped("volume", f"height is {height_m:.1f} m, {allowed}", params.volume_reaction)
    return None


def stale(name: str, age_s: float, limit_s: float, reaction: Reaction = LAND) -> Tripped:
    """The pose stream stopped."""
    return Tripped("stale pose", f"no {name} for {age_s:.2f} s, {limit_s:g} s allowed", reaction)


def not_a_number(name: str, reaction: Reaction = LAND) -> Tripped:
    """A pose message holds NaN or infinity."""
    return Tripped("NaN", f"{name} holds a value that is not a number", reaction)
