"""The commands about messages, calibration, reboot and equipment; results as seen on PX4 1.13.3."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.command import (
    ACCEPTED,
    DENIED,
    FAILED,
    INFO,
    TEMPORARILY_REJECTED,
    Command,
    Handler,
)
from sitl_mock.personality.px4.commander import Commander
from sitl_mock.port import Port

# fmt: off
_NEVER_ANSWERED = (
    mavlink.MAV_CMD_START_RX_PAIR, mavlink.MAV_CMD_LOGGING_START, mavlink.MAV_CMD_LOGGING_STOP,
    mavlink.MAV_CMD_DO_MOUNT_CONTROL, mavlink.MAV_CMD_DO_MOUNT_CONFIGURE, mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
    mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
)
# fmt: on
"""Commands that PX4 passes to modules which SIH does not run: no ACK comes, seen on 1.13.3."""
_REGIONS_OF_INTEREST = (
    mavlink.MAV_CMD_DO_SET_ROI,
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION,
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET,
    mavlink.MAV_CMD_DO_SET_ROI_NONE,
    mavlink.MAV_CMD_NAV_ROI,
)
_PROTOCOL_VERSION = 300
"""A message that the dialect lacks: it is acknowledged as PX4 does, but not sent."""
_REQUESTS = {
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: _PROTOCOL_VERSION,
    mavlink.MAV_CMD_GET_HOME_POSITION: mavlink.MAVLINK_MSG_ID_HOME_POSITION,
}
_ALWAYS_ACCEPTED = (
    *_REGIONS_OF_INTEREST,
    mavlink.MAV_CMD_DO_SET_ACTUATOR,
    mavlink.MAV_CMD_DO_MOTOR_TEST,
    mavlink.MAV_CMD_ACTUATOR_TEST,
)
_CALIBRATIONS = ("gyro", "mag", "baro", "rc", "accel", "airspeed", "esc")
_POWER_OFF = 2


class SystemCommands:
    """`send_message`, `set_interval`, `send_interval`: the streams of a port."""

    def __init__(
        self,
        commander: Commander,
        send_message: Callable[[Port, int, int], bool],
        set_interval: Callable[[Port, int, float, int], bool],
        send_interval: Callable[[Port, int], None],
    ) -> None:
        self._commander = commander
        self._send_message = send_message
        self._set_stream = set_interval
        self._send_interval = send_interval
        self.handlers: dict[int, Handler] = {
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._calibrate,
            mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._store,
            **dict.fromkeys(_ALWAYS_ACCEPTED, _accept),
            **dict.fromkeys(_NEVER_ANSWERED, _say_nothing),
            **{number: self._answering(message_id) for number, message_id in _REQUESTS.items()},
        }
        if not commander.is_113:
            self.handlers[mavlink.MAV_CMD_RUN_PREARM_CHECKS] = self._check

    # --- messages --------------------------------------------------------------------------------------------------

    def _set_interval(self, command: Command) -> list[int]:
        if not math.isfinite(command.params[1]):
            return [DENIED]
        known = self._set_stream(command.port, command.whole(1), command.params[1], command.boot_us)
        return [ACCEPTED if known else FAILED]

    def _get_interval(self, command: Command) -> list[int]:
        self._send_interval(command.port, command.whole(1) & 0xFFFF)
        return [ACCEPTED]

    def _request_message(self, command: Command) -> list[int]:
        return [self._send(command, command.whole(1))]

    def _answering(self, message_id: int) -> Handler:
        return partial(self._answer_with, message_id)  # unlike a lambda, a copy of the mock's is the copy's own

    def _answer_with(self, message_id: int, command: Command) -> list[int]:
        return [self._send(command, message_id)]

    def _send(self, command: Command, message_id: int) -> int:
        is_sent = message_id == _PROTOCOL_VERSION or self._send_message(command.port, message_id, command.boot_us)
        return ACCEPTED if is_sent else DENIED

    # --- on the ground ---------------------------------------------------------------------------------------------

    def _reboot(self, command: Command) -> list[int]:
        """Acknowledged, and not done: a reboot is a fault of the script. SITL's PX4 cannot start itself anew either."""
        may = command.whole(1) == 0 or (command.whole(1) <= _POWER_OFF + 1 and not self._commander.armed)
        return [ACCEPTED if may else DENIED]

    def _calibrate(self, command: Command) -> list[int]:
        """Over at once, with the texts that ground stations wait for."""
        if self._commander.armed:
            return [TEMPORARILY_REJECTED]
        wanted = [name for number, name in enumerate(_CALIBRATIONS, 1) if command.whole(number) == 1]
        for name in wanted[:1]:
            for text in (f"calibration started: 2 {name}", "progress <100>", f"calibration done: {name}"):
                self._commander.say(INFO, f"[cal] {text}")
        return [ACCEPTED]

    def _store(self, command: Command) -> list[int]:
        return [TEMPORARILY_REJECTED if self._commander.armed else ACCEPTED]

    def _check(self, command: Command) -> list[int]:
        return [TEMPORARILY_REJECTED if self._commander.armed else ACCEPTED]


def _accept(command: Command) -> list[int]:
    return [ACCEPTED]


def _say_nothing(command: Command) -> list[int]:
    return []
