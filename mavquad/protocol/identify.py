"""Getting to know a vehicle: its version, a few parameters, and the streams that we want, all repeated until answered.

A stream that is refused, or not acknowledged, is no failure here: what really arrives decides later.
"""

from __future__ import annotations

from collections.abc import Iterable

from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.command import Command, CommandExchange, Reply, request_message
from mavquad.protocol.firmware import Firmware
from mavquad.protocol.param_value import encoding_of
from mavquad.protocol.params import ParamReader
from mavquad.protocol.streams import StreamParams, requests

VERSION_REQUESTS = 5
UNKNOWN_VERSION = (0, 0, 0)


class Identification:
    """The exchange; feed it the answers and send what it returns.

    Attributes:
        version: release of the autopilot, `UNKNOWN_VERSION` until it is known.
        parameters: values by name; a name that the vehicle does not know is missing.
    """

    def __init__(self, streams: StreamParams, firmware: Firmware, also: Iterable[str] = ()) -> None:
        """Args: the streams to ask for, whom, and parameters that are read besides the firmware's own."""
        self._queue: list[Command] = requests(streams, firmware)
        self._exchange = CommandExchange()
        own = (firmware.takeoff_parameter, firmware.hover_parameter, *firmware.parameters)
        self._names = tuple(dict.fromkeys(name for name in (*own, *also) if name))
        self._reader = ParamReader(encoding_of(firmware.autopilot))
        self._version_requests = 0
        self.version = UNKNOWN_VERSION

    @property
    def parameters(self) -> dict[str, float]:
        """What was answered, by name."""
        return self._reader.values

    @property
    def done(self) -> bool:
        """Whether the version is known and nothing is waited for any more."""
        waiting = self._queue or self._exchange.pending or not self._reader.done
        return self.version != UNKNOWN_VERSION and not waiting

    @property
    def waiting_for(self) -> str:
        """What was asked last, in words."""
        return self._exchange.command.words if self._exchange.command else ""

    def next_deadline_us(self) -> int:
        """When to repeat something."""
        return min(self._exchange.next_deadline_us(), self._reader.next_deadline_us())

    def start(self, target: tuple[int, int], now_us: int) -> list[Message]:
        """Ask for the parameters and the version."""
        return [*self._reader.request(self._names, target, now_us), self._request_version(target, now_us)]

    def on_deadline(self, target: tuple[int, int], now_us: int) -> list[Message]:
        """Repeat what went without an answer; give up on what did so too often."""
        messages = self._reader.on_deadline(target, now_us)
        repeated = self._exchange.on_deadline(target, now_us)
        if repeated is Reply.TIMEOUT:
            return messages + self._request_next(target, now_us)
        return messages if repeated is None else [*messages, repeated]

    def on_ack(self, ack: Message, target: tuple[int, int], now_us: int) -> list[Message]:
        """Take in a COMMAND_ACK."""
        return [] if self._exchange.on_ack(ack) is None else self._request_next(target, now_us)

    def on_param(self, message: Message) -> None:
        """Take in a PARAM_VALUE."""
        self._reader.on_value(message)

    def on_version(self, message: Message) -> None:
        """Take in an AUTOPILOT_VERSION."""
        version = message.flight_sw_version
        self.version = (version >> 24 & 0xFF, version >> 16 & 0xFF, version >> 8 & 0xFF)

    def _request_next(self, target: tuple[int, int], now_us: int) -> list[Message]:
        if self._queue:
            return [self._exchange.request(self._queue.pop(0), target, now_us)]
        if self.version == UNKNOWN_VERSION and self._version_requests < VERSION_REQUESTS:
            # An ACK came for it, and the message itself was lost.
            return [self._request_version(target, now_us)]
        self._exchange.cancel()
        return []

    def _request_version(self, target: tuple[int, int], now_us: int) -> Message:
        self._version_requests += 1
        command = request_message("AUTOPILOT_VERSION", mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        return self._exchange.request(command, target, now_us)
