"""Numbers and names as a reader likes them: quantities with units, moments, and a summary as rows of a table."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def quantity(value: float | None, factor: float = 1.0, unit: str = "", digits: int = 1) -> str:
    """A number times a factor with its unit; a dash for None."""
    return "–" if value is None else f"{value * factor:.{digits}f}{unit}"


def moment(stamp_us: int) -> str:
    """A Unix stamp as a date and time in UTC."""
    return f"{_EPOCH + timedelta(microseconds=stamp_us):%Y-%m-%d %H:%M:%S} UTC"


def flattened(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted name, value) of everything in a summary; lists of plain values stay one value."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flattened(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for index, inner in enumerate(value):
            yield from flattened(inner, f"{name}.{index}")
    else:
        yield name, value
