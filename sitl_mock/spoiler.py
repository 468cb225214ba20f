"""What goes wrong between the autopilot's software and its ports: messages held back, late, with NaN or wrong stamps,
and a stranger who sends beside it under its name.

Held back here, a message takes no sequence number: nobody can tell from the numbers that it was not sent.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from functools import partial

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Encoder, Message, mavlink
from sitl_mock.config.faults import NanPose, SecondVehicle, Silent, StreamStops
from sitl_mock.plant import TICK_US
from sitl_mock.port import AUTOPILOT_COMPONENT, Port
from sitl_mock.script import Script

_US_PER_S = 1_000_000
_POSE = ("LOCAL_POSITION_NED", "ODOMETRY")
_POSE_FIELDS = ("x", "y", "z", "vx", "vy", "vz")


class Spoiler:
    """Every message passes here on its way to a port.

    Attributes:
        jump_us: by how much the told time since boot is off.
    """

    def __init__(self, script: Script, ports: Sequence[Port], strangers: Strangers) -> None:
        self.jump_us = 0
        self._script = script
        self._ports = ports
        self._strangers = strangers
        self._late: list[tuple[int, Port, Message]] = []

    def install(self) -> None:
        """Look at every message from now on."""
        for port in self._ports:
            port.spoil = partial(self._spoiled, port)

    def step(self) -> None:
        """Send what is due late, and what strangers send."""
        now_us = self._script.now_us
        due = [late for late in self._late if late[0] <= now_us]
        if due:
            self._late = [late for late in self._late if late[0] > now_us]
            for _, port, message in due:
                port.send_as_is(message)
        for fault in self._script.acting(SecondVehicle):
            for frame in self._strangers.frames(fault, now_us):
                for port in self._ports:
                    port.frames.append(frame)

    def _spoiled(self, port: Port, message: Message) -> Message | None:
        """The message as it is to be sent; None for not now."""
        script, name = self._script, message.get_type()
        if any(script.acting(Silent)) or any(fault.message == name for fault in script.acting(StreamStops)):
            return None
        if name in _POSE and any(script.acting(NanPose)):
            message = copy.copy(message)  # other ports send the same object
            for field in _POSE_FIELDS:
                setattr(message, field, math.nan)
        if self.jump_us:
            message = _restamped(message, self.jump_us)
        if name == "COMMAND_ACK":
            late_us = script.late_us(message.command)
            if late_us:
                self._late.append((script.now_us + late_us, port, message))
                return None
        return message


def _restamped(message: Message, jump_us: int) -> Message:
    """A copy whose time since boot is off; PX4's time_usec counts from boot as well."""
    message = copy.copy(message)
    if hasattr(message, "time_boot_ms"):
        message.time_boot_ms = max(0, message.time_boot_ms + jump_us // 1000) & 0xFFFFFFFF
    if hasattr(message, "time_usec"):
        most = 0xFFFFFFFF if message.get_type() == "SERVO_OUTPUT_RAW" else 0xFFFFFFFFFFFFFFFF
        message.time_usec = max(0, message.time_usec + jump_us) & most
    if message.get_type() == "TIMESYNC":
        ours = "tc1" if message.tc1 else "ts1"  # an answer carries our time in tc1, a question in ts1
        setattr(message, ours, max(0, getattr(message, ours) + jump_us * 1000))
    return message


class Strangers:
    """Who sends under our id: frames that were never ours, with their own sequence numbers."""

    def __init__(self, system_id: int, autopilot: int) -> None:
        self._autopilot = autopilot
        self._encoders = {version: Encoder(system_id, AUTOPILOT_COMPONENT, version) for version in (1, 2)}

    def frames(self, fault: SecondVehicle, now_us: int) -> list[bytes]:
        """What is due of one fault's stranger now."""
        encoder = self._encoders[fault.mavlink]
        frames = []
        if _is_due(fault.heartbeat_hz, now_us):
            frames.append(encoder.encode(self._heartbeat(fault)))
        if _is_due(fault.attitude_hz, now_us):
            frames.append(encoder.encode(_attitude(now_us)))
        return frames

    def _heartbeat(self, fault: SecondVehicle) -> Message:
        if fault.looks == "forged":
            return mavlink.MAVLink_heartbeat_message(
                mavlink.MAV_TYPE_GENERIC, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
            )
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, self._autopilot, 1, 0, mavlink.MAV_STATE_STANDBY, 3
        )


def _is_due(rate_hz: float, now_us: int) -> bool:
    """Whether a period ends in this tick."""
    period_us = round(_US_PER_S / rate_hz) if rate_hz > 0.0 else NEVER_US
    return now_us // period_us != (now_us - TICK_US) // period_us


def _attitude(now_us: int) -> Message:
    """Level, turned to the south-east, at rest; its clock is not ours."""
    stamp_ms = now_us // 1000 & 0xFFFFFFFF
    return mavlink.MAVLink_attitude_message(stamp_ms, 0.0, 0.0, 0.75 * math.pi, 0.0, 0.0, 0.0)
