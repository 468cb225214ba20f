"""The base of every section of a configuration: frozen, strict, no unknown keys, no NaN; and its error messages."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError

from mavquad.errors import ConfigError


class Section(BaseModel):
    """A table of the TOML file. Sections live beside the code that they configure; `mavquad.config` composes them."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        validate_default=True,
        use_attribute_docstrings=True,
    )


S = TypeVar("S", bound=Section)


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        ConfigError: the file is missing, cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(str(path), "", "no such file") from None
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read ({(error.strerror or str(error)).lower()})") from None
    except RecursionError:
        raise ConfigError(str(path), "", "not a TOML file: nested too deeply") from None
    except ValueError as error:  # no UTF-8, no TOML, a number of thousands of digits, or a path with a zero byte
        raise ConfigError(str(path), "", f"not a TOML file: {error}") from None


def parse_section(model: type[S], table: Mapping[str, Any], path: str, prefix: str = "") -> S:
    """Validate a TOML table against its section.

    Args:
        model: the section's class.
        table: the parsed table.
        path: the file it came from, for the message.
        prefix: where the table stands in the file, e.g. "mock".

    Raises:
        ConfigError: with the full path of the first wrong key, and what is allowed.
    """
    try:
        # By way of JSON, strict mode still takes TOML's arrays for tuples.
        return model.model_validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        # A key that is missing may be there under a wrong name.
        first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
        key = ".".join(str(part) for part in ((prefix,) if prefix else ()) + first["loc"])
        raise ConfigError(path, key, _reason(model, first)) from None


def _reason(model: type[BaseModel], error: Any) -> str:
    *above, name = error["loc"] or ("",)
    if error["type"] == "extra_forbidden":
        return f"unknown key; {_meant(str(name), sorted(_keys(_annotation_at(model, above))))}"
    if error["type"] in ("union_tag_invalid", "union_tag_not_found"):
        key, tag = error["ctx"]["discriminator"].strip("'"), error["ctx"].get("tag", "")
        tags = [tag for member in _members(_annotation_at(model, error["loc"])) for tag in _tags(member, key)]
        return f"{f'unknown {key} {tag!r}' if tag else f'no {key}'}; {_meant(tag, tags)}"
    if error["type"] == "missing":
        return "is required"
    reason = str(error["msg"]).removeprefix("Value error, ")
    given = error.get("input")
    return f"{reason} (given: {given!r})" if not isinstance(given, dict) else reason


def _meant(name: str, allowed: list[str]) -> str:
    close = difflib.get_close_matches(name, allowed, n=1)
    return f"{f'did you mean {close[0]}? ' if close else ''}allowed here: {', '.join(allowed)}"


def _annotation_at(annotation: Any, location: Sequence[int | str]) -> Any:
    """The annotation of what stands at a place of an error: a key of a section, an element of a list, one of a union."""
    for part in location:
        if isinstance(part, int):
            annotation = get_args(annotation)[0]
        elif isinstance(annotation, type) and issubclass(annotation, BaseModel) and part in annotation.model_fields:
            annotation = annotation.model_fields[part].annotation
        else:
            annotation = next((m for m in _members(annotation) if any(part in _tags(m, k) for k in _keys(m))), None)
    return annotation


def _members(annotation: Any) -> tuple[Any, ...]:
    """The members of a union, with or without a discriminator."""
    return _members(get_args(annotation)[0]) if get_origin(annotation) is Annotated else get_args(annotation)


def _tags(member: Any, key: str) -> tuple[str, ...]:
    """What a section's key may be by its type, if it is a literal."""
    return get_args(member.model_fields[key].annotation)


def _keys(annotation: Any) -> list[str]:
    is_section = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return list(annotation.model_fields) if is_section else []
