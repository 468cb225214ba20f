"""The options that choose the embedded mock: whose manners, which release, which vehicle, what goes wrong."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mavquad.config import Config, Override
from mavquad.errors import InputError
from mavquad.url import MOCK
from sitl_mock.config.faults import load_faults
from sitl_mock.config.vehicle import load_vehicle

_TABLE = "mock"
_SEED = "seed"


def mock_options(autopilot: str | None, firmware: str | None, vehicle: str | None) -> dict[str, dict[str, object]]:
    """Of each option, the keys of the configuration that it sets.

    The configuration's vehicle is PX4's, so that ArduPilot brings its own unless another one is named.

    Raises:
        ConfigError: there is no such vehicle, or its file is wrong.
    """
    keys: dict[str, dict[str, object]] = {
        "--autopilot": {f"{_TABLE}.autopilot": autopilot},
        "--firmware": {f"{_TABLE}.firmware": firmware and json.dumps(firmware)},
    }
    if vehicle is None and autopilot == "ardupilot":
        keys["--autopilot"][f"{_TABLE}.vehicle"] = _vehicle("arducopter")
    if vehicle is not None:
        keys["--vehicle"] = {f"{_TABLE}.vehicle": _vehicle(vehicle)}
    return keys


def _vehicle(name: str) -> str:
    return _toml(load_vehicle(name).model_dump(mode="json", exclude_none=True))


def fault_overrides(files: Sequence[Path]) -> list[Override]:
    """The faults of some files, on top of those of the configuration.

    Raises:
        ConfigError: a file cannot be read, or a key of it is wrong.
    """
    return [
        Override(
            f"{_TABLE}.faults",
            _toml([fault.model_dump(mode="json", exclude_none=True) for fault in load_faults(file)]),
            "--fault",
            True,
        )
        for file in files
    ]


def refuse_without_mock(config: Config, overrides: Sequence[Override]) -> None:
    """What is said of the mock is no mistake only where there is one.

    Raises:
        InputError: a vehicle is connected, and an option belongs to the mock.
    """
    if config.link.url == MOCK:
        return
    for override in overrides:
        if override.key == _SEED or override.key.startswith(f"{_TABLE}."):
            option = f"--set {override.key}" if override.option == "--set" else override.option
            raise InputError(
                f"{option}: this is for the mock, and {config.link.url} is a vehicle that runs already",
                "leave it out, or fly without --connect",
            )


def _toml(value: Any) -> str:
    """A value on one line; JSON's numbers, texts and booleans are TOML's."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)
