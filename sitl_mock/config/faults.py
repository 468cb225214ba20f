"""Scripted faults: one section a kind, told apart by their key `kind`. Here those of the autopilot's dialogue, and all.

A fault file is a TOML file with a table `[[fault]]` for each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from mavquad.errors import ConfigError
from mavquad.schema import Section, parse_section, read_toml
from sitl_mock.config.fault_base import SINCE, Command, Duration, MessageName, Moment, Result, Times, Window, meant
from sitl_mock.config.link_faults import Corrupt, Delay, Drop, Duplicate, Jitter, Reorder
from sitl_mock.config.vehicle_faults import (
    Die,
    EstimatorReset,
    GeofenceBreach,
    LowBattery,
    ModeChange,
    PayloadDrop,
    Reboot,
    WeakRotor,
    WindStep,
)


class CommandFault(Window):
    """A command is not answered as it should be."""

    command: Command
    """The command: its number, or its name with or without MAV_CMD_."""
    times: Times = 1_000_000
    """How many times, before all is well again."""


class Refuse(CommandFault):
    """The autopilot refuses a command."""

    kind: Literal["refuse"]
    """Discriminates the fault."""
    result: Result = 2
    """The answer: number or name of a MAV_RESULT (2: DENIED)."""
    text: Annotated[str, Field(max_length=50)] = ""
    """STATUSTEXT sent along, if any."""


class AckWithoutActing(CommandFault):
    """The autopilot acknowledges a command and does nothing."""

    kind: Literal["ack_without_acting"]
    """Discriminates the fault."""


class LateAnswer(CommandFault):
    """The autopilot obeys a command at once and answers late."""

    kind: Literal["late_answer"]
    """Discriminates the fault."""
    late_s: Duration
    """How late its COMMAND_ACK is in s."""


class Silent(Window):
    """No telemetry and no answer for a while; the vehicle still listens."""

    kind: Literal["silent"]
    """Discriminates the fault."""


class Deaf(Window):
    """The vehicle hears nothing for a while; it still sends."""

    kind: Literal["deaf"]
    """Discriminates the fault."""


class StreamStops(Window):
    """One message is not sent for a while."""

    kind: Literal["stream_stops"]
    """Discriminates the fault."""
    message: Annotated[MessageName, Field(min_length=1)]
    """Name of the message."""


class NanPose(Window):
    """LOCAL_POSITION_NED and ODOMETRY carry NaN for position and velocity for a while."""

    kind: Literal["nan_pose"]
    """Discriminates the fault."""


class ClockJump(Moment):
    """The time since boot jumps, as its messages tell it (time_boot_ms, time_usec, TIMESYNC); nothing else changes."""

    kind: Literal["clock_jump"]
    """Discriminates the fault."""
    jump_s: Annotated[float, Field(ge=-1e6, le=1e6)]
    """How far in s, forwards or backwards; not to below 0."""


class SecondVehicle(Window):
    """Somebody else's HEARTBEAT and ATTITUDE arrive with our system and component id, sequence numbers of its own."""

    kind: Literal["second_vehicle"]
    """Discriminates the fault."""
    looks: Literal["twin", "forged"] = "twin"
    """"twin": the same autopilot, disarmed; "forged": type GENERIC, autopilot INVALID, as recorded from an attack."""
    mavlink: Literal[1, 2] = 2
    """MAVLink version of its frames; the recorded attack used 1."""
    heartbeat_hz: Annotated[float, Field(ge=0, le=250)] = 1.0
    """Rate of its HEARTBEAT in Hz, 0 for none; the recorded attack: 170."""
    attitude_hz: Annotated[float, Field(ge=0, le=250)] = 10.0
    """Rate of its ATTITUDE in Hz, 0 for none."""


Fault = Annotated[
    Drop
    | Delay
    | Jitter
    | Duplicate
    | Reorder
    | Corrupt
    | Refuse
    | AckWithoutActing
    | LateAnswer
    | Silent
    | Deaf
    | StreamStops
    | NanPose
    | ClockJump
    | SecondVehicle
    | ModeChange
    | GeofenceBreach
    | EstimatorReset
    | LowBattery
    | PayloadDrop
    | WeakRotor
    | WindStep
    | Reboot
    | Die,
    Field(discriminator="kind"),
]


class _FaultFile(Section):
    """A fault file."""

    fault: tuple[Fault, ...]
    """The faults."""


def load_faults(path: Path, autopilot: str | None = None) -> tuple[Fault, ...]:
    """The faults of a fault file.

    Args:
        path: a TOML file with tables `[[fault]]`.
        autopilot: whose modes may be named, "px4" or "ardupilot"; None for any.

    Raises:
        ConfigError: names the file, the entry's number and kind, the key, and what is allowed.
    """
    return _checked(read_toml(path), str(path), autopilot)


def faults_of(entries: Sequence[Mapping[str, Any]], whose: str, autopilot: str | None = None) -> tuple[Fault, ...]:
    """Faults given as tables; `whose` stands for the file in messages.

    Raises:
        ConfigError: as `load_faults`.
    """
    return _checked({"fault": list(entries)}, whose, autopilot)


def _checked(table: Mapping[str, Any], path: str, autopilot: str | None) -> tuple[Fault, ...]:
    try:
        faults = parse_section(_FaultFile, table, path).fault
    except ConfigError as error:
        hint = "each fault is a table [[fault]]" if error.key.startswith("fault") and "." not in error.key else ""
        raise ConfigError(path, _place(error.key), error.reason, hint) from None
    for number, fault in enumerate(faults, 1):
        key, reason = wrong_mode(fault, autopilot)
        if key:
            raise ConfigError(path, f"fault {number} ({fault.kind}): {key}", reason)
    return faults


def _place(key: str) -> str:
    """`fault.1.refuse.command` as people count: `fault 2 (refuse): command`."""
    parts = key.split(".")
    if len(parts) < 2:
        return key
    kind = f" ({parts[2]})" if len(parts) > 2 else ""
    rest = f": {'.'.join(parts[3:])}" if len(parts) > 3 else ""
    return f"fault {int(parts[1]) + 1}{kind}{rest}"


def wrong_mode(fault: Fault, autopilot: str | None) -> tuple[str, str]:
    """(key, reason) of a mode or moment in a fault that the autopilot does not have; ("", "") if all is well."""
    modes = mode_names(autopilot)
    if isinstance(fault, ModeChange) and fault.mode not in modes:
        return "mode", _unknown(fault.mode, modes, autopilot)
    if fault.since not in (*SINCE, *modes):
        return "since", _unknown(fault.since, [*SINCE, *modes], autopilot)
    return "", ""


def _unknown(name: str, known: Sequence[str], autopilot: str | None) -> str:
    whose = f" of {autopilot}" if autopilot else ""
    return f"no such mode{whose}: {name!r}{meant(name, known) or ';'} allowed here: {', '.join(known)}"


def mode_names(autopilot: str | None) -> list[str]:
    """The names of an autopilot's modes; None for those of all."""
    # Imported here, since personalities are built on the configuration.
    if autopilot == "px4":
        from sitl_mock.personality.px4 import modes as px4

        return [mode.value for mode in px4.Mode]
    if autopilot == "ardupilot":
        from sitl_mock.personality.ardupilot import modes as copter

        return [mode.name for mode in copter.Mode]
    return sorted({*mode_names("px4"), *mode_names("ardupilot")})
