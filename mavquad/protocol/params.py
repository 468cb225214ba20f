"""The parameter protocol, reading side: PARAM_REQUEST_READ by name until PARAM_VALUE comes.

A vehicle does not answer for a name it does not know (seen on PX4 and ArduPilot), so a name that stays silent after
all tries is reported as unknown.
"""

from __future__ import annotations

import struct

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink

RETRY_US = 300_000
MAX_TRIES = 5
_INTEGERS = {
    mavlink.MAV_PARAM_TYPE_UINT8: "<B",
    mavlink.MAV_PARAM_TYPE_INT8: "<b",
    mavlink.MAV_PARAM_TYPE_UINT16: "<H",
    mavlink.MAV_PARAM_TYPE_INT16: "<h",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
}


def bytewise_value(message: Message) -> float:
    """PARAM_VALUE of PX4: integers travel as their bytes inside the float field (MAVLink 'bytewise' encoding)."""
    code = _INTEGERS.get(message.param_type)
    if code is None:
        return float(message.param_value)
    return float(struct.unpack_from(code, struct.pack("<f", message.param_value))[0])


class ParamReader:
    """Reads a list of parameters, all asked for at once and the missing ones again.

    Attributes:
        values: what was answered, by name; a name the vehicle does not know is missing when `done`.
    """

    def __init__(self) -> None:
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
            self.values[message.param_id] = bytewise_value(message)
        if all(name in self.values for name in self._names):
            self._retry_us = NEVER_US

    def on_deadline(self, target: tuple[int, int], now_us: int) -> list[Message]:
        """Ask again for what is missing; after the last try it gives up and is `done`."""
        return self._ask(target, now_us) if now_us >= self._retry_us else []
