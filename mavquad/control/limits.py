"""The law's demand with limits on what it may ask for on the way: speed of approach, thrust and tilt, jerk.

Without limits, for a chain of length r with errors e_i = ref^(i-1) - zeta_i, the law demands

    w = ref^(r) - sigma + gamma_1 e_1 + ... + gamma_r e_r

The same number is found from the inside out, with gamma_(r+1) = 1,

    v_1 = ref^(1) + gamma_1 / gamma_2 e_1,   v_i = ref^(i) + gamma_i / gamma_(i+1) (v_(i-1) - zeta_i),   w = v_r - sigma

and now v_1, v_2 and v_3, the speed, acceleration and jerk to go for, can be limited: x and y as a vector, z and yaw each
alone. The acceleration is limited where it is thrust: what wind and friction do (d) does not lean the vehicle, so the limit
is on v_2 - d, within a cone of tilt and a shell of thrust. The command itself is never cut for it, and the law is
untouched while no limit is met.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from mavquad.control.model import GRAVITY_M_S2
from mavquad.types import Vec4

Values = Sequence[float]


@dataclass(frozen=True, slots=True)
class DemandLimits:
    """All the limits of one step.

    Attributes:
        speed_m_s: largest horizontal speed of approach, above the reference's own.
        climb_m_s: the same of z.
        yaw_rate_rad_s: the same of yaw.
        yaw_acceleration_rad_s2: largest yaw acceleration aimed at.
        thrust_low_m_s2: least thrust per mass.
        thrust_high_m_s2: greatest.
        tilt_tangent: tangent of the largest tilt.
        jerk_m_s3: largest horizontal jerk aimed at: how fast the thrust may turn.
    """

    speed_m_s: float
    climb_m_s: float
    yaw_rate_rad_s: float
    yaw_acceleration_rad_s2: float
    thrust_low_m_s2: float
    thrust_high_m_s2: float
    tilt_tangent: float
    jerk_m_s3: float

    def shrunk(self, authority: float) -> DemandLimits:
        """The limits with a share of the room around level hover thrust: 1 is all of it, 0 none."""
        low, high = self.thrust_low_m_s2, self.thrust_high_m_s2
        return replace(
            self,
            tilt_tangent=authority * self.tilt_tangent,
            thrust_low_m_s2=GRAVITY_M_S2 + authority * (low - GRAVITY_M_S2),
            thrust_high_m_s2=GRAVITY_M_S2 + authority * (high - GRAVITY_M_S2),
        )


class Demand(NamedTuple):
    """What the law wants of the highest derivative of each output, and which limits were met."""

    w: Vec4
    active: tuple[str, ...]


def ratios(gammas: Sequence[float]) -> tuple[float, ...]:
    """gamma_i / gamma_(i+1), i = 1 .. r: the gains of the law from the inside out."""
    return tuple(inner / outer for inner, outer in zip(gammas, (*gammas[1:], 1.0), strict=True))


def demand(
    ratios: tuple[Values, Values, Values, Values],
    references: tuple[Values, Values, Values, Values],
    chains: tuple[Values, Values, Values, Values],
    winds: tuple[float, float, float],
    limits: DemandLimits,
) -> Demand:
    """The law's right side for z, yaw, x, y.

    Args:
        ratios: of each channel, see the function of that name.
        references: each with r + 1 entries or more.
        chains: zeta_1 .. zeta_r, sigma of each channel.
        winds: d of z, x, y: the acceleration that is not the thrust's, as far as it is told apart.
        limits: what may be asked for.
    """
    active: list[str] = []
    place, (x_ref, y_ref), (x, y) = ratios[2], references[2:], chains[2:]
    lift = _vertical(ratios[0], references[0], chains[0], winds[0], limits, active)
    yaw = _turning(ratios[1], references[1], chains[1], limits, active)
    go_x, go_y = _horizontal(place, (x_ref, y_ref), (x, y), winds, lift + GRAVITY_M_S2, limits, active)
    level = _JERK if len(place) > _JERK else 2
    return Demand(
        (
            _outward(ratios[0], references[0], chains[0], lift + winds[0], 2),
            yaw,
            _outward(place, x_ref, x, go_x, level),
            _outward(place, y_ref, y, go_y, level),
        ),
        tuple(active),
    )


_JERK = 3


def _outward(ratio: Values, reference: Values, zeta: Values, aim: float, level: int) -> float:
    """w from v_level."""
    length = len(ratio)
    while level < length:
        aim = reference[level + 1] + ratio[level] * (aim - zeta[level])
        level += 1
    return aim - zeta[length]


def _vertical(
    ratio: Values, reference: Values, zeta: Values, wind: float, limits: DemandLimits, active: list[str]
) -> float:
    """The vertical acceleration of the thrust, less gravity."""
    speed = ratio[0] * (reference[0] - zeta[0])
    if abs(speed) > limits.climb_m_s:
        speed = math.copysign(limits.climb_m_s, speed)
        active.append("climb_speed")
    wanted = reference[2] + ratio[1] * (reference[1] + speed - zeta[1]) - wind
    acceleration = min(max(wanted, limits.thrust_low_m_s2 - GRAVITY_M_S2), limits.thrust_high_m_s2 - GRAVITY_M_S2)
    if acceleration != wanted:
        active.append("climb_acceleration")
    return acceleration


def _turning(ratio: Values, reference: Values, zeta: Values, limits: DemandLimits, active: list[str]) -> float:
    """w of yaw."""
    speed = ratio[0] * (reference[0] - zeta[0])
    if abs(speed) > limits.yaw_rate_rad_s:
        speed = math.copysign(limits.yaw_rate_rad_s, speed)
        active.append("yaw_speed")
    aim = reference[1] + speed
    if len(ratio) == 1:
        return aim - zeta[1]
    wanted = reference[2] + ratio[1] * (aim - zeta[1])
    most = limits.yaw_acceleration_rad_s2
    aim = min(max(wanted, -most), most)
    if aim != wanted:
        active.append("yaw_acceleration")
    return _outward(ratio, reference, zeta, aim, 2)


def _horizontal(
    ratio: Values,
    references: tuple[Values, Values],
    chains: tuple[Values, Values],
    winds: tuple[float, float, float],
    lift_m_s2: float,
    limits: DemandLimits,
    active: list[str],
) -> tuple[float, float]:
    """v_2 of x and y for r up to 3, v_3 from there on."""
    (x_ref, y_ref), (x, y), (_, wind_x, wind_y) = references, chains, winds
    vx, vy = ratio[0] * (x_ref[0] - x[0]), ratio[0] * (y_ref[0] - y[0])
    if _too_long(vx, vy, limits.speed_m_s):
        vx, vy = _shortened(vx, vy, limits.speed_m_s)
        active.append("horizontal_speed")
    ax = x_ref[2] + ratio[1] * (x_ref[1] + vx - x[1]) - wind_x
    ay = y_ref[2] + ratio[1] * (y_ref[1] + vy - y[1]) - wind_y
    lean = min(limits.tilt_tangent * lift_m_s2, _leg(limits.thrust_high_m_s2, lift_m_s2))
    if _too_long(ax, ay, lean):
        ax, ay = _shortened(ax, ay, lean)
        active.append("tilt")
    ax, ay = ax + wind_x, ay + wind_y
    if len(ratio) <= _JERK:
        return ax, ay
    jx, jy = x_ref[3] + ratio[2] * (ax - x[2]), y_ref[3] + ratio[2] * (ay - y[2])
    if _too_long(jx, jy, limits.jerk_m_s3):
        jx, jy = _shortened(jx, jy, limits.jerk_m_s3)
        active.append("jerk")
    return jx, jy


def _too_long(x: float, y: float, most: float) -> bool:
    return x * x + y * y > most * most


def _shortened(x: float, y: float, most: float) -> tuple[float, float]:
    scale = most / math.hypot(x, y)
    return x * scale, y * scale


def _leg(hypotenuse: float, other: float) -> float:
    """What a thrust of limited size leaves for the horizontal; a tenth of it at least."""
    return math.sqrt(max(hypotenuse * hypotenuse - other * other, 0.01 * hypotenuse * hypotenuse))
