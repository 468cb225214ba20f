"""From the highest derivatives demanded of z, x and y to the inputs of thrust, roll and pitch, and back.

The thrust per mass T along r3 = R e3 gives the acceleration T r3 - g e3. One derivative after the other, in the body's
axes (FLU, rates p, q, r), with S = (s1, s2, s3) = R^T demanded:

    attitude  (r = 2)   T r3 = demanded + g e3
    rate      (r = 3)   s = (T q, -T p, T_d)
    torque    (r = 4)   s = (2 T_d q + T (q_d + r p),  -2 T_d p + T (-p_d + r q),  T_dd - T (p^2 + q^2))

The determinant is T^2: nothing is singular but free fall, the Euler form's 90 degrees of roll included (b4 of the paper is
this after its Euler accelerations are turned into the body's). No yaw input enters.

The constant form is the paper's b(0, yaw): level, T = g, no rates; its roll and pitch inputs are derivatives of the Euler
angles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavquad.control.euler import Trig
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.normal_form import DETERMINANT_MIN_M_S2, apply_b0, solve_b0
from mavquad.types import Vec3

Inputs = Vec3
"""(thrust, roll, pitch): T or its derivative; angle, rate or acceleration about x and y."""


class Gain(NamedTuple):
    """The input gain that the law counts on.

    Attributes:
        length: r.
        constant: b(0, yaw) instead of the one at this attitude.
        t: attitude when the command acts.
        thrust_m_s2: T then; and its derivative.
        rates_flu_rad_s: p, q, r.
        known: derivatives of z, x, y that come without inputs: friction.
    """

    length: int
    constant: bool
    t: Trig
    thrust_m_s2: float = GRAVITY_M_S2
    thrust_rate_m_s3: float = 0.0
    rates_flu_rad_s: Vec3 = (0.0, 0.0, 0.0)
    known: Vec3 = (0.0, 0.0, 0.0)


def solve(gain: Gain, demanded: Vec3) -> Inputs:
    """Inputs (thrust, roll, pitch) that give these derivatives of (z, x, y)."""
    (wz, wx, wy), (kz, kx, ky) = demanded, gain.known
    wz, wx, wy = wz - kz, wx - kx, wy - ky
    if gain.constant:
        thrust, _, roll, pitch = solve_b0(gain.t.s_yaw, gain.t.c_yaw, GRAVITY_M_S2, (wz, 0.0, wx, wy))
        return (thrust + GRAVITY_M_S2, roll, pitch) if gain.length == 2 else (thrust, roll, pitch)
    if gain.length == 2:
        return _leaning(gain.t, (wx, wy, wz + GRAVITY_M_S2))
    s1, s2, s3 = _to_body(gain.t, (wx, wy, wz))
    e1, e2, e3 = _drift(gain)
    thrust = max(gain.thrust_m_s2, DETERMINANT_MIN_M_S2)
    return (s3 - e3, -(s2 - e2) / thrust, (s1 - e1) / thrust)


def apply(gain: Gain, inputs: Inputs) -> Vec3:
    """Derivatives of (z, x, y) that these inputs give."""
    thrust, roll, pitch = inputs
    kz, kx, ky = gain.known
    if gain.constant:
        if gain.length == 2:
            thrust -= GRAVITY_M_S2
        wz, _, wx, wy = apply_b0(gain.t.s_yaw, gain.t.c_yaw, GRAVITY_M_S2, (thrust, 0.0, roll, pitch))
        return (wz + kz, wx + kx, wy + ky)
    if gain.length == 2:
        fx, fy, fz = _force(gain.t, thrust, roll, pitch)
        return (fz - GRAVITY_M_S2 + kz, fx + kx, fy + ky)
    e1, e2, e3 = _drift(gain)
    level = max(gain.thrust_m_s2, DETERMINANT_MIN_M_S2)
    x, y, z = to_world(gain.t, (level * pitch + e1, -level * roll + e2, thrust + e3))
    return (z + kz, x + kx, y + ky)


def to_world(t: Trig, body: Vec3) -> Vec3:
    """R times a vector of the body's axes."""
    (a, b, c), (s_roll, c_roll, s_pitch, c_pitch, s_yaw, c_yaw) = body, t
    # Rz(yaw) Ry(pitch) Rx(roll), from the right.
    b, c = c_roll * b - s_roll * c, s_roll * b + c_roll * c
    a, c = c_pitch * a + s_pitch * c, -s_pitch * a + c_pitch * c
    return (c_yaw * a - s_yaw * b, s_yaw * a + c_yaw * b, c)


def _to_body(t: Trig, world: Vec3) -> Vec3:
    (a, b, c), (s_roll, c_roll, s_pitch, c_pitch, s_yaw, c_yaw) = world, t
    a, b = c_yaw * a + s_yaw * b, -s_yaw * a + c_yaw * b
    a, c = c_pitch * a - s_pitch * c, s_pitch * a + c_pitch * c
    return (a, c_roll * b + s_roll * c, -s_roll * b + c_roll * c)


def _drift(gain: Gain) -> Vec3:
    """The terms of s without inputs."""
    if gain.length == 3:
        return (0.0, 0.0, 0.0)
    p, q, r = gain.rates_flu_rad_s
    thrust, twice = gain.thrust_m_s2, 2.0 * gain.thrust_rate_m_s3
    return (twice * q + thrust * r * p, -twice * p + thrust * r * q, -thrust * (p * p + q * q))


def _leaning(t: Trig, force: Vec3) -> Inputs:
    """Thrust, roll and pitch of a thrust vector, at the yaw of `t`: in its frame r3 = (sp cr, -sr, cp cr)."""
    fx, fy, fz = force
    ahead, left = t.c_yaw * fx + t.s_yaw * fy, -t.s_yaw * fx + t.c_yaw * fy
    thrust = math.sqrt(fx * fx + fy * fy + fz * fz)
    if thrust < DETERMINANT_MIN_M_S2:
        return (thrust, 0.0, 0.0)
    return (thrust, -math.asin(left / thrust), math.atan2(ahead, fz))


def _force(t: Trig, thrust: float, roll: float, pitch: float) -> Vec3:
    ahead, left = thrust * math.sin(pitch) * math.cos(roll), -thrust * math.sin(roll)
    up = thrust * math.cos(pitch) * math.cos(roll)
    return (t.c_yaw * ahead - t.s_yaw * left, t.s_yaw * ahead + t.c_yaw * left, up)
