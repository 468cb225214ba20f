"""PX4's parameters over MAVLink: an INT32 travels as its four bytes in the place of the float ('bytewise').

As PX4's mavlink_parameters.cpp does, seen on 1.13.3 and 1.16.2: a list begins with a hash of all values, which lets a
ground station use what it remembers; lists go out in bursts; a set is answered at once on the link that it came in on
and, if it changed the value, told on every link a moment later.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from sitl_mock.personality.parameter_table import Parameter, ParameterValue
from sitl_mock.port import Port

_INT32: int = mavlink.MAV_PARAM_TYPE_INT32
_UINT32: int = mavlink.MAV_PARAM_TYPE_UINT32
_HASH = "_HASH_CHECK"
_NO_INDEX = 65535
_AT_ONCE = 20
_TOLD_AFTER_US = 10_000
_VOLATILE = re.compile(
    r"ASPD_SCALE_\d|CAL_(ACC|GYRO|MAG)\d_[XYZ](OFF|SCALE|ODIAG|COMP)|CAL_BARO\d_OFF|COM_FLIGHT_UUID|EKF2_MAG_DECL"
    r"|LND_FLIGHT_T_(HI|LO)|SENS_DPRES_OFF"
)
"""Parameters that the hash leaves out, since PX4 changes them by itself."""


def to_wire(value: ParameterValue) -> float:
    """The number that goes into PARAM_VALUE.param_value."""
    if isinstance(value, int):
        packed: float = struct.unpack("<f", struct.pack("<i", value))[0]
        return packed
    return value


def from_wire(wire: float, like: ParameterValue) -> ParameterValue:
    """The value that a PARAM_SET means for a parameter whose value is `like`; NaN and infinity change no REAL32.

    Real PX4 ignores NaN likewise, but takes infinity (and then fails to save its file).
    """
    if isinstance(like, int):
        whole: int = struct.unpack("<i", struct.pack("<f", wire))[0]
        return whole
    return wire if math.isfinite(wire) else like


def hash_of(values: Iterable[tuple[str, ParameterValue]]) -> int:
    """PX4's param_hash_check: CRC-32 of names and values in their order, begun at 0 and not inverted at the end."""
    image = b"".join(
        name.encode() + struct.pack("<i" if isinstance(value, int) else "<f", value)
        for name, value in values
        if not _VOLATILE.fullmatch(name)
    )
    return zlib.crc32(image, 0xFFFFFFFF) ^ 0xFFFFFFFF


@dataclass(slots=True)
class _Listing:
    """A list on its way: what comes next (-1: the hash), and when."""

    index: int
    due_us: int


class ParameterServer:
    """Holds the parameters and answers the parameter messages; `server["MPC_THR_MIN"]` is a value.

    Args:
        parameters: in their order.
        ports: the autopilot's links.
        burst_us: from one burst of a list to the next.

    Attributes:
        next_us: nothing of lists and changes is due before.
    """

    def __init__(self, parameters: Iterable[Parameter], ports: Sequence[Port], burst_us: int) -> None:
        rows = tuple(parameters)
        self._names = [row.name for row in rows]
        self._indices = {name: index for index, name in enumerate(self._names)}
        self._types = {row.name: row.wire_type for row in rows}
        self._values = {row.name: row.value for row in rows}
        self._ports = ports
        self._burst_us = burst_us
        self._listings: dict[Port, _Listing] = {}
        self._changed: list[str] = []
        self._tell_us = NEVER_US
        self.next_us = NEVER_US

    def __getitem__(self, name: str) -> ParameterValue:
        return self._values[name]

    @property
    def stored(self) -> dict[str, ParameterValue]:
        """What the vehicle's memory holds, by name."""
        return self._values

    def answer(self, message: Message, port: Port, boot_us: int) -> list[Message]:
        """What to send at once on this link for PARAM_REQUEST_READ, PARAM_SET or PARAM_REQUEST_LIST.

        Nothing for unknown names and indices, and for a PARAM_SET of another type than the parameter's.
        """
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self._begin_list(port, boot_us)
            return []
        if kind == "PARAM_SET":
            return self._set(message, port, boot_us)
        if message.param_index >= 0:
            return [self._value(name) for name in self._names[message.param_index : message.param_index + 1]]
        if message.param_id == _HASH:
            return [self._hash_value()]
        return [self._value(message.param_id)] if message.param_id in self._values else []

    def send_due(self, boot_us: int) -> None:
        """Send what is due of lists and of changes."""
        if boot_us >= self._tell_us:
            self._tell()
        for port, listing in list(self._listings.items()):
            if boot_us >= listing.due_us:
                self._send_burst(port, listing)
        self._look_ahead()

    def _look_ahead(self) -> None:
        self.next_us = min([self._tell_us, *(listing.due_us for listing in self._listings.values())])

    def _begin_list(self, port: Port, boot_us: int) -> None:
        """A list asked for again while it is sent begins anew, without its hash."""
        self._listings[port] = _Listing(0 if port in self._listings else -1, boot_us)
        self._look_ahead()

    def _send_burst(self, port: Port, listing: _Listing) -> None:
        if listing.index < 0:
            port.send(self._hash_value())
            listing.index = 0
        for name in self._names[listing.index : listing.index + _AT_ONCE]:
            port.send(self._value(name))
        listing.index += _AT_ONCE
        listing.due_us += self._burst_us
        if listing.index >= len(self._names):
            del self._listings[port]

    def _set(self, message: Message, port: Port, boot_us: int) -> list[Message]:
        name = message.param_id
        if name == _HASH:
            self._listings.pop(port, None)  # the ground station knows the values already
            return []
        if name not in self._values or message.param_type != self._types[name]:
            return []
        value = from_wire(message.param_value, self._values[name])
        if value != self._values[name]:
            self._values[name] = value
            self._changed.append(name)
            self._tell_us = boot_us + _TOLD_AFTER_US
            self._look_ahead()
        return [self._value(name)]

    def _tell(self) -> None:
        for name in dict.fromkeys(self._changed):
            for port in self._ports:
                port.send(self._value(name))
        self._changed = []
        self._tell_us = NEVER_US

    def _value(self, name: str) -> Message:
        return mavlink.MAVLink_param_value_message(
            name.encode(), to_wire(self._values[name]), self._types[name], len(self._names), self._indices[name]
        )

    def _hash_value(self) -> Message:
        wire: float = struct.unpack("<f", struct.pack("<I", hash_of(self._values.items())))[0]
        return mavlink.MAVLink_param_value_message(_HASH.encode(), wire, _UINT32, len(self._names), _NO_INDEX)
