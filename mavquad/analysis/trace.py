"""`trace.csv`: one row a step of the law, one column a number, with the unit in every name.

Numbers are written so that they read back to the last bit. 4-vectors are in the order z, yaw, x, y (NWU). How many
derivatives the observer estimates, and with them the units of the law's demand and inputs, are the depth's: the first line
says them.
"""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TextIO

from mavquad.errors import LogError
from mavquad.flight_record import TraceRow
from mavquad.types import CHANNELS, Vec3, Vec4

_UNIT = {"z": "m", "yaw": "rad", "x": "m", "y": "m"}
_LENGTHS_MAX = 4
_INPUTS = ("thrust", "yaw", "roll", "pitch")
_CONTROLS = {
    4: ("roll_norm", "pitch_norm", "yaw_norm", "thrust_norm"),
    3: ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s", "thrust_norm"),
    2: ("roll_rad", "pitch_rad", "yaw_rad", "thrust_norm"),
}
_LIMITS_JOINT = "+"
Lengths = tuple[int, int]
"""How many derivatives are estimated of z, x and y, and of yaw."""


def _power(unit: str, derivative: int) -> str:
    """Unit of a derivative as names carry it: m, m_s, m_s2 ..."""
    return unit + ("" if derivative == 0 else "_s" if derivative == 1 else f"_s{derivative}")


def _columns(quantity: str, place: int, yaw: int) -> list[str]:
    """One column a channel; derivatives of this order of z, x and y, and of yaw."""
    return [f"{quantity}_{c}_{_power(_UNIT[c], yaw if c == 'yaw' else place)}" for c in CHANNELS]


def header(lengths: Lengths) -> tuple[str, ...]:
    """Names of the columns, in order."""
    place, yaw = lengths
    estimated = {c: yaw if c == "yaw" else place for c in CHANNELS}
    inputs = (_power("m", place), _power("rad", yaw))
    turn = _power("rad", place - 2)
    return (
        "stamp_us",
        "vehicle_stamp_us",
        "phase",
        *_columns("measured", 0, 0),
        *_columns("reference", 0, 0),
        *(f"zeta_hat_{c}_{_power(_UNIT[c], i)}" for c in CHANNELS for i in range(estimated[c])),
        *_columns("sigma", place, yaw),
        *(f"wind_{axis}_m_s2" for axis in "xyz"),
        *_columns("demanded", place, yaw),
        *(f"input_{name}_{unit}" for name, unit in zip(_INPUTS, (*inputs, turn, turn), strict=True)),
        *(f"control_{name}" for name in _CONTROLS[place]),
        "limits",
    )


_HEADERS = {header((place, yaw)): (place, yaw) for place in _CONTROLS for yaw in range(1, _LENGTHS_MAX + 1)}


class TraceWriter:
    """Writes rows as they come, the header before the first; open the stream with newline=""."""

    def __init__(self, stream: TextIO) -> None:
        self._writer = csv.writer(stream, lineterminator="\n")
        self._begun = False

    def write(self, rows: Sequence[TraceRow]) -> None:
        """Append rows."""
        if rows and not self._begun:
            self._begun = True
            self._writer.writerow(header((len(rows[0].zeta_hat[0]), len(rows[0].zeta_hat[1]))))
        self._writer.writerows(_cells(row) for row in rows)


def write_trace(stream: TextIO, rows: Sequence[TraceRow]) -> None:
    """Write the header and the rows; open the stream with newline=""."""
    TraceWriter(stream).write(rows)


def read_trace(path: Path | str) -> list[TraceRow]:
    """Read what `write_trace` wrote.

    Raises:
        LogError: the file cannot be read, or is not a trace; the message names the line.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8") as stream:
            return list(_rows(csv.reader(stream), str(path)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise LogError(str(path), f"cannot be read: {error}") from error


def read_whole_rows(text: str, path: str) -> tuple[list[TraceRow], int]:
    """The whole rows of a trace whose writing broke off, or that was damaged since; and how many lines are not whole.

    Raises:
        LogError: it is no trace of this version: its first line differs.
    """
    *lines, cut = text.split("\n")
    if not lines:
        return [], int(bool(cut))
    first = lines[0].split(",")
    lengths = _lengths(tuple(first), path)
    rows: list[TraceRow] = []
    for line in lines[1:]:
        with contextlib.suppress(ValueError):
            rows.append(_row(line.split(","), lengths, len(first)))
    return rows, len(lines) - 1 - len(rows) + bool(cut)


def _lengths(first: tuple[str, ...], path: str) -> Lengths:
    lengths = _HEADERS.get(first)
    if lengths is None:
        raise LogError(path, "is not a trace of this version of mavquad: its first line differs")
    return lengths


def _rows(lines: Iterator[list[str]], path: str) -> Iterator[TraceRow]:
    first = tuple(next(lines, ()))
    if not first:
        return  # the law was never in control
    lengths = _lengths(first, path)
    for number, cells in enumerate(lines, start=2):
        try:
            yield _row(cells, lengths, len(first))
        except ValueError as error:
            raise LogError(path, f"line {number}: {error}") from error


def _cells(row: TraceRow) -> list[str | int]:
    numbers = map(repr, _numbers(row))
    return [row.stamp_us, row.vehicle_stamp_us, row.phase, *numbers, _LIMITS_JOINT.join(row.limits)]


def _numbers(row: TraceRow) -> list[float]:
    """In the order of the header."""
    vectors: Iterable[tuple[float, ...]] = (
        row.measured,
        row.reference,
        *row.zeta_hat,
        row.sigma,
        row.wind,
        row.demanded,
        row.input,
        row.controls,
    )
    return [float(number) for vector in vectors for number in vector]


def row_values(row: TraceRow) -> dict[str, float | int | str]:
    """One row by the names of its columns."""
    names = header((len(row.zeta_hat[0]), len(row.zeta_hat[1])))
    values: tuple[float | int | str, ...]
    values = (row.stamp_us, row.vehicle_stamp_us, row.phase, *_numbers(row), _LIMITS_JOINT.join(row.limits))
    return dict(zip(names, values, strict=True))


def _row(cells: Sequence[str], lengths: Lengths, width: int) -> TraceRow:
    if len(cells) != width:
        raise ValueError(f"{len(cells)} cells instead of {width}")
    numbers = iter([float(cell) for cell in cells[3:-1]])
    place, yaw = lengths
    return TraceRow(
        stamp_us=int(cells[0]),
        vehicle_stamp_us=int(cells[1]),
        phase=cells[2],
        measured=_vec4(numbers),
        reference=_vec4(numbers),
        zeta_hat=tuple(_take(numbers, length) for length in (place, yaw, place, place)),
        sigma=_vec4(numbers),
        wind=_vec3(numbers),
        demanded=_vec4(numbers),
        input=_vec4(numbers),
        controls=_vec4(numbers),
        limits=tuple(cells[-1].split(_LIMITS_JOINT)) if cells[-1] else (),
    )


def _take(numbers: Iterator[float], count: int) -> tuple[float, ...]:
    return tuple(next(numbers) for _ in range(count))


def _vec3(numbers: Iterator[float]) -> Vec3:
    return (next(numbers), next(numbers), next(numbers))


def _vec4(numbers: Iterator[float]) -> Vec4:
    return (next(numbers), next(numbers), next(numbers), next(numbers))
