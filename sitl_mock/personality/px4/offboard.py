"""OFFBOARD setpoints as PX4 takes them: messages 82, 84 and (firmware 1.13) 139 to setpoints of the inner loops.

SET_ATTITUDE_TARGET (82) by its type_mask: with the attitude not ignored it is an attitude, with the yaw rate (if not
ignored) as feed-forward; with roll and pitch rate not ignored it is body rates; it can be both, and these fight: PX4
follows the rates until its attitude controller runs the next time, which is one tick later here. THRUST_BODY_SET
counts for an attitude only; body rates take the field `thrust` all the same.
"""

from __future__ import annotations

import math
import struct

from mavquad.protocol.codec import Message
from sitl_mock.config import Px4Release
from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.inner_loops import AttitudeSetpoint, PositionSetpoint, RatesSetpoint, Setpoint, TorqueSetpoint

_IGNORE_ROLL_OR_PITCH_RATE = 0x03
_IGNORE_YAW_RATE = 0x04
_THRUST_BODY_SET = 0x20
_IGNORE_THROTTLE = 0x40
_IGNORE_ATTITUDE = 0x80
_IGNORE_POSITION, _IGNORE_VELOCITY, _IGNORE_ACCELERATION, _IGNORE_YAW = 0x007, 0x038, 0x1C0, 0x400
_LOCAL_NED, _BODY_NED = 1, 8
_MAGIC_V2, _PAYLOAD_AT, _THRUST_BODY_DOWN_AT = 0xFD, 10, 47


class OffboardInput:
    """The last setpoint and when it came. Any of the three messages keeps OFFBOARD alive."""

    def __init__(self, firmware: Px4Release) -> None:
        self._takes_torque = firmware == "1.13"
        self._received_us: int | None = None
        self.setpoint: Setpoint | None = None
        self._rates_for_a_tick: RatesSetpoint | None = None
        self.warning = ""

    def take(self, message: Message, heading_rad: float, boot_us: int) -> None:
        """Take in a setpoint message; one that PX4 would not count as a setpoint changes nothing.

        `warning` is then the STATUSTEXT that PX4 sends about it, or empty.
        """
        self.warning = ""
        setpoint = self._setpoint(message, heading_rad)
        if setpoint is not None:
            self.setpoint = setpoint
            self._rates_for_a_tick = _rates(message) if isinstance(setpoint, AttitudeSetpoint) else None
            self._received_us = boot_us

    def next_setpoint(self) -> Setpoint | None:
        """What acts in the next tick."""
        rates, self._rates_for_a_tick = self._rates_for_a_tick, None
        return rates or self.setpoint

    def is_alive(self, boot_us: int, loss_s: float) -> bool:
        """Whether a setpoint came within the last `loss_s` (COM_OF_LOSS_T)."""
        return self._received_us is not None and boot_us - self._received_us <= loss_s * 1e6

    def _setpoint(self, message: Message, heading_rad: float) -> Setpoint | None:
        kind = message.get_type()
        if kind == "SET_ATTITUDE_TARGET":
            return _attitude(message) or _rates(message)
        if kind == "SET_POSITION_TARGET_LOCAL_NED":
            setpoint, self.warning = _position(message, heading_rad)
            return setpoint
        if self._takes_torque and message.group_mlx == 0:
            return _torque(message)
        return None


def _attitude(message: Message) -> AttitudeSetpoint | None:
    mask = message.type_mask
    if mask & _IGNORE_ATTITUDE:
        return None
    w, x, y, z = message.q
    yaw_rate = None if mask & _IGNORE_YAW_RATE else _finite(message.body_yaw_rate)
    thrust = -_thrust_body_down(message) if mask & _THRUST_BODY_SET else _collective(message)
    return AttitudeSetpoint((w, x, y, z), _thrust(thrust), yaw_rate or 0.0)


def _rates(message: Message) -> RatesSetpoint | None:
    mask = message.type_mask
    if mask & _IGNORE_ROLL_OR_PITCH_RATE:
        return None
    yaw_rate = None if mask & _IGNORE_YAW_RATE else _finite(message.body_yaw_rate)
    rates = (_finite(message.body_roll_rate), _finite(message.body_pitch_rate), yaw_rate)
    return RatesSetpoint(rates, _thrust(_collective(message)))


def _collective(message: Message) -> float:
    return 0.0 if message.type_mask & _IGNORE_THROTTLE else float(message.thrust)


def _thrust_body_down(message: Message) -> float:
    """thrust_body[2] (FRD), read from the frame: pymavlink's dialects lack this extension of the message.

    MAVLink 2 cuts zeros off the end of the payload, and MAVLink 1 has no extensions.
    """
    frame = bytes(message.get_msgbuf() or b"")
    if not frame or frame[0] != _MAGIC_V2:
        return 0.0
    down = frame[_PAYLOAD_AT : _PAYLOAD_AT + frame[1]][_THRUST_BODY_DOWN_AT:]
    value: float = struct.unpack("<f", down[:4].ljust(4, b"\0"))[0]
    return value


def _torque(message: Message) -> TorqueSetpoint:
    roll, pitch, yaw, thrust = message.controls[:4]
    return TorqueSetpoint((_torque_norm(roll), _torque_norm(pitch), _torque_norm(yaw)), _thrust(thrust))


def _torque_norm(value: float) -> float:
    return max(-1.0, min(1.0, value)) if math.isfinite(value) else 0.0


def _thrust(value: float) -> float:
    return max(0.0, min(1.0, value)) if math.isfinite(value) else 0.0


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _position(message: Message, heading_rad: float) -> tuple[PositionSetpoint | None, str]:
    """(the setpoint, PX4's complaint if there is none)."""
    mask, frame = message.type_mask, message.coordinate_frame
    if frame not in (_LOCAL_NED, _BODY_NED):
        return None, f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {frame} unsupported"
    fields = _field(message.x, message.y, message.z, mask & _IGNORE_POSITION or frame == _BODY_NED)
    velocity = _field(message.vx, message.vy, message.vz, mask & _IGNORE_VELOCITY)
    acceleration = _field(message.afx, message.afy, message.afz, mask & _IGNORE_ACCELERATION)
    if all(value is None for value in (*fields, *velocity, *acceleration)):
        return None, "SET_POSITION_TARGET_LOCAL_NED invalid"
    turn_rad = heading_rad if frame == _BODY_NED else 0.0
    setpoint = PositionSetpoint(
        fields,
        _turned(_or_zero(velocity), turn_rad),
        _turned(_or_zero(acceleration), turn_rad),
        None if mask & _IGNORE_YAW else _finite(message.yaw),
    )
    return setpoint, ""


def _field(x: float, y: float, z: float, ignored: int | bool) -> tuple[float | None, float | None, float | None]:
    return (None, None, None) if ignored else (_finite(x), _finite(y), _finite(z))


def _or_zero(field: tuple[float | None, float | None, float | None]) -> Vec3:
    return ZERO3 if field == (None, None, None) else (field[0] or 0.0, field[1] or 0.0, field[2] or 0.0)


def _turned(vector: Vec3, heading_rad: float) -> Vec3:
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2])
