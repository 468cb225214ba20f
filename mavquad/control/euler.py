"""Euler angles (R = Rz(yaw) Ry(pitch) Rx(roll), FLU to NWU) against what the gyroscope and the wire speak of.

    p = roll_d - yaw_d sin(pitch)
    q = pitch_d cos(roll) + yaw_d sin(roll) cos(pitch)
    r = -pitch_d sin(roll) + yaw_d cos(roll) cos(pitch)

The paper sets J times the second derivatives of the angles equal to torques. A body answers torques with p_d, q_d, r_d;
the two agree at level only, so the law's u2, u3, u4 pass through `body_acceleration` on their way to the wire.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavquad.types import Vec3

_COS_PITCH_MIN = 1e-3
"""Nose straight up or down has no Euler rates; a finite answer is kept there."""


class Trig(NamedTuple):
    """Sines and cosines of one attitude, worked out once a step."""

    s_roll: float
    c_roll: float
    s_pitch: float
    c_pitch: float
    s_yaw: float
    c_yaw: float


def trig(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Trig:
    """The six numbers that every rotation formula is made of."""
    return Trig(
        math.sin(roll_rad),
        math.cos(roll_rad),
        math.sin(pitch_rad),
        math.cos(pitch_rad),
        math.sin(yaw_rad),
        math.cos(yaw_rad),
    )


def euler_rates(t: Trig, rates_flu_rad_s: Vec3) -> Vec3:
    """(roll_d, pitch_d, yaw_d) from body rates."""
    p, q, r = rates_flu_rad_s
    c_pitch = math.copysign(max(abs(t.c_pitch), _COS_PITCH_MIN), t.c_pitch)
    yaw_d = (q * t.s_roll + r * t.c_roll) / c_pitch
    return (p + yaw_d * t.s_pitch, q * t.c_roll - r * t.s_roll, yaw_d)


def body_rates(t: Trig, euler_rates_rad_s: Vec3) -> Vec3:
    """(p, q, r) from Euler rates."""
    roll_d, pitch_d, yaw_d = euler_rates_rad_s
    return (
        roll_d - yaw_d * t.s_pitch,
        pitch_d * t.c_roll + yaw_d * t.s_roll * t.c_pitch,
        -pitch_d * t.s_roll + yaw_d * t.c_roll * t.c_pitch,
    )


def body_acceleration(t: Trig, euler_rates_rad_s: Vec3, euler_accelerations_rad_s2: Vec3) -> Vec3:
    """(p_d, q_d, r_d): the derivative of `body_rates`, product terms of the rates included."""
    roll_d, pitch_d, yaw_d = euler_rates_rad_s
    p, q, r = body_rates(t, euler_accelerations_rad_s2)
    return (
        p - yaw_d * pitch_d * t.c_pitch,
        q - pitch_d * roll_d * t.s_roll + yaw_d * (roll_d * t.c_roll * t.c_pitch - pitch_d * t.s_roll * t.s_pitch),
        r - pitch_d * roll_d * t.c_roll - yaw_d * (roll_d * t.s_roll * t.c_pitch + pitch_d * t.c_roll * t.s_pitch),
    )
