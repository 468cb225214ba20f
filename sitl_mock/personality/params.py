"""PX4's parameters over MAVLink: an INT32 travels as its four bytes in the place of the float ('bytewise')."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

from mavquad.protocol.codec import Message, mavlink

_INT32 = mavlink.MAV_PARAM_TYPE_INT32
_REAL32 = mavlink.MAV_PARAM_TYPE_REAL32


def to_wire(value: int | float) -> float:
    """The number that goes into PARAM_VALUE.param_value."""
    if isinstance(value, int):
        packed: float = struct.unpack("<f", struct.pack("<i", value))[0]
        return packed
    return value


def from_wire(wire: float, like: int | float) -> int | float:
    """The value that a PARAM_SET means for a parameter whose value is `like`; NaN and infinity change no REAL32."""
    if isinstance(like, int):
        whole: int = struct.unpack("<i", struct.pack("<f", wire))[0]
        return whole
    return wire if math.isfinite(wire) else like


class ParameterServer:
    """Holds the parameters and answers the parameter messages."""

    def __init__(self, values: dict[str, int | float]) -> None:
        self._values = values
        self._names = list(values)
        self._listing: Iterator[str] = iter(())

    def __getitem__(self, name: str) -> int | float:
        return self._values[name]

    def answer(self, message: Message) -> list[Message]:
        """What to send at once for PARAM_REQUEST_READ, PARAM_SET or PARAM_REQUEST_LIST; unknown names: nothing."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self._listing = iter(list(self._names))
            return []
        name = message.param_id
        if kind == "PARAM_REQUEST_READ" and message.param_index >= 0:
            name = self._names[message.param_index] if message.param_index < len(self._names) else ""
        if name not in self._values:
            return []
        if kind == "PARAM_SET":
            self._values[name] = from_wire(message.param_value, self._values[name])
        return [self._value_message(name)]

    def next_of_list(self) -> Message | None:
        """The next message of a running list request; one a tick, as a real autopilot paces them."""
        name = next(self._listing, None)
        return None if name is None else self._value_message(name)

    def _value_message(self, name: str) -> Message:
        value = self._values[name]
        return mavlink.MAVLink_param_value_message(
            name.encode(),
            to_wire(value),
            _INT32 if isinstance(value, int) else _REAL32,
            len(self._names),
            self._names.index(name),
        )
