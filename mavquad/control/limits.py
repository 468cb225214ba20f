"""The law's demand with limits on what it may ask for on the way: speed of approach and acceleration.

Without limits, for a chain of length r with errors e_i = ref^(i-1) - zeta_i, the law demands

    w = ref^(r) - sigma + gamma_1 e_1 + ... + gamma_r e_r

The same number is found from the inside out,

    speed = (gamma_1 / gamma_2) e_1,   acceleration = ref^(2) + (gamma_2 / gamma_3) (e_2 + speed),
    w = ref^(r) - sigma + gamma_3 (acceleration - zeta_3) + gamma_4 e_4 + ... + gamma_r e_r

and now `speed` and `acceleration` are quantities that can be limited: x and y as a vector (a tilt limit is a limit of the
horizontal acceleration demanded, a = g tan(tilt)), z and yaw each alone. The command itself is never cut for it, and the law
is untouched while no limit is met.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.types import Vec4

Chain = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ChannelLimits:
    """Of one channel, or of a pair taken as a vector; SI units of the output."""

    speed: float
    """Largest speed of approach, above the reference's own."""
    acceleration_low: float
    acceleration_high: float


@dataclass(frozen=True, slots=True)
class DemandLimits:
    """All the limits of one step, and the names that they are reported by."""

    vertical: ChannelLimits
    yaw: ChannelLimits
    horizontal: ChannelLimits


@dataclass(frozen=True, slots=True)
class Demand:
    """What the law wants of the highest derivative of each output, and which limits were met."""

    w: Vec4
    active: tuple[str, ...]


def demand(
    gammas: tuple[Chain, Chain, Chain, Chain],
    references: tuple[Chain, Chain, Chain, Chain],
    estimates: tuple[Chain, Chain, Chain, Chain],
    limits: DemandLimits,
) -> Demand:
    """The law's right side for z, yaw, x, y. Chains are (zeta_1 .. zeta_r, sigma), references have r + 1 entries."""
    active: list[str] = []
    z = _limited_scalar(gammas[0], references[0], estimates[0], limits.vertical, "climb", active)
    yaw = _limited_scalar(gammas[1], references[1], estimates[1], limits.yaw, "yaw", active)
    ax, ay = _limited_horizontal(gammas, references, estimates, limits.horizontal, active)
    return Demand(
        (
            _outer(gammas[0], references[0], estimates[0], z),
            _outer(gammas[1], references[1], estimates[1], yaw),
            _outer(gammas[2], references[2], estimates[2], ax),
            _outer(gammas[3], references[3], estimates[3], ay),
        ),
        tuple(active),
    )


def _outer(gamma: Chain, reference: Chain, zeta: Chain, acceleration: float) -> float:
    """The part of the law from the third state on, given the acceleration to go for."""
    length = len(gamma)
    total = reference[length] - zeta[length] + gamma[2] * (acceleration - zeta[2])
    for i in range(3, length):
        total += gamma[i] * (reference[i] - zeta[i])
    return total


def _limited_scalar(
    gamma: Chain, reference: Chain, zeta: Chain, limits: ChannelLimits, name: str, active: list[str]
) -> float:
    speed = gamma[0] / gamma[1] * (reference[0] - zeta[0])
    if abs(speed) > limits.speed:
        speed = math.copysign(limits.speed, speed)
        active.append(f"{name}_speed")
    wanted = reference[2] + gamma[1] / gamma[2] * (reference[1] - zeta[1] + speed)
    acceleration = min(max(wanted, limits.acceleration_low), limits.acceleration_high)
    if acceleration != wanted:
        active.append(f"{name}_acceleration")
    return acceleration


def _limited_horizontal(
    gammas: tuple[Chain, Chain, Chain, Chain],
    references: tuple[Chain, Chain, Chain, Chain],
    estimates: tuple[Chain, Chain, Chain, Chain],
    limits: ChannelLimits,
    active: list[str],
) -> tuple[float, float]:
    gamma, (x_ref, y_ref), (x, y) = gammas[2], references[2:], estimates[2:]
    inner, outer = gamma[0] / gamma[1], gamma[1] / gamma[2]
    vx, vy = inner * (x_ref[0] - x[0]), inner * (y_ref[0] - y[0])
    size = math.hypot(vx, vy)
    if size > limits.speed:
        vx, vy = vx * limits.speed / size, vy * limits.speed / size
        active.append("horizontal_speed")
    ax = x_ref[2] + outer * (x_ref[1] - x[1] + vx)
    ay = y_ref[2] + outer * (y_ref[1] - y[1] + vy)
    size = math.hypot(ax, ay)
    if size > limits.acceleration_high:
        ax, ay = ax * limits.acceleration_high / size, ay * limits.acceleration_high / size
        active.append("tilt")
    return ax, ay
