"""The command protocol: COMMAND_LONG, repeated until its COMMAND_ACK comes.

One command at a time; a new one replaces what is pending, so that a hand-back never waits behind anything.
An ACK says what the receiver thinks and not what the vehicle does: PX4 1.16 acknowledges OFFBOARD with ACCEPTED and
takes it back with a second ACK, so a refusal counts also after an acceptance.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.firmware import PX4, Firmware, Mode

NAN = float("nan")
RETRY_US = 300_000
MAX_TRIES = 20


@dataclass(frozen=True, slots=True)
class Command:
    """A MAV_CMD with its seven parameters and the words that a user knows it by."""

    words: str
    command_id: int
    params: tuple[float, ...] = ()

    def message(self, target: tuple[int, int], confirmation: int) -> Message:
        """COMMAND_LONG to the target; missing parameters are 0."""
        params = (*self.params, *(0.0,) * (7 - len(self.params)))
        return mavlink.MAVLink_command_long_message(*target, self.command_id, confirmation, *params)


def arm() -> Command:
    """MAV_CMD_COMPONENT_ARM_DISARM (400), arm."""
    return Command("arm", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (1.0,))


def disarm() -> Command:
    """MAV_CMD_COMPONENT_ARM_DISARM (400), disarm, not forced."""
    return Command("disarm", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,))


def takeoff(firmware: Firmware, height_m: float) -> Command:
    """MAV_CMD_NAV_TAKEOFF (22) here. PX4 takes the altitude above mean sea level, and NaN for its own parameter's height;
    ArduCopter takes the height above home."""
    if firmware.takeoff_parameter:
        return Command("take off", mavlink.MAV_CMD_NAV_TAKEOFF, (NAN, 0.0, 0.0, NAN, NAN, NAN, NAN))
    return Command("take off", mavlink.MAV_CMD_NAV_TAKEOFF, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m))


def land(firmware: Firmware) -> Command:
    """Land here: MAV_CMD_NAV_LAND (21), whose place PX4 takes for here where it is NaN; ArduCopter's mode."""
    if firmware is PX4:
        return Command("land", mavlink.MAV_CMD_NAV_LAND, (0.0, 0.0, 0.0, NAN, NAN, NAN, NAN))
    return set_mode(firmware.land)


def set_mode(mode: Mode) -> Command:
    """MAV_CMD_DO_SET_MODE (176)."""
    return Command(f"mode {mode.name}", mavlink.MAV_CMD_DO_SET_MODE, (1.0, *mode.command))


def set_interval(name: str, message_id: int, rate_hz: float) -> Command:
    """MAV_CMD_SET_MESSAGE_INTERVAL (511); a rate of 0 switches the stream off."""
    interval_us = 1e6 / rate_hz if rate_hz > 0.0 else -1.0
    return Command(f"{name} at {rate_hz:g} Hz", mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (float(message_id), interval_us))


def request_message(name: str, message_id: int) -> Command:
    """MAV_CMD_REQUEST_MESSAGE (512)."""
    return Command(name, mavlink.MAV_CMD_REQUEST_MESSAGE, (float(message_id),))


class Reply(Enum):
    """What became of the pending command."""

    ACCEPTED = auto()
    REFUSED = auto()
    TIMEOUT = auto()


class CommandExchange:
    """One command on its way.

    Attributes:
        command: the last one requested, None before the first.
        result: the MAV_RESULT name of its last ACK, "" before one came.
        tries: how often it was sent.
        requested_us: when it was first sent.
    """

    def __init__(self) -> None:
        self.command: Command | None = None
        self.result = ""
        self.tries = 0
        self.requested_us = 0
        self._retry_us = NEVER_US

    @property
    def pending(self) -> bool:
        """Whether a command still waits for its ACK."""
        return self._retry_us != NEVER_US

    def next_deadline_us(self) -> int:
        """When to repeat."""
        return self._retry_us

    def request(self, command: Command, target: tuple[int, int], now_us: int) -> Message:
        """Start a command; returns the message to send."""
        self.command = command
        self.result = ""
        self.tries = 0
        self.requested_us = now_us
        return self._send(target, now_us)

    def cancel(self) -> None:
        """Forget the pending command."""
        self.command = None
        self._retry_us = NEVER_US

    def _send(self, target: tuple[int, int], now_us: int) -> Message:
        assert self.command is not None
        message = self.command.message(target, min(self.tries, 255))
        self.tries += 1
        self._retry_us = now_us + RETRY_US
        return message

    def on_deadline(self, target: tuple[int, int], now_us: int) -> Message | Reply | None:
        """Repeat the command when its time has come; TIMEOUT once all tries went without an answer."""
        if now_us < self._retry_us:
            return None
        if self.tries >= MAX_TRIES:
            self._retry_us = NEVER_US
            return Reply.TIMEOUT
        return self._send(target, now_us)

    def on_ack(self, ack: Message) -> Reply | None:
        """Take in a COMMAND_ACK; None if it is not ours or the command is still in progress."""
        if self.command is None or ack.command != self.command.command_id:
            return None
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            return None
        self.result = result_name(ack.result)
        self._retry_us = NEVER_US
        return Reply.ACCEPTED if ack.result == mavlink.MAV_RESULT_ACCEPTED else Reply.REFUSED


def result_name(result: int) -> str:
    """MAV_RESULT as the users of MAVLink write it, e.g. TEMPORARILY_REJECTED."""
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"result {result}"
