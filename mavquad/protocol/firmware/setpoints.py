"""The law's command on the wire, at each depth: the four numbers, and the message that carries them."""

from __future__ import annotations

import math

from mavquad.frames import euler_flipped, frd_from_flu, wrap_pi
from mavquad.protocol.codec import Message, mavlink
from mavquad.types import Depth, LawCommand, RateCommand, TorqueCommand, Vec3, Vec4


def controls(command: LawCommand, scale_frd_rad_s2: Vec3, hover_thrust_norm: float, gravity_m_s2: float) -> Vec4:
    """The law's command as the four numbers that go on the wire, thrust (0..1) the last; by the command's depth:

    torque: roll, pitch, yaw control of the mixer in -1..1 (FRD); rate: body rates p, q, r in rad/s (FRD);
    attitude: roll, pitch, yaw in rad (FRD to NED), yaw within [-pi, pi).

    Args:
        command: what the law asks for, NWU and FLU.
        scale_frd_rad_s2: angular acceleration at a control of 1, per axis (a property of the airframe; torque only).
        hover_thrust_norm: the thrust control that carries the weight when level.
        gravity_m_s2: the gravity that the law calls hover.
    """
    if isinstance(command, TorqueCommand):
        a, b, c = _torques(frd_from_flu(command.angular_acceleration_flu_rad_s2), scale_frd_rad_s2)
    elif isinstance(command, RateCommand):
        a, b, c = frd_from_flu(command.rates_flu_rad_s)
    else:
        a, b, c = euler_flipped(command.roll_rad, command.pitch_rad, command.yaw_rad)
        c = wrap_pi(c)
    return (a, b, c, _clip(hover_thrust_norm * command.specific_thrust_m_s2 / gravity_m_s2, 0.0))


def safe_controls(depth: Depth, hover_thrust_norm: float, yaw_ned_rad: float) -> Vec4:
    """The four numbers that ask for hover thrust and no rotation: at depth attitude level, at the present heading."""
    yaw_rad = wrap_pi(yaw_ned_rad) if depth == "attitude" else 0.0
    return (0.0, 0.0, yaw_rad, _clip(hover_thrust_norm, 0.0))


def setpoint(stamp_us: int, depth: Depth, controls: Vec4, system_id: int, component_id: int) -> Message:
    """The setpoint message of a depth, from the four numbers that `controls` gives."""
    if depth == "torque":
        return torque_setpoint(stamp_us, controls, system_id, component_id)
    return attitude_target(stamp_us, depth, controls, system_id, component_id)


def _torques(angular_acceleration_frd_rad_s2: Vec3, scale_frd_rad_s2: Vec3) -> Vec3:
    roll, pitch, yaw = angular_acceleration_frd_rad_s2
    return (
        _clip(roll / scale_frd_rad_s2[0], -1.0),
        _clip(pitch / scale_frd_rad_s2[1], -1.0),
        _clip(yaw / scale_frd_rad_s2[2], -1.0),
    )


def _clip(value: float, low: float) -> float:
    return min(max(value, low), 1.0)


def torque_setpoint(stamp_us: int, controls: Vec4, system_id: int, component_id: int) -> Message:
    """SET_ACTUATOR_CONTROL_TARGET for the flight control group (group_mlx 0) of the vehicle."""
    return mavlink.MAVLink_set_actuator_control_target_message(
        stamp_us, 0, system_id, component_id, [*controls, 0.0, 0.0, 0.0, 0.0]
    )


IGNORE_RATES = 0x07
IGNORE_ATTITUDE = 0x80
"""Bits of SET_ATTITUDE_TARGET.type_mask. Without one of them PX4 follows attitude and rates in turns. Both firmwares take
them; ArduCopter reads the thrust as a climb rate unless GUID_OPTIONS has bit 3 (value 8)."""


def attitude_target(stamp_us: int, depth: Depth, controls: Vec4, system_id: int, component_id: int) -> Message:
    """SET_ATTITUDE_TARGET of depth rate or attitude.

    Neither firmware reads its time_boot_ms; it carries the stamp's milliseconds modulo 2^32.
    """
    a, b, c, thrust_norm = controls
    is_rate = depth == "rate"
    return mavlink.MAVLink_set_attitude_target_message(
        stamp_us // 1000 & 0xFFFFFFFF,
        system_id,
        component_id,
        IGNORE_ATTITUDE if is_rate else IGNORE_RATES,
        [1.0, 0.0, 0.0, 0.0] if is_rate else list(_quaternion(a, b, c)),
        *((a, b, c) if is_rate else (0.0, 0.0, 0.0)),
        thrust_norm,
    )


def _quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Vec4:
    """(w, x, y, z) of Rz(yaw) Ry(pitch) Rx(roll), FRD to NED."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
