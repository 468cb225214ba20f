"""ArduCopter's answers to commands: COMMAND_LONG, COMMAND_INT and SET_MODE, with their COMMAND_ACK."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config.faults import Refuse
from sitl_mock.config.vehicle_faults import Reboot
from sitl_mock.geometry import Vec3
from sitl_mock.personality import Sender
from sitl_mock.personality.ardupilot.copter import ACCEPTED, DENIED, FAILED, Copter
from sitl_mock.personality.ardupilot.guided import height_reference
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.news import CRITICAL, INFO
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, north_east
from sitl_mock.personality.ardupilot.streams import KNOWN, LEAST_INTERVAL_MS, Streams
from sitl_mock.port import Port
from sitl_mock.script import Script

Params = tuple[float, float, float, float, float, float, float]

UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
_FORCE_DISARM = 21196
_FORCE_ARM = 2989
_CUSTOM_MODE_FLAG = 1
_MOST = 2**31 - 1
_PLACED = (mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_SET_ROI_LOCATION, mavlink.MAV_CMD_DO_SET_ROI)
_AS_INT_ALONE = (mavlink.MAV_CMD_DO_REPOSITION,)
"""Not taken as COMMAND_LONG."""
_RELATIVE: int = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
"""What COMMAND_LONG, which has no frame, counts heights from."""
_RIGHT_ANGLE_E7, _HIGH_M = 90e7, 1e5
_REBOOT_S = 1.0
_VERSION = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
_HOME = mavlink.MAVLINK_MSG_ID_HOME_POSITION
_SET_MODE_MESSAGE = mavlink.MAVLINK_MSG_ID_SET_MODE
"""The old SET_MODE is acknowledged under its message id, which is no command."""


class Telemetry(Protocol):
    """What a command may ask of the telemetry."""

    def streams(self, port: Port) -> Streams:
        """The intervals in force on a port."""

    def request(self, port: Port, message_id: int) -> bool:
        """Send a message once, after the ACK; False if the mock has none of that id."""


class Commands:
    """Obeys commands."""

    def __init__(
        self, system_id: int, copter: Copter, params: Parameters, script: Script, telemetry: Telemetry
    ) -> None:
        self._system_id = system_id
        self._copter = copter
        self._params = params
        self._script = script
        self._telemetry = telemetry
        self._frame = _RELATIVE
        self._handlers: dict[int, Callable[[Params, Port, int], int]] = {
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._check,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._take_off,
            mavlink.MAV_CMD_NAV_LAND: self._land,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            mavlink.MAV_CMD_NAV_LOITER_UNLIM: self._loiter,
            mavlink.MAV_CMD_MISSION_START: self._start_mission,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._request_version,
            mavlink.MAV_CMD_GET_HOME_POSITION: self._request_home,
            mavlink.MAV_CMD_CONDITION_YAW: self._turn,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            mavlink.MAV_CMD_DO_REPOSITION: self._reposition,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._look,
            mavlink.MAV_CMD_DO_SET_ROI: self._look,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._look_nowhere,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self._go_to_item,
            mavlink.MAV_CMD_DO_PAUSE_CONTINUE: self._pause,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._terminate,
            mavlink.MAV_CMD_DO_FENCE_ENABLE: self._enable_fence,
        }

    def answer(self, message: Message, sender: Sender, port: Port, boot_us: int) -> list[Message]:
        """Obey a command message; the COMMAND_ACKs to send for it. Another system's gets none."""
        if message.get_type() == "SET_MODE":
            if message.target_system != self._system_id:
                return []
            result = self._set_mode((message.base_mode, message.custom_mode, 0, 0, 0, 0, 0), port, boot_us)
            return [_ack(_SET_MODE_MESSAGE, result, sender)]
        if message.target_system not in (self._system_id, 0):
            return []
        command = int(message.command)
        scripted = self._script.answer(command)
        if isinstance(scripted, Refuse):
            if scripted.text:
                self._copter.news.say(CRITICAL, scripted.text)
            return [_ack(command, scripted.result, sender)]
        if scripted is not None:
            return [_ack(command, ACCEPTED, sender)]
        self._frame = message.frame if message.get_type() == "COMMAND_INT" else _RELATIVE
        is_long = message.get_type() == "COMMAND_LONG"
        handler = None if is_long and command in _AS_INT_ALONE else self._handlers.get(command)
        result = UNSUPPORTED if handler is None else handler(_params_of(message), port, boot_us)
        return [_ack(command, result, sender)]

    def _set_mode(self, params: Params, port: Port, boot_us: int) -> int:
        if not _whole(params[0]) & _CUSTOM_MODE_FLAG:
            return DENIED
        return self._copter.request_mode(_whole(params[1]), boot_us)

    def _arm(self, params: Params, port: Port, boot_us: int) -> int:
        if params[0] == 1:
            return self._copter.arm(boot_us, forced=params[1] == _FORCE_ARM)
        if params[0] == 0:
            return self._copter.disarm(forced=params[1] == _FORCE_DISARM)
        return UNSUPPORTED

    def _check(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.check(boot_us)

    def _take_off(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.take_off(params[6], boot_us)

    def _land(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.request_mode(Mode.LAND, boot_us)

    def _return(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.request_mode(Mode.RTL, boot_us)

    def _loiter(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.request_mode(Mode.LOITER, boot_us)

    def _start_mission(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.start_mission(boot_us)

    def _change_speed(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.change_speed(params[1])

    def _set_interval(self, params: Params, port: Port, boot_us: int) -> int:
        message_id = _whole(params[0])
        if message_id not in KNOWN:
            self._copter.news.say(INFO, f"No ap_message for mavlink id ({message_id})")
            return DENIED
        asked_us = params[1] if math.isfinite(params[1]) else 0.0
        interval_ms = int(min(asked_us, _MOST) // 1000)
        if asked_us > 0 and interval_ms < LEAST_INTERVAL_MS:
            text = f"Requested rate for message ID {message_id} too fast. Increase SCHED_LOOP_RATE"
            self._copter.news.say(INFO, text)
            return DENIED
        default_ms = 1000 if asked_us == 0 and message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT else 0
        self._telemetry.streams(port).set_interval_ms(message_id, interval_ms or default_ms, boot_us)
        return ACCEPTED

    def _get_interval(self, params: Params, port: Port, boot_us: int) -> int:
        message_id = _whole(params[0])
        is_known = message_id in KNOWN
        interval_us = self._telemetry.streams(port).interval_us(message_id) or -1 if is_known else 0
        port.send(mavlink.MAVLink_message_interval_message(message_id & 0xFFFF, interval_us))
        return ACCEPTED if is_known else FAILED

    def _request_message(self, params: Params, port: Port, boot_us: int) -> int:
        return ACCEPTED if self._telemetry.request(port, _whole(params[0])) else FAILED

    def _request_version(self, params: Params, port: Port, boot_us: int) -> int:
        return self._request_message((_VERSION, 0, 0, 0, 0, 0, 0), port, boot_us)

    def _request_home(self, params: Params, port: Port, boot_us: int) -> int:
        if not self._copter.has_home:
            return FAILED
        return self._request_message((_HOME, 0, 0, 0, 0, 0, 0), port, boot_us)

    def _turn(self, params: Params, port: Port, boot_us: int) -> int:
        rate = params[1] if math.isfinite(params[1]) else 0.0
        return self._copter.turn(params[0], rate, params[3] == 1, params[2], boot_us)

    def _reposition(self, params: Params, port: Port, boot_us: int) -> int:
        place = self._place(params)
        may_change_mode = bool(_whole(params[1]) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE)
        return DENIED if place is None else self._copter.reposition(place, may_change_mode, boot_us)

    def _look(self, params: Params, port: Port, boot_us: int) -> int:
        place = self._place(params)
        is_somewhere = place is not None and (params[4] or params[5])
        return self._copter.look_at(place, boot_us) if place is not None and is_somewhere else ACCEPTED

    def _look_nowhere(self, params: Params, port: Port, boot_us: int) -> int:
        return ACCEPTED

    def _go_to_item(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.go_to_item(_whole(params[0]))

    def _pause(self, params: Params, port: Port, boot_us: int) -> int:
        return self._copter.pause(params[0] == 0) if params[0] in (0, 1) else DENIED

    def _set_home(self, params: Params, port: Port, boot_us: int) -> int:
        place = self._place(params)
        if params[0] != 1 and place is None:
            return DENIED
        return self._copter.move_home(None if params[0] == 1 else place)

    def _place(self, params: Params) -> Vec3 | None:
        """The place in param5 to param7, NED; None for one that is none."""
        latitude, longitude, height = params[4:]
        reference = height_reference(self._frame)
        if reference is None or not all(map(math.isfinite, (latitude, longitude, height))):
            return None
        if not (abs(latitude) <= _RIGHT_ANGLE_E7 and abs(longitude) <= 2 * _RIGHT_ANGLE_E7 and abs(height) < _HIGH_M):
            return None
        home_down = self._copter.home_ned_m[2]
        return (
            *north_east(latitude, longitude),
            HOME_ALTITUDE_M - height if reference == "msl" else home_down - height,
        )

    def _reboot(self, params: Params, port: Port, boot_us: int) -> int:
        if params[0] not in (1, 3):
            return UNSUPPORTED
        if self._copter.armed:
            return FAILED
        self._script.add(Reboot(kind="reboot", at_s=0.0, down_s=_REBOOT_S), port.now_us)
        return ACCEPTED

    def _terminate(self, params: Params, port: Port, boot_us: int) -> int:
        if not params[0] > 0.5:
            return FAILED
        self._copter.stop_motors()
        return ACCEPTED

    def _enable_fence(self, params: Params, port: Port, boot_us: int) -> int:
        if params[0] not in (0, 1):
            return FAILED
        self._params.set("FENCE_ENABLE", params[0])
        return ACCEPTED


def _params_of(message: Message) -> Params:
    """The seven parameters; a place is in degrees times 1e7, as COMMAND_INT has it."""
    p = message
    if message.get_type() == "COMMAND_INT":
        return (p.param1, p.param2, p.param3, p.param4, p.x, p.y, p.z)
    if message.command in _PLACED:
        return (p.param1, p.param2, p.param3, p.param4, 1e7 * p.param5, 1e7 * p.param6, p.param7)
    return (p.param1, p.param2, p.param3, p.param4, p.param5, p.param6, p.param7)


def _whole(value: float) -> int:
    """A parameter as a whole number; NaN and infinity are 0."""
    return int(max(-_MOST, min(_MOST, value))) if math.isfinite(value) else 0


def _ack(command: int, result: int, sender: Sender) -> Message:
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, sender[0], sender[1])
