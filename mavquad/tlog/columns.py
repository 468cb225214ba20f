"""Messages of one kind from one sender as columns: numpy arrays, with the unit in the name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavquad.protocol.codec import Message, mavlink

_NUMPY_NAMES = {"float": "float32", "double": "float64", "char": "uint8"}
_NOT_ASCII = 0xFFFD  # how a byte that is not ASCII is shown, as pymavlink does
_SPELT_OUT = {"%": "percent", "d%": "decipercent", "c%": "centipercent", "m/s/s": "m_s2", "m/s*5": "m_s_times_5"}


@dataclass(frozen=True)
class Table:
    """The messages of one kind from one sender, in the order of the log; every array has one row a message.

    `table["roll_rad"]` and `table["roll"]` are the same array: MAVLink's own name of a field, with or without its unit.
    Values are as on the wire, in the unit that the name says (`lat_degE7` holds integers) and of MAVLink's own type;
    an array of MAVLink has a second axis, a text is a str. `len(table)` is the number of messages.

    Attributes:
        name: of the message, "ATTITUDE".
        sender: (system id, component id).
        stamps_us: Unix time by the log, us, the link's bits cleared; of a lost stamp, see `tlog.read`.
        links: the link's bits, 0 to 3; 3 is what the writer of the log sent.
        offsets: where in the file each frame begins; puts messages of several tables in order.
    """

    name: str
    sender: tuple[int, int]
    stamps_us: NDArray[np.int64]
    links: NDArray[np.int8]
    offsets: NDArray[np.int64]
    _records: NDArray[Any]

    @property
    def fields(self) -> tuple[str, ...]:
        """MAVLink's names of the fields, in the order of its definition."""
        return tuple(kind_of(self.name).fieldnames)

    @property
    def names(self) -> tuple[str, ...]:
        """The same with units."""
        return tuple(_fields_by_name(self.name))

    def columns(self) -> dict[str, NDArray[Any]]:
        """All fields, by their names with units."""
        return {name: self[name] for name in self.names}

    def __getitem__(self, name: str) -> NDArray[Any]:
        field = _fields_by_name(self.name).get(name, name)
        if field not in self.fields:
            raise KeyError(f"{self.name} has no {name!r}, but {', '.join(self.names)}")
        if field not in self._made:
            values = np.ascontiguousarray(self._records[field])
            self._made[field] = _texts(values) if field in _text_fields(self.name) else values
        return self._made[field]

    def __len__(self) -> int:
        return len(self._records)

    @cached_property
    def _made(self) -> dict[str, NDArray[Any]]:
        return {}


@cache
def kinds_by_name() -> dict[str, Message]:
    """The dialect's message classes."""
    return {kind.msgname: kind for kind in mavlink.mavlink_map.values()}


def kind_of(name: str) -> Message:
    """The dialect's class of a message."""
    return kinds_by_name()[name]


@cache
def wire_type(name: str) -> np.dtype[Any]:
    """The payload of a message as a numpy record: its fields in the order on the wire, packed, extensions included."""
    kind = kind_of(name)
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    fields = zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)
    return np.dtype([(field, _number_type(types[field]), (length,) if length else ()) for field, length in fields])


def _number_type(mavlink_type: str) -> np.dtype[Any]:
    return np.dtype(_NUMPY_NAMES.get(mavlink_type, mavlink_type.removesuffix("_t"))).newbyteorder("<")


def column_name(field: str, unit: str) -> str:
    """A field's name with MAVLink's unit behind it, unless it ends so already: roll_rad, time_boot_ms, time_us."""
    suffix = _SPELT_OUT.get(unit, unit.replace("/", "_").replace("^", ""))
    if not suffix or field.lower().endswith(f"_{suffix.lower()}"):
        return field
    return f"{field.removesuffix('_usec')}_{suffix}"


@cache
def _fields_by_name(name: str) -> dict[str, str]:
    kind = kind_of(name)
    return {column_name(field, kind.fieldunits_by_name.get(field, "")): field for field in kind.fieldnames}


@cache
def _text_fields(name: str) -> frozenset[str]:
    kind = kind_of(name)
    return frozenset(field for field, type_ in zip(kind.fieldnames, kind.fieldtypes, strict=True) if type_ == "char")


def _texts(characters: NDArray[np.uint8]) -> NDArray[np.str_]:
    """Rows of characters as str, each up to its first zero."""
    codes = np.where(characters < 128, characters.astype("<u4"), np.uint32(_NOT_ASCII))
    codes *= np.logical_and.accumulate(characters != 0, axis=1)
    return np.ascontiguousarray(codes).view(f"<U{characters.shape[1]}")[:, 0]
