"""What is remembered of the parameters that we change on a vehicle: enough to put them back, even by another process."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from mavquad.protocol.codec import mavlink
from mavquad.schema import Section

ParamNumber = int | float
"""An int for the integer types, a float (of single precision) for REAL32."""

_PREFIX = "MAV_AUTOPILOT_"


class ParamRecord(Section):
    """One parameter that is changed."""

    name: str = Field(min_length=1, max_length=16, pattern=r"^[\x21-\x7e]+$")
    """As MAVLink has it."""
    type: Literal["UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "REAL32"]
    """MAV_PARAM_TYPE, without its prefix."""
    original: ParamNumber
    """What it was before."""
    changed: ParamNumber
    """What we set it to."""


class ChangedParameters(Section):
    """All that a run changes on its vehicle."""

    system_id: int = Field(ge=1, le=255)
    """The vehicle's."""
    component_id: int = Field(ge=1, le=255)
    """Its autopilot's."""
    autopilot: str
    """MAV_AUTOPILOT of its HEARTBEAT, without its prefix."""
    parameters: tuple[ParamRecord, ...]
    """In the order in which they were asked for."""
    restored: bool = False
    """Whether the originals were put back, and read back."""

    @model_validator(mode="after")
    def _once_each(self) -> ChangedParameters:
        names = [record.name for record in self.parameters]
        if len(set(names)) != len(names):
            raise ValueError("a parameter is listed twice")
        return self


def autopilot_name(autopilot: int) -> str:
    """A MAV_AUTOPILOT without its prefix, e.g. PX4 or ARDUPILOTMEGA; its number if it has no name."""
    entry = mavlink.enums["MAV_AUTOPILOT"].get(autopilot)
    return entry.name.removeprefix(_PREFIX) if entry else str(autopilot)


def number_words(value: ParamNumber) -> str:
    """A value as people write it: 0.3 for the float nearest to it, every digit of an integer."""
    return str(value) if isinstance(value, int) else f"{value:g}"
