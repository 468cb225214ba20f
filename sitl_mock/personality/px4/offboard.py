"""OFFBOARD setpoints as PX4 takes them: messages 82, 84, 86 and (firmware 1.13) 139 to setpoints of the inner loops.

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
from sitl_mock.geodesy import Origin
from sitl_mock.inner_loops import AttitudeSetpoint, RatesSetpoint, Setpoint, TorqueSetpoint
from sitl_mock.personality.px4.position_target import global_setpoint, local_setpoint

_IGNORE_ROLL_OR_PITCH_RATE = 0x03
_IGNORE_YAW_RATE = 0x04
_THRUST_BODY_SET = 0x20
_IGNORE_THROTTLE = 0x40
_IGNORE_ATTITUDE = 0x80
_MAGIC_V2, _PAYLOAD_AT, _THRUST_BODY_DOWN_AT = 0xFD, 10, 47


class OffboardInput:
    """The last setpoint and when it came. Any of the messages keeps OFFBOARD alive.

    `origin` is where NED is zero, `home_altitude_m` the altitude that relative ones count from. A build with lockstep
    takes no torques.
    """

    MESSAGES = (
        "SET_ATTITUDE_TARGET",
        "SET_POSITION_TARGET_LOCAL_NED",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "SET_ACTUATOR_CONTROL_TARGET",
    )

    def __init__(self, firmware: Px4Release, origin: Origin | None = None, *, is_lockstep_build: bool = False) -> None:
        self._origin = origin
        self.home_altitude_m = origin.altitude_m if origin else 0.0
        self._takes_torque = firmware == "1.13" and not is_lockstep_build
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
            setpoint, self.warning = local_setpoint(message, heading_rad)
            return setpoint
        if kind == "SET_POSITION_TARGET_GLOBAL_INT":
            if self._origin is not None:
                setpoint, self.warning = global_setpoint(message, self._origin, self.home_altitude_m)
                return setpoint
            return None
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
    if -1.0 <= value <= 1.0:
        return value
    return math.copysign(1.0, value) if math.isfinite(value) else 0.0


def _thrust(value: float) -> float:
    if 0.0 <= value <= 1.0:
        return value
    return float(value > 0.0) if math.isfinite(value) else 0.0


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
