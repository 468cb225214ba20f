"""[parameters]: what is changed on a vehicle before a flight, and put back after it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator, Field

from mavquad.protocol.firmware import ARDUCOPTER, PX4, Firmware
from mavquad.schema import Section

NAME_MAX = 16
"""Of PARAM_SET.param_id."""


def _wanted(value: float | str) -> float | str:
    if isinstance(value, str):
        if not (value.startswith("+") and value[1:].isdigit() and int(value[1:]) > 0):
            raise ValueError('write a number, or bits to be set besides, e.g. "+8"')
    elif not math.isfinite(value):
        raise ValueError("write a finite number")
    return value


def _name(name: str) -> str:
    if not (name and len(name) <= NAME_MAX and name.isascii() and name.replace("_", "").isalnum()):
        raise ValueError(f"{name!r} is no parameter's name: up to {NAME_MAX} letters, digits and underscores")
    return name


Changes = dict[Annotated[str, AfterValidator(_name)], Annotated[float | str, AfterValidator(_wanted)]]

_TRANSMITTER = "COM_RCL_EXCEPT"
"""What lets PX4 fly OFFBOARD without a transmitter; one that is there keeps its failsafe."""


class VehicleParameters(Section):
    """Parameters by name: a number, or "+8" for bits that are set besides those that are. Each is read first, kept in the
    run folder, changed where it differs, verified, and put back at the end. One that the vehicle does not know is left out."""

    px4: Changes = Field(default={"COM_OF_LOSS_T": 0.5, _TRANSMITTER: "+4"})
    """PX4: its failsafe acts after half a second without setpoints; OFFBOARD flies without a transmitter (where one is
    heard this is left as it is)."""
    arducopter: Changes = Field(default={"GUID_OPTIONS": "+8", "GUID_TIMEOUT": 0.3, "ATC_ANGLE_BOOST": 0.0})
    """ArduCopter: the thrust field is thrust and not a climb rate; the last setpoint is held for 0.3 s; thrust is not
    increased by its own idea of the tilt, which the law has already counted in."""

    def changes(self, firmware: Firmware) -> Changes:
        """What is changed on a vehicle of this firmware."""
        return {PX4: self.px4, ARDUCOPTER: self.arducopter}[firmware]

    def wanted(self, firmware: Firmware, found: Mapping[str, float], transmitter: bool) -> dict[str, float]:
        """The new values.

        Args:
            firmware: the vehicle's.
            found: the present values by name; what is not among them is not known to the vehicle.
            transmitter: whether a transmitter is heard (SYS_STATUS).
        """
        return {
            name: _merged(change, found[name])
            for name, change in self.changes(firmware).items()
            if name in found and not (transmitter and name == _TRANSMITTER)
        }


def _merged(change: float | str, present: float) -> float:
    return float(int(present) | int(change[1:])) if isinstance(change, str) else change
