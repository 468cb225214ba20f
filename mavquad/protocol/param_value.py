"""What a PARAM_VALUE means, and what must stand in a PARAM_SET: the two ways of an integer through a float field.

MAVLink's parameter protocol has one float32 for every type. PX4 puts an integer's bytes into it ('bytewise'),
ArduPilot its number ('C cast'); AUTOPILOT_VERSION.capabilities says the same of them. A REAL32 is itself in both.
"""

from __future__ import annotations

import math
import struct
from enum import Enum, auto

from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.param_record import ParamNumber

_PREFIX = "MAV_PARAM_TYPE_"
_CODES = {
    mavlink.MAV_PARAM_TYPE_UINT8: "<B",
    mavlink.MAV_PARAM_TYPE_INT8: "<b",
    mavlink.MAV_PARAM_TYPE_UINT16: "<H",
    mavlink.MAV_PARAM_TYPE_INT16: "<h",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
    mavlink.MAV_PARAM_TYPE_REAL32: "<f",
}
_REAL = mavlink.MAV_PARAM_TYPE_REAL32
_LARGEST_CAST = 1 << 24
"""Whole numbers beyond it are rounded by a float32."""


class Encoding(Enum):
    """How an integer travels."""

    BYTEWISE = auto()
    CAST = auto()


def encoding_of(autopilot: int) -> Encoding:
    """The encoding of an autopilot (MAV_AUTOPILOT of its HEARTBEAT)."""
    return Encoding.BYTEWISE if autopilot == mavlink.MAV_AUTOPILOT_PX4 else Encoding.CAST


def type_name(kind: int) -> str:
    """A MAV_PARAM_TYPE without its prefix, e.g. INT32; its number if it has no name."""
    entry = mavlink.enums["MAV_PARAM_TYPE"].get(kind)
    return entry.name.removeprefix(_PREFIX) if entry else str(kind)


def decode_value(message: Message, encoding: Encoding) -> ParamNumber:
    """The number that a PARAM_VALUE tells; one of a type that does not fit the field is read as it stands."""
    kind, value = message.param_type, float(message.param_value)
    if kind == _REAL or kind not in _CODES:
        return value
    if encoding is Encoding.BYTEWISE:
        number: int = struct.unpack_from(_CODES[kind], struct.pack("<f", value))[0]
        return number
    return int(value) if math.isfinite(value) else value


def fitted(value: float, kind: int, encoding: Encoding) -> ParamNumber:
    """A number as a parameter of this type can hold it: whole for an integer, of single precision for REAL32.

    Raises:
        ValueError: it cannot hold it, or the wire cannot carry it; with the reason.
    """
    if kind not in _CODES:
        raise ValueError(f"is of type {type_name(kind)}, which is not read here")
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a number")
    number = value if kind == _REAL else int(value)
    try:
        packed: ParamNumber = struct.unpack(_CODES[kind], struct.pack(_CODES[kind], number))[0]
    except (struct.error, OverflowError):
        raise ValueError(f"{value:g} does not fit into {type_name(kind)}") from None
    if kind != _REAL and packed != value:
        raise ValueError(f"is of type {type_name(kind)}: {value:g} is not whole")
    if kind != _REAL and encoding is Encoding.CAST and abs(number) > _LARGEST_CAST:
        raise ValueError(f"{value:.0f} is rounded on its way over MAVLink")
    return packed


def encode_value(value: ParamNumber, kind: int, encoding: Encoding) -> float:
    """What stands in PARAM_SET.param_value for a `fitted` number."""
    if encoding is Encoding.CAST:
        return float(value)
    raw = struct.pack(_CODES[kind], value).ljust(4, b"\0")
    packed: float = struct.unpack("<f", raw)[0]
    return packed
