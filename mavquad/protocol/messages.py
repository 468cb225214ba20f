"""Pose messages to our types: the flip to z-up happens here, on the way in."""

from __future__ import annotations

import math

from mavquad.frames import euler_flipped, euler_of, flu_from_frd, nwu_from_ned, unit
from mavquad.protocol.codec import Message
from mavquad.types import Attitude, AttitudeTarget, Position


def attitude_from(message: Message) -> Attitude | None:
    """ATTITUDE as ours; None if a value is NaN or infinite."""
    values = (message.roll, message.pitch, message.yaw, message.rollspeed, message.pitchspeed, message.yawspeed)
    if not all(map(math.isfinite, values)):
        return None
    roll, pitch, yaw = euler_flipped(*values[:3])
    return Attitude(message.time_boot_ms * 1000, roll, pitch, yaw, flu_from_frd(values[3:]))


def position_from(message: Message) -> Position | None:
    """LOCAL_POSITION_NED as ours; None if a value is NaN or infinite."""
    values = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
    if not all(map(math.isfinite, values)):
        return None
    return Position(message.time_boot_ms * 1000, nwu_from_ned(values[:3]), nwu_from_ned(values[3:]))


def attitude_target_from(message: Message) -> AttitudeTarget | None:
    """ATTITUDE_TARGET as ours; None if a value is NaN or infinite, or the quaternion is no rotation."""
    w, x, y, z = message.q
    turned = unit((w, x, y, z))
    rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    if turned is None or not all(map(math.isfinite, (*rates, message.thrust))):
        return None
    euler = euler_flipped(*euler_of(turned))
    return AttitudeTarget(message.time_boot_ms * 1000, euler, flu_from_frd(rates), message.thrust)
