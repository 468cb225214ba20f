"""Rest-to-rest references with four continuous derivatives, and holding still.

The polynomial of degree 9 that goes from 0 to 1 with four derivatives zero at both ends:

    s(u) = 126 u^5 - 420 u^6 + 540 u^7 - 315 u^8 + 70 u^9,      s_d(u) = 630 u^4 (1 - u)^4

Its largest rate is s_d(1/2) = 630 / 256 and its largest second derivative 2520 (3/14)^3 / sqrt(7), at u (1 - u) = 3 / 14:
the duration follows from the limits without a search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pydantic import Field

from mavquad.frames import unwrap_near
from mavquad.schema import Section
from mavquad.types import ReferencePoint, Vec3

PEAK_RATE = 630.0 / 256.0
PEAK_ACCELERATION = 2520.0 * (3.0 / 14.0) ** 3 / math.sqrt(7.0)

_POWERS = (5, 6, 7, 8, 9)
_SHAPES = tuple(
    tuple(c * math.perm(p, k) for c, p in zip((126.0, -420.0, 540.0, -315.0, 70.0), _POWERS, strict=True))
    for k in range(5)
)
"""Coefficients of the k-th derivative of s, k = 0 .. 4."""


class ReferenceParams(Section):
    """[mission.reference]: how briskly the reference moves from pose to pose."""

    speed_max_m_s: float = Field(default=1.5, gt=0.0, le=20.0)
    """Largest speed of the reference between two poses, m/s."""
    acceleration_max_m_s2: float = Field(default=1.2, gt=0.0, le=15.0)
    """Largest acceleration of the reference, m/s^2."""
    yaw_rate_max_deg_s: float = Field(default=45.0, gt=0.0, le=360.0)
    """Largest yaw rate of the reference, deg/s."""
    yaw_acceleration_max_deg_s2: float = Field(default=45.0, gt=0.0, le=1000.0)
    """Largest yaw acceleration of the reference, deg/s^2. A quadcopter's yaw is weak."""
    duration_min_s: float = Field(default=1.0, ge=0.1, le=60.0)
    """No leg is shorter than this, s."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where to be, and where to look; yaw continuous, not wrapped."""

    position_nwu_m: Vec3
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class Leg:
    """From rest at one pose to rest at another."""

    start_us: int
    duration_s: float
    origin: Pose
    goal: Pose


def plan_leg(params: ReferenceParams, start_us: int, origin: Pose, goal: Pose) -> Leg:
    """The leg that keeps to the limits in the least time; yaw goes the shorter way round."""
    yaw_goal = unwrap_near(goal.yaw_rad, origin.yaw_rad)
    distance_m = math.dist(origin.position_nwu_m, goal.position_nwu_m)
    turn_rad = abs(yaw_goal - origin.yaw_rad)
    duration_s = max(
        params.duration_min_s,
        _duration_s(distance_m, params.speed_max_m_s, params.acceleration_max_m_s2),
        _duration_s(
            turn_rad, math.radians(params.yaw_rate_max_deg_s), math.radians(params.yaw_acceleration_max_deg_s2)
        ),
    )
    return Leg(start_us, duration_s, origin, Pose(goal.position_nwu_m, yaw_goal))


def end_us(leg: Leg) -> int:
    """When the leg is at its goal."""
    return leg.start_us + round(leg.duration_s * 1e6)


def sample(leg: Leg, stamp_us: int) -> ReferencePoint:
    """The reference at a moment: the origin before the leg, the goal after it."""
    u = (stamp_us - leg.start_us) * 1e-6 / leg.duration_s
    if u <= 0.0:
        return hold(leg.origin)
    if u >= 1.0:
        return hold(leg.goal)
    shape = _shape(u, leg.duration_s)
    x, y, z = (_blend(a, b, shape) for a, b in zip(leg.origin.position_nwu_m, leg.goal.position_nwu_m, strict=True))
    return ReferencePoint(z_m=z, yaw_rad=_blend(leg.origin.yaw_rad, leg.goal.yaw_rad, shape), x_m=x, y_m=y)


def hold(pose: Pose) -> ReferencePoint:
    """Stand still at a pose."""
    x, y, z = pose.position_nwu_m
    still = (0.0, 0.0, 0.0, 0.0)
    return ReferencePoint(z_m=(z, *still), yaw_rad=(pose.yaw_rad, *still), x_m=(x, *still), y_m=(y, *still))


def shifted(derivatives: tuple[float, ...], ahead_s: float) -> tuple[float, ...]:
    """A channel of a reference (its value and four derivatives) some time later, by its own Taylor series."""
    r0, r1, r2, r3, r4 = derivatives
    half, third, fourth = ahead_s / 2.0, ahead_s / 3.0, ahead_s / 4.0
    return (
        r0 + ahead_s * (r1 + half * (r2 + third * (r3 + fourth * r4))),
        r1 + ahead_s * (r2 + half * (r3 + third * r4)),
        r2 + ahead_s * (r3 + half * r4),
        r3 + ahead_s * r4,
        r4,
    )


def _shape(u: float, duration_s: float) -> tuple[float, ...]:
    values = []
    for k, coefficients in enumerate(_SHAPES):
        total = 0.0
        for c in reversed(coefficients):
            total = total * u + c
        values.append(total * u ** (5 - k) / duration_s**k)
    return tuple(values)


def _blend(origin: float, goal: float, shape: tuple[float, ...]) -> tuple[float, ...]:
    reach = goal - origin
    return (origin + reach * shape[0], *(reach * s for s in shape[1:]))


def _duration_s(reach: float, rate_max: float, acceleration_max: float) -> float:
    return max(PEAK_RATE * reach / rate_max, math.sqrt(PEAK_ACCELERATION * reach / acceleration_max))
