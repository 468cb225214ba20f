"""PX4's answers to commands: COMMAND_LONG, COMMAND_INT and the old SET_MODE, with their COMMAND_ACK."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.config.faults import Refuse
from sitl_mock.personality import Sender
from sitl_mock.personality.params import ParameterServer
from sitl_mock.personality.px4.commander import ACCEPTED, CRITICAL, INFO, TEMPORARILY_REJECTED, Commander
from sitl_mock.personality.px4.modes import Mode, mode_of
from sitl_mock.port import Port
from sitl_mock.script import Script

Params = tuple[float, float, float, float, float, float, float]

FAILED: int = mavlink.MAV_RESULT_FAILED
DENIED: int = mavlink.MAV_RESULT_DENIED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
_FORCE = 21196
_CUSTOM_MODE_FLAG = 1
_SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
_AUTOPILOT_VERSION = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
_GROUND_STATION_COMPONENT = mavlink.MAV_COMP_ID_MISSIONPLANNER


class Commands:
    """Obeys commands.

    `send_message` sends the message with an id at once on a port, `set_interval` sets its rate there; both say whether
    there is such a message. `send_interval` tells its rate there.
    """

    def __init__(
        self,
        firmware: Px4Release,
        system_id: int,
        commander: Commander,
        params: ParameterServer,
        script: Script,
        home_altitude_m: float,
        send_message: Callable[[Port, int, int], bool],
        set_interval: Callable[[Port, int, float, int], bool],
        send_interval: Callable[[Port, int], None],
    ) -> None:
        self._is_113 = firmware == "1.13"
        self._is_116 = firmware == "1.16"
        self._system_id = system_id
        self._commander = commander
        self._params = params
        self._script = script
        self._home_altitude_m = home_altitude_m
        self._send_message = send_message
        self._set_stream = set_interval
        self._tell_stream = send_interval
        self._handlers: dict[int, Callable[[Params, Port, int], int | None]] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._take_off,
            mavlink.MAV_CMD_NAV_LAND: self._land,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._request_version,
        }

    def answer(self, message: Message, sender: Sender, port: Port, boot_us: int) -> list[Message]:
        """Obey a command message; the COMMAND_ACKs to send for it."""
        if message.get_type() == "SET_MODE":
            if message.target_system != self._system_id:
                return []
            main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
            result = self._set_mode((message.base_mode, main, sub, 0, 0, 0, 0), sender, boot_us)
            return [_ack(_SET_MODE, result, sender)]
        command = int(message.command)
        if message.target_system != self._system_id or message.target_component not in (0, 1):
            return [] if self._is_116 else [_ack(command, FAILED, sender)]
        scripted = self._script.answer(command)
        if isinstance(scripted, Refuse):
            if scripted.text:
                self._commander.texts.append((CRITICAL, scripted.text))
            return [_ack(command, scripted.result, sender)]
        if scripted is not None:
            return [_ack(command, ACCEPTED, sender)]
        results = self._obey(command, _params_of(message), sender, port, boot_us)
        return [_ack(command, result, sender) for result in results]

    def _obey(self, command: int, params: Params, sender: Sender, port: Port, boot_us: int) -> list[int]:
        if command == _SET_MODE:
            result = self._set_mode(params, sender, boot_us)
            # The receiver of 1.16 acknowledges before its commander has decided.
            return [ACCEPTED, result] if self._is_116 else [result]
        handler = self._handlers.get(command)
        answer = UNSUPPORTED if handler is None else handler(params, port, boot_us)
        return [] if answer is None else [answer]

    def _set_mode(self, params: Params, sender: Sender, boot_us: int) -> int:
        mode = mode_of(_whole(params[1]), _whole(params[2]))
        if mode is None or not _whole(params[0]) & _CUSTOM_MODE_FLAG:
            return ACCEPTED  # as PX4: acknowledged, and nothing happens
        result = self._commander.request(mode, boot_us)
        # PX4 1.15 and 1.16 tell the reason to ground stations only.
        if result == TEMPORARILY_REJECTED and not self._is_113 and sender[1] == _GROUND_STATION_COMPONENT:
            self._commander.texts.append((CRITICAL, "Switching to Offboard is currently not available"))
        return result

    def _arm(self, params: Params, port: Port, boot_us: int) -> int | None:
        if params[0] == 1:
            return self._commander.arm(boot_us)
        if params[0] == 0:
            return self._commander.disarm(forced=params[1] == _FORCE)
        return None

    def _take_off(self, params: Params, port: Port, boot_us: int) -> int:
        least_m = float(self._params["MIS_TAKEOFF_ALT"])
        climb_m = params[6] - self._home_altitude_m
        if not math.isfinite(climb_m) or climb_m < least_m:
            climb_m = least_m
            known = (
                f"minimum takeoff altitude: {least_m:.2f}"
                if self._is_113
                else f"default takeoff altitude: {least_m:.1f}"
            )
            self._commander.texts.append((INFO, f"Using {known} m"))
        self._commander.take_off(climb_m)
        return ACCEPTED

    def _land(self, params: Params, port: Port, boot_us: int) -> int:
        self._commander.texts.append((INFO, "Landing at current position"))
        return self._commander.request(Mode.LAND, boot_us)

    def _set_interval(self, params: Params, port: Port, boot_us: int) -> int:
        if not math.isfinite(params[1]):
            return DENIED
        return ACCEPTED if self._set_stream(port, _whole(params[0]), params[1], boot_us) else FAILED

    def _get_interval(self, params: Params, port: Port, boot_us: int) -> int:
        """Accepted whatever is asked for: 0 is the answer for a message without a stream (seen on 1.13.3)."""
        self._tell_stream(port, _whole(params[0]) & 0xFFFF)
        return ACCEPTED

    def _return(self, params: Params, port: Port, boot_us: int) -> int:
        return self._commander.request(Mode.RTL, boot_us)

    def _request_message(self, params: Params, port: Port, boot_us: int) -> int:
        return ACCEPTED if self._send_message(port, _whole(params[0]), boot_us) else DENIED

    def _request_version(self, params: Params, port: Port, boot_us: int) -> int:
        return ACCEPTED if self._send_message(port, _AUTOPILOT_VERSION, boot_us) else DENIED


def _params_of(message: Message) -> Params:
    p = message
    if message.get_type() == "COMMAND_INT":
        return (p.param1, p.param2, p.param3, p.param4, p.x, p.y, p.z)
    return (p.param1, p.param2, p.param3, p.param4, p.param5, p.param6, p.param7)


def _whole(value: float) -> int:
    """A parameter as a whole number; NaN, which clients send for "not used", and infinity are 0."""
    return int(value) if math.isfinite(value) else 0


def _ack(command: int, result: int, sender: Sender) -> Message:
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, sender[0], sender[1])
