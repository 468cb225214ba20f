"""Tables of an autopilot's parameters: CSV files of name, type and value beside the personality that they belong to.

Lines that start with # say what the file is. The types are those of MAVLink, without their prefix MAV_PARAM_TYPE_.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from mavquad.protocol.codec import mavlink

ParameterValue = int | float

_WIRE_TYPES: dict[str, int] = {
    "INT8": mavlink.MAV_PARAM_TYPE_INT8,
    "INT16": mavlink.MAV_PARAM_TYPE_INT16,
    "INT32": mavlink.MAV_PARAM_TYPE_INT32,
    "REAL32": mavlink.MAV_PARAM_TYPE_REAL32,
}


class Parameter(NamedTuple):
    """One row: `wire_type` is a MAV_PARAM_TYPE; the value is a float for REAL32, else an int."""

    name: str
    wire_type: int
    value: ParameterValue


@cache
def load_parameters(package: str, file: str) -> tuple[Parameter, ...]:
    """The rows of a table in their order, which is that of param_index; read once.

    Args:
        package: where the file lies, e.g. "sitl_mock.personality.px4".
        file: its name.
    """
    lines = files(package).joinpath(file).read_text(encoding="ascii").splitlines()
    return tuple(_parameter(row) for row in csv.DictReader(line for line in lines if not line.startswith("#")))


def _parameter(row: dict[str, str]) -> Parameter:
    value = float(row["value"]) if row["type"] == "REAL32" else int(row["value"])
    return Parameter(row["name"], _WIRE_TYPES[row["type"]], value)
