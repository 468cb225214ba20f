"""What a vehicle for tests is made of: the arguments that virtual and live ones share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mavquad.errors import ConfigError
from mavquad.schema import parse_section
from sitl_mock.config import Autopilot, MockConfig
from sitl_mock.config.faults import Fault, faults_of, load_faults
from sitl_mock.config.vehicle import load_vehicle

WHOSE = "mock vehicle"
"""Whose fault a wrong argument is, in messages."""

FaultTables = str | Path | Sequence[Mapping[str, Any]]
"""Faults as tables, as in a fault file; or such a file."""


def vehicle_config(
    autopilot: Autopilot = "px4",
    firmware: str = "auto",
    *,
    faults: FaultTables = (),
    wind: Sequence[float] = (0.0, 0.0, 0.0),
    vehicle: str | Path | Mapping[str, Any] | None = None,
    **keys: Any,
) -> MockConfig:
    """The configuration of a mock vehicle.

    Args:
        autopilot: "px4" or "ardupilot".
        firmware: "1.13" to "1.17" of PX4, "4.7" of ArduPilot; "auto": the first of them.
        faults: what goes wrong: tables such as {"kind": "silent", "since": "takeoff", "from_s": 5.0, "for_s": 2.0}, or
            the path of a fault file.
        wind: towards north, east, down in m/s.
        vehicle: a vehicle that comes with the mock ("sih", "arducopter"), a TOML file, or keys of the [vehicle] table.
        keys: further keys of the mock's configuration, e.g. link={"latency_ms": 20.0}, ready_s=0.0.

    Raises:
        ConfigError: a value is not allowed; says which, and what is.
    """
    table: dict[str, Any] = {"autopilot": autopilot, "firmware": firmware, "wind_ned_m_s": _listed("wind", wind)}
    # A link without delay costs nothing; who wants to know how a client bears one says so.
    table |= {"link": {"latency_ms": 0.0}} | keys
    if isinstance(vehicle, str | Path):
        table["vehicle"] = load_vehicle(str(vehicle)).model_dump(mode="json")
    elif vehicle is not None:
        table["vehicle"] = dict(vehicle)
    config = parse_section(MockConfig, table, WHOSE)
    return config.model_copy(update={"faults": config.faults + _faults(faults, config)})


def _faults(faults: FaultTables, config: MockConfig) -> tuple[Fault, ...]:
    if isinstance(faults, str | Path):
        return load_faults(Path(faults), config.autopilot)
    tables = _listed("faults", faults)
    if not all(isinstance(fault, Mapping) for fault in tables):
        raise ConfigError(WHOSE, "faults", 'must be tables, e.g. [{"kind": "silent", "from_s": 60.0, "for_s": 2.0}]')
    return faults_of(tables, WHOSE, config.autopilot)


def _listed(key: str, given: Any) -> list[Any]:
    """What a user gave as a sequence; one table, one text or a number is none."""
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        raise ConfigError(WHOSE, key, f"must be a list (given: {given!r})")
    return list(given)
