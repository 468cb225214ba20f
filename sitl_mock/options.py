"""What a user's options and files say about a mock vehicle, as the table that `MockConfig` checks."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mavquad.errors import ConfigError, InputError
from mavquad.schema import Section, parse_section
from sitl_mock.config import MockConfig
from sitl_mock.config.faults import Fault


class _FaultFile(Section):
    """A file of scripted faults, each a table `[[faults]]`."""

    faults: tuple[Fault, ...]
    """Scripted faults."""


def read_table(path: Path) -> dict[str, Any]:
    """A TOML file's [mock] table, or the whole file where it has none.

    Raises:
        ConfigError: the file cannot be read, or [mock] is no table.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ConfigError(str(path), "", reason) from None
    table = document.get("mock", document)
    if not isinstance(table, dict):
        raise ConfigError(str(path), "mock", "must be a table")
    return table


def read_faults(paths: Sequence[Path]) -> list[dict[str, Any]]:
    """The faults of some files, checked, as tables.

    Raises:
        ConfigError: a file cannot be read, or a key of it is wrong.
    """
    tables: list[dict[str, Any]] = []
    for path in paths:
        checked = parse_section(_FaultFile, read_table(path), str(path))
        tables += checked.model_dump(mode="json")["faults"]
    return tables


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
        raise InputError(f"{option} {text}: not three numbers", f"write N,E,D in m/s, e.g. {option} 3,0,0")
    return numbers


def load_config(path: Path | None, options: dict[str, Any], faults: Sequence[Path] = ()) -> MockConfig:
    """The configuration in a file, or the default one, with the options laid over it; None leaves a key as it is.

    Raises:
        ConfigError: a file cannot be read or a value is not allowed.
    """
    table = read_table(path) if path is not None else {}
    table = {**table, **{key: value for key, value in options.items() if value is not None}}
    if faults:
        table["faults"] = [*table.get("faults", ()), *read_faults(faults)]
    return parse_section(MockConfig, table, str(path) if path is not None else "sitl-mock", "mock")
