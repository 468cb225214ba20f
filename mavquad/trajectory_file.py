"""A trajectory from a CSV file, read when the configuration is: its rows become part of the configuration.

So a run's `config.toml` holds all that was flown, and a replay needs no other file. The first line names the columns, in any
order: t_s, north_m, east_m, down_m and, if wanted, yaw_deg (see `mavquad.flight.trajectory_rows`). Empty lines and lines that
begin with # are skipped; separators are commas.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mavquad.control.reference import ReferenceParams
from mavquad.errors import ConfigError
from mavquad.flight.trajectory_rows import COLUMNS, ROWS_MAX, ROWS_MIN, YAW_COLUMN, row_fault
from mavquad.schema import parse_section

SIZE_MAX = 10_000_000
HINT = f"the columns are {', '.join(COLUMNS)} and, if wanted, {YAW_COLUMN}"


def with_trajectory(tables: Mapping[str, Any], file: Path | None, config_path: str) -> dict[str, Any]:
    """The tables of a configuration with the rows of a trajectory file as `mission.points`.

    Args:
        tables: of the configuration.
        file: the trajectory; None leaves the tables as they are.
        config_path: where the tables came from, for messages about them.

    Raises:
        ConfigError: the file cannot be read or flown, with its line; or [mission.reference] is wrong.
    """
    if file is None:
        return dict(tables)
    mission = dict(tables["mission"])
    reference = parse_section(ReferenceParams, mission.get("reference", {}), config_path, "mission.reference")
    return {**tables, "mission": {**mission, "file": "", "points": read_rows(file, reference)}}


def read_rows(path: Path, reference: ReferenceParams) -> list[list[float]]:
    """The rows of a trajectory file, in the order of the columns.

    Raises:
        ConfigError: the file is missing, unreadable, or holds what cannot be flown; with its line.
    """
    lines = _lines(path)
    number, names = next(lines, (0, []))
    if not names:
        raise ConfigError(str(path), "", "is empty", HINT)
    order = _order(path, number, names)
    numbers, rows = [], []
    for number, cells in lines:
        numbers.append(number)
        rows.append(_row(path, number, cells, names, order))
        if len(rows) > ROWS_MAX:
            raise ConfigError(str(path), f"line {number}", f"more than {ROWS_MAX} rows")
    if len(rows) < ROWS_MIN:
        raise ConfigError(str(path), "", f"has {len(rows)} rows below its header; {ROWS_MIN} are the least")
    fault = row_fault(rows, reference)
    if fault is not None:
        raise ConfigError(str(path), f"line {numbers[fault[0]]}", fault[1])
    return rows


def _lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and cells of the lines that say something."""
    for number, line in enumerate(_text(path).splitlines(), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, [cell.strip() for cell in next(csv.reader([line]))]


def _text(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            data = stream.read(SIZE_MAX + 1)
    except FileNotFoundError:
        raise ConfigError(str(path), "", "no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigError(str(path), "", f"cannot be read ({reason.lower()})") from None
    if len(data) > SIZE_MAX:
        raise ConfigError(str(path), "", f"is larger than {SIZE_MAX // 1_000_000} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ConfigError(str(path), f"line {line}", "is not UTF-8 text", HINT) from None


def _order(path: Path, number: int, names: Sequence[str]) -> list[int]:
    """Where each column of ours stands in the file."""
    known = (*COLUMNS, YAW_COLUMN)
    problems = [
        *(f"there is no column {name}" for name in COLUMNS if name not in names),
        *(f"unknown column {name[:40]!r}" for name in names if name not in known),
        *(f"column {name} is there {names.count(name)} times" for name in known if names.count(name) > 1),
    ]
    if problems:
        raise ConfigError(str(path), f"line {number}", problems[0], HINT)
    return [names.index(name) for name in known if name in names]


def _row(path: Path, number: int, cells: Sequence[str], names: Sequence[str], order: Sequence[int]) -> list[float]:
    if len(cells) != len(names):
        raise ConfigError(str(path), f"line {number}", f"{len(cells)} values for {len(names)} columns")
    row = []
    for column in order:
        try:
            row.append(float(cells[column]))
        except ValueError:
            raise ConfigError(
                str(path), f"line {number}", f"{names[column]} is {cells[column][:40]!r}, not a number"
            ) from None
    return row
