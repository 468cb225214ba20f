"""The base of every section of a configuration: frozen, strict, no unknown keys, no NaN; and its error messages."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from typing import Any, TypeVar

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
        first = error.errors()[0]
        key = ".".join(str(part) for part in ((prefix,) if prefix else ()) + first["loc"])
        raise ConfigError(path, key, _reason(model, first)) from None


def _reason(model: type[BaseModel], error: Any) -> str:
    if error["type"] == "extra_forbidden":
        allowed = _allowed_keys(model, error["loc"][:-1])
        close = difflib.get_close_matches(str(error["loc"][-1]), allowed, n=1)
        meant = f"did you mean {close[0]}? " if close else ""
        return f"unknown key; {meant}allowed here: {', '.join(allowed)}"
    reason = str(error["msg"]).removeprefix("Value error, ")
    given = error.get("input")
    return f"{reason} (given: {given!r})" if not isinstance(given, dict) else reason


def _allowed_keys(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    for part in location:
        field = model.model_fields.get(str(part))
        if field is None or not isinstance(field.annotation, type) or not issubclass(field.annotation, BaseModel):
            break
        model = field.annotation
    return sorted(model.model_fields)
