"""A configuration: TOML in, validated and frozen; overrides by dotted keys; the complete one out again."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import Field

from mavquad.agent_params import AgentParams
from mavquad.errors import ConfigError
from mavquad.schema import parse_section, read_toml
from mavquad.trajectory_file import with_trajectory

DEFAULT_NAME = "mock.toml"
FILE_KEY = "mission.file"


class Config(AgentParams):
    """All that a flight can be told: the agent's sections, the seed, and the mock's own table."""

    seed: int = Field(default=1, ge=0, lt=1 << 31)
    """Seed of everything random in the mock: noise, wander, the link's losses."""
    mock: dict[str, Any] = Field(default_factory=dict)
    """The bundled mock autopilot; its keys are the mock's to check."""


def default_path() -> Path:
    """The configuration that comes with the package: in the wheel, or in a source checkout beside it."""
    package = Path(__file__).resolve().parent
    inside = package / "configs" / DEFAULT_NAME
    return inside if inside.exists() else package.parent / "configs" / DEFAULT_NAME


@dataclass(frozen=True, slots=True)
class Override:
    """A value laid over the file's.

    Attributes:
        key: where it goes, e.g. "law.omega0_rad_s".
        text: the value in TOML, or a text as it is.
        option: what the user wrote, for the message.
        adds: the value is an array, and goes on top of the file's.
    """

    key: str
    text: str
    option: str = "--set"
    adds: bool = False


def parse_override(assignment: str) -> Override:
    """`key.path=value` as an override.

    Raises:
        ConfigError: it is not of that form.
    """
    key, separator, text = assignment.partition("=")
    if not separator or not all(part.strip() for part in key.split(".")):
        raise ConfigError("--set", assignment, "write it as key.path=value, e.g. law.omega0_rad_s=1.2")
    return Override(key.strip(), text.strip())


def with_overrides(tables: Mapping[str, Any], overrides: Iterable[Override]) -> dict[str, Any]:
    """Tables with the overrides laid over them; a value is read as TOML, or as text where it is none.

    Raises:
        ConfigError: an override runs through a key that is not a table.
    """
    merged = _copied(tables)
    for override in overrides:
        *parents, name = (part.strip() for part in override.key.split("."))
        table = merged
        for part in parents:
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                raise ConfigError(override.option, override.key, f"{part!r} is a value, not a table")
        value = _toml_value(override.text)
        before = table.get(name)
        table[name] = [*before, *value] if override.adds and isinstance(before, list) else value
    return merged


def _copied(tables: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _copied(value) if isinstance(value, dict) else value for key, value in tables.items()}


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def load(path: Path, overrides: Sequence[Override] = ()) -> Config:
    """Read, override and validate a configuration; a trajectory file that it names becomes part of it.

    Raises:
        ConfigError: with the full path of the wrong key and what is allowed, or the line of the trajectory file.
    """
    tables = _named(with_overrides(read_toml(path), overrides), overrides)
    with blaming_options(overrides):
        return parse_section(
            Config, with_trajectory(tables, _trajectory(tables, path, overrides), str(path)), str(path)
        )


def _named(tables: dict[str, Any], overrides: Sequence[Override]) -> dict[str, Any]:
    """A trajectory file that is given is meant to be flown, unless it is said beside it what is flown."""
    mission = tables.get("mission")
    if not isinstance(mission, dict) or not mission.get("file"):
        return tables
    given = {override.key for override in overrides}
    if "name" in mission and not (FILE_KEY in given and "mission.name" not in given):
        return tables
    return {**tables, "mission": {**mission, "name": "file"}}


def _trajectory(tables: Mapping[str, Any], path: Path, overrides: Sequence[Override]) -> Path | None:
    """The trajectory file to be read: from an option as it stands, from the TOML file relative to that."""
    mission = tables.get("mission")
    if not isinstance(mission, dict) or mission.get("name") != "file":
        return None
    file = mission.get("file")
    if not file or not isinstance(file, str):
        return None
    return Path(file) if any(override.key == FILE_KEY for override in overrides) else path.parent / file


@contextmanager
def blaming_options(overrides: Sequence[Override]) -> Iterator[None]:
    """Turn an error about a key that came from an option into one that names the option and not the file."""
    try:
        yield
    except ConfigError as error:
        for override in overrides:
            if _is_within(error.key, override.key):
                raise ConfigError(
                    override.option, error.key if override.option == "--set" else "", error.reason
                ) from None
        reason = error.reason
        for override in sorted(overrides, key=lambda override: override.key.rpartition(".")[2] not in reason):
            # A section as a whole is wrong, and an option changed a key of it: one that the reason names, if any.
            if _is_within(override.key, error.key):
                raise ConfigError(f"{override.option} {override.key}", "", error.reason) from None
        for override in overrides:
            # Keys that contradict each other are named in the reason.
            if not error.key and override.key in error.reason:
                raise ConfigError(f"{override.option} {override.key}={override.text}", "", error.reason) from None
        raise


def _is_within(key: str, table: str) -> bool:
    return bool(table) and (key == table or key.startswith(f"{table}."))


def dump(config: Config) -> str:
    """The complete configuration as TOML."""
    return tomli_w.dumps(config.model_dump(mode="json"))
