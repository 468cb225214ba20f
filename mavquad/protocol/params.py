"""The parameter protocol, reading side: PARAM_REQUEST_READ by name until PARAM_VALUE comes.

A vehicle does not answer for a name it does not know (seen on PX4 and ArduPilot), so a name that stays silent after
all tries is reported as unknown.
"""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.param_value import Encoding, decode_value

RETRY_US = 300_000
MAX_TRIES = 12
"""With 20 % lost each way, five of 10^6 names are taken for unknown that are not."""


class ParamReader:
    """Reads a list of parameters, all asked for at once and the missing ones again.

    Attributes:
        values: what was answered, by name; a name the vehicle does not know is missing when `done`.
        encoding: of the vehicle's integers.
    """

    def __init__(self, encoding: Encoding = Encoding.BYTEWISE) -> None:
        self.encoding = encoding
        self.values: dict[str, float] = {}
        self._names: tuple[str, ...] = ()
        self._tries = 0
        self._retry_us = NEVER_US

    @property
    def done(self) -> bool:
        """Whether nothing is waited for any more."""
        return self._retry_us == NEVER_US

    def next_deadline_us(self) -> int:
        """When to ask again."""
        return self._retry_us

    def request(self, names: tuple[str, ...], target: tuple[int, int], now_us: int) -> list[Message]:
        """Start reading; returns the messages to send."""
        self._names = names
        self._tries = 0
        return self._ask(target, now_us)

    def _ask(self, target: tuple[int, int], now_us: int) -> list[Message]:
        missing = [name for name in self._names if name not in self.values]
        if not missing or self._tries >= MAX_TRIES:
            self._retry_us = NEVER_US
            return []
        self._tries += 1
        self._retry_us = now_us + RETRY_US
        return [mavlink.MAVLink_param_request_read_message(*target, name.encode(), -1) for name in missing]

    def on_value(self, message: Message) -> None:
        """Take in a PARAM_VALUE."""
        if message.param_id in self._names:
            self.values[message.param_id] = float(decode_value(message, self.encoding))
        if all(name in self.values for name in self._names):
            self._retry_us = NEVER_US

    def on_deadline(self, target: tuple[int, int], now_us: int) -> list[Message]:
        """Ask again for what is missing; after the last try it gives up and is `done`."""
        return self._ask(target, now_us) if now_us >= self._retry_us else []
