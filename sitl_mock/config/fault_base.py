"""What faults have in common: when they act, and how commands, messages and results are named."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from mavquad.protocol.codec import mavlink
from mavquad.schema import Section

SINCE = ("boot", "armed", "takeoff", "offboard")
"""Moments that every autopilot has; the names of its modes are others."""

Seconds = Annotated[float, Field(ge=0, le=1e6)]
Duration = Annotated[float, Field(gt=0, le=1e6)]
Probability = Annotated[float, Field(ge=0, le=1)]
Milliseconds = Annotated[float, Field(ge=0, le=60_000)]
Times = Annotated[int, Field(ge=1, le=1_000_000)]

_COMMANDS: dict[str, int] = {entry.name: number for number, entry in mavlink.enums["MAV_CMD"].items()}
_RESULTS: dict[str, int] = {entry.name: number for number, entry in mavlink.enums["MAV_RESULT"].items()}
MESSAGE_IDS: dict[str, int] = {message.msgname: number for number, message in mavlink.mavlink_map.items()}
"""Every message of the dialect, by its name."""


def meant(given: str, known: Iterable[str]) -> str:
    """'; did you mean ...?' for something that is close to what is known, or ''."""
    close = difflib.get_close_matches(given, list(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _number(value: object, prefix: str, numbers: dict[str, int]) -> object:
    if not isinstance(value, str):
        return value
    name = value.upper() if value.upper().startswith(prefix) else prefix + value.upper()
    if name not in numbers:
        raise ValueError(f"no {prefix.rstrip('_')} has that name{meant(name, numbers)}")
    return numbers[name]


def _command(value: object) -> object:
    return _number(value, "MAV_CMD_", _COMMANDS)


def _result(value: object) -> object:
    return _number(value, "MAV_RESULT_", _RESULTS)


def _message(name: str) -> str:
    if name and name not in MESSAGE_IDS:
        raise ValueError(f"no MAVLink message has that name{meant(name.upper(), MESSAGE_IDS)}")
    return name


Command = Annotated[int, BeforeValidator(_command), Field(ge=0, le=65535)]
Result = Annotated[int, BeforeValidator(_result), Field(ge=0, le=9)]
MessageName = Annotated[str, AfterValidator(_message)]
Direction = Literal["to_vehicle", "from_vehicle", "both"]


class Timed(Section):
    """A fault that counts its time from a moment."""

    since: str = "boot"
    """What `from_s` or `at_s` counts from: "boot" (the start of the mock), the first time that it is "armed", at
    "takeoff" (off the ground) or in "offboard" (PX4's OFFBOARD once armed, ArduPilot's GUIDED), or the first entry into
    the mode of that name."""


class Window(Timed):
    """A fault that acts for a while."""

    from_s: Seconds = 0.0
    """Start in s."""
    for_s: Duration = 1e6
    """Duration in s."""


class Moment(Timed):
    """A fault that happens once."""

    at_s: Seconds = 0.0
    """Moment in s."""
