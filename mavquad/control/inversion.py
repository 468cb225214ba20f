"""From the fourth derivatives demanded to the inputs U, and from what U became back to what the chains will feel."""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.euler import Trig
from mavquad.control.integrators import Integrator, allowed_drive
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.normal_form import apply_b0, apply_b4, solve_b0, solve_b4
from mavquad.control.saturation import is_saturated, smooth_saturation
from mavquad.types import Vec4

_SATURATED = ("saturation_thrust", "saturation_yaw", "saturation_roll", "saturation_pitch")
_STOPPED = ("thrust", "yaw_input")


@dataclass(frozen=True, slots=True)
class Gain:
    """The input gain and drift that the law counts on: b4(0, yaw) and no q4, or b4 and q4 of the measured state."""

    t: Trig
    full: bool
    thrust_m_s2: float = GRAVITY_M_S2
    drift: Vec4 = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Realised:
    """U as it will be integrated and sent, the chain input that it makes, and the limits met on the way."""

    inputs: Vec4
    w: Vec4
    active: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Of u1 and u2."""

    thrust_low_m_s2: float
    thrust_high_m_s2: float
    yaw_high_rad_s2: float


def realise(gain: Gain, demanded: Vec4, levels: Vec4, thrust: Integrator, yaw: Integrator, bounds: Bounds) -> Realised:
    """U = sat_N(B^-1 (w - q)), its first two entries kept to what the integrators may take, and w = q + B U again."""
    wanted = _solve(gain, demanded)
    n1, n2, n3, n4 = levels
    v1, v2 = smooth_saturation(wanted[0], n1), smooth_saturation(wanted[1], n2)
    inputs = (
        allowed_drive(thrust, v1, bounds.thrust_low_m_s2, bounds.thrust_high_m_s2),
        allowed_drive(yaw, v2, -bounds.yaw_high_rad_s2, bounds.yaw_high_rad_s2),
        smooth_saturation(wanted[2], n3),
        smooth_saturation(wanted[3], n4),
    )
    active = () if inputs == wanted else _active(wanted, (v1, v2), inputs, levels)
    return Realised(inputs, _apply(gain, inputs), active)


def _active(wanted: Vec4, smoothed: tuple[float, float], inputs: Vec4, levels: Vec4) -> tuple[str, ...]:
    saturated = [name for name, u, n in zip(_SATURATED, wanted, levels, strict=True) if is_saturated(u, n)]
    stopped = [name for name, a, b in zip(_STOPPED, smoothed, inputs, strict=False) if a != b]
    return (*saturated, *stopped)


def _solve(gain: Gain, w: Vec4) -> Vec4:
    q = gain.drift
    remaining = (w[0] - q[0], w[1] - q[1], w[2] - q[2], w[3] - q[3])
    if not gain.full:
        return solve_b0(gain.t.s_yaw, gain.t.c_yaw, GRAVITY_M_S2, remaining)
    return solve_b4(gain.t, gain.thrust_m_s2, remaining)


def _apply(gain: Gain, inputs: Vec4) -> Vec4:
    q = gain.drift
    if gain.full:
        wz, wyaw, wx, wy = apply_b4(gain.t, gain.thrust_m_s2, inputs)
    else:
        wz, wyaw, wx, wy = apply_b0(gain.t.s_yaw, gain.t.c_yaw, GRAVITY_M_S2, inputs)
    return (wz + q[0], wyaw + q[1], wx + q[2], wy + q[3])
