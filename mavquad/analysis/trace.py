"""`trace.csv`: one row a step of the law, one column a number, with the unit in every name.

Numbers are written so that they read back to the last bit. 4-vectors are in the order z, yaw, x, y (NWU).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TextIO

from mavquad.errors import LogError
from mavquad.flight_record import TraceRow
from mavquad.types import CHANNELS, Vec4

_UNIT = {"z": "m", "yaw": "rad", "x": "m", "y": "m"}
_ESTIMATED_DERIVATIVES = 4
_INPUTS = ("input_v1_m_s4", "input_v2_rad_s4", "input_roll_rad_s2", "input_pitch_rad_s2")
_CONTROLS = ("control_roll_norm", "control_pitch_norm", "control_yaw_norm", "control_thrust_norm")
_LIMITS_JOINT = "+"


def _unit(channel: str, derivative: int) -> str:
    """Unit of a derivative of an output as names carry it: m, m_s, m_s2 ..."""
    return _UNIT[channel] + ("" if derivative == 0 else "_s" if derivative == 1 else f"_s{derivative}")


def _columns(quantity: str, derivative: int) -> list[str]:
    return [f"{quantity}_{channel}_{_unit(channel, derivative)}" for channel in CHANNELS]


_NUMBERS = (
    *_columns("measured", 0),
    *_columns("reference", 0),
    *(f"zeta_hat_{channel}_{_unit(channel, i)}" for channel in CHANNELS for i in range(_ESTIMATED_DERIVATIVES)),
    *_columns("sigma", 4),
    *_columns("demanded", 4),
    *_INPUTS,
    *_CONTROLS,
)
HEADER = ("stamp_us", "vehicle_stamp_us", "phase", *_NUMBERS, "limits")
"""Names of the columns, in order."""


class TraceWriter:
    """Writes the header at once and then rows as they come; open the stream with newline=""."""

    def __init__(self, stream: TextIO) -> None:
        self._writer = csv.writer(stream, lineterminator="\n")
        self._writer.writerow(HEADER)

    def write(self, rows: Iterable[TraceRow]) -> None:
        """Append rows."""
        self._writer.writerows(_cells(row) for row in rows)


def write_trace(stream: TextIO, rows: Iterable[TraceRow]) -> None:
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


def _rows(lines: Iterator[list[str]], path: str) -> Iterator[TraceRow]:
    if tuple(next(lines, ())) != HEADER:
        raise LogError(path, "is not a trace of this version of mavquad: its first line differs")
    for number, cells in enumerate(lines, start=2):
        try:
            yield _row(cells)
        except ValueError as error:
            raise LogError(path, f"line {number}: {error}") from error


def _cells(row: TraceRow) -> list[str | int]:
    vectors = (row.measured, row.reference, *row.zeta_hat, row.sigma, row.demanded, row.input, row.controls)
    numbers = [repr(float(number)) for vector in vectors for number in vector]
    return [row.stamp_us, row.vehicle_stamp_us, row.phase, *numbers, _LIMITS_JOINT.join(row.limits)]


def _row(cells: Sequence[str]) -> TraceRow:
    if len(cells) != len(HEADER):
        raise ValueError(f"{len(cells)} cells instead of {len(HEADER)}")
    numbers = [float(cell) for cell in cells[3:-1]]
    vectors = [_vec4(numbers[i : i + 4]) for i in range(0, len(numbers), 4)]
    return TraceRow(
        stamp_us=int(cells[0]),
        vehicle_stamp_us=int(cells[1]),
        phase=cells[2],
        measured=vectors[0],
        reference=vectors[1],
        zeta_hat=tuple(vectors[2:6]),
        sigma=vectors[6],
        demanded=vectors[7],
        input=vectors[8],
        controls=vectors[9],
        limits=tuple(cells[-1].split(_LIMITS_JOINT)) if cells[-1] else (),
    )


def _vec4(numbers: Sequence[float]) -> Vec4:
    first, second, third, fourth = numbers
    return (first, second, third, fourth)
