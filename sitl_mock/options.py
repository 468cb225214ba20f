"""What a user's options and files say about a mock vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mavquad.errors import ConfigError, InputError
from mavquad.schema import parse_section, read_toml
from sitl_mock.config import MockConfig
from sitl_mock.config.faults import load_faults
from sitl_mock.config.vehicle import load_vehicle

Options = Mapping[str, tuple[str, Any]]
"""Of each option, the key of `MockConfig` that it sets and the value; None leaves the key as it is."""

_NAME = "sitl-mock"
_IDEAL_LINK = {"latency_ms": 0.0}
"""On a socket, the network has the delays; those of a simulated link are added only if they are asked for."""


def load_config(path: Path | None, options: Options, vehicle: str | None, faults: Sequence[Path]) -> MockConfig:
    """The configuration in a file, or the default one, with the options laid over it.

    Args:
        path: a TOML file with the mock's keys, or with a table [mock] of them.
        options: what they set.
        vehicle: name or file of the vehicle, in place of the file's.
        faults: fault files, whose faults come on top of the file's.

    Raises:
        ConfigError: a file cannot be read or a value is not allowed; it names the option or the file.
    """
    table = _table(path) if path is not None else {}
    table = {"link": _IDEAL_LINK, **table, **{key: value for key, value in options.values() if value is not None}}
    if vehicle is not None:
        table["vehicle"] = load_vehicle(vehicle).model_dump(mode="json")
    try:
        config = parse_section(MockConfig, table, str(path) if path is not None else _NAME, "mock")
    except ConfigError as error:
        raise _blaming_options(error, options) from None
    more = tuple(fault for file in faults for fault in load_faults(file, config.autopilot))
    return config.model_copy(update={"faults": config.faults + more})


def _table(path: Path) -> dict[str, Any]:
    document = read_toml(path)
    table = document.get("mock", document)
    if not isinstance(table, dict):
        raise ConfigError(str(path), "mock", "must be a table")
    return table


def _blaming_options(error: ConfigError, options: Options) -> ConfigError:
    """The error, about the option if one set the key; a contradiction between keys begins with one of them."""
    for option, (key, value) in options.items():
        is_key = error.key == f"mock.{key}" or error.key.startswith(f"mock.{key}.")
        if value is not None and (is_key or (error.key == "mock" and error.reason.startswith(key))):
            return ConfigError(option, "", error.reason)
    return error


def three_numbers(option: str, text: str) -> list[float]:
    """N,E,D of an option.

    Raises:
        InputError: it is not three numbers.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3:
        raise InputError(f"{option}: {text!r} is not three numbers", f"write N,E,D in m/s, e.g. {option} 3,0,0")
    return numbers
