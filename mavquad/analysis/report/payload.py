"""The report as the page carries it: JSON with the numbers as base64 of little-endian floats, within a budget of bytes.

Values are float32, times float64 (a log may span years). Where the whole would not fit, the longest tables are thinned to the
greatest common number of rows that does, and the report says so.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy

from mavquad.analysis.report.model import Lane, Line, Mark, Numbers, Panel, Report, Track
from mavquad.analysis.report.thinning import extremes, strided, with_gaps

DATA_BYTES = 4_000_000
"""Of all numbers together, as base64."""
MARKS = 3000
SPANS = 2000
_TEXT_LENGTH = 300
_TRACK_ROWS = 20_000


@dataclass(slots=True)
class _Table:
    """Columns over one array of times."""

    times_s: Numbers
    is_track: bool
    columns: list[Numbers] = field(default_factory=list)

    def add(self, column: Numbers) -> int:
        self.columns.append(column)
        return len(self.columns) - 1

    def rows(self, most: int) -> int:
        """How many rows are kept where `most` are allowed."""
        return min(len(self.times_s), most, _TRACK_ROWS if self.is_track else most)

    def thinned(self, most: int) -> tuple[Numbers, list[Numbers]]:
        thin = strided if self.is_track else extremes
        return with_gaps(*thin(self.times_s, self.columns, self.rows(most)))


class _Tables:
    """Tables by the array of times that their columns share."""

    def __init__(self) -> None:
        self.all: list[_Table] = []
        self._by_times: dict[tuple[int, bool], int] = {}

    def of(self, times_s: Numbers, is_track: bool) -> int:
        key = (id(times_s), is_track)
        if key not in self._by_times:
            self._by_times[key] = len(self.all)
            self.all.append(_Table(times_s, is_track))
        return self._by_times[key]


def payload(report: Report, data_bytes: int = DATA_BYTES) -> dict[str, Any]:
    """Everything that the page's script needs, ready for `json.dumps`."""
    tables = _Tables()
    panels = [_panel(panel, tables) for panel in report.panels]
    tracks = [_track(track, tables) for track in report.tracks]
    most = _rows_within(tables.all, data_bytes)
    marks, dropped = _most_severe(report.marks)
    return {
        "title": report.title,
        "start_us": report.start_us,
        "duration_s": report.duration_s,
        "view_s": list(report.view_s),
        "tables": [_packed(table, most) for table in tables.all],
        "panels": panels,
        "tracks": tracks,
        "lanes": [_lane(lane, report.duration_s) for lane in report.lanes],
        "marks": [[round(mark.time_s, 6), mark.kind, mark.text[:_TEXT_LENGTH], mark.severity] for mark in marks],
        "remarks": [*report.remarks, *_thinned_remark(tables.all, most), *_dropped_remark(dropped)],
    }


def _rows_within(tables: Sequence[_Table], data_bytes: int) -> int:
    """The greatest number of rows for each table with which all of them fit."""
    longest = max((len(table.times_s) for table in tables), default=0)
    low, high = 2, max(longest, 2)
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if _size(tables, middle) <= data_bytes else (low, middle - 1)
    return low


def _size(tables: Sequence[_Table], most: int) -> float:
    return sum(table.rows(most) * (4 * len(table.columns) + 8) for table in tables) * 4 / 3


def _packed(table: _Table, most: int) -> dict[str, Any]:
    times_s, columns = table.thinned(most)
    with numpy.errstate(over="ignore"):  # what float32 cannot hold is infinite, and no point of a line
        narrow = [column.astype("<f4") for column in columns]
    return {"times": _base64(times_s.astype("<f8")), "columns": [_base64(column) for column in narrow]}


def _base64(array: numpy.ndarray[Any, Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")


def _panel(panel: Panel, tables: _Tables) -> dict[str, Any]:
    return {
        "key": panel.key,
        "title": panel.title,
        "unit": panel.unit,
        "span": panel.least_span,
        "tolerance": panel.tolerance,
        "lines": [_line(line, tables) for line in panel.lines],
    }


def _line(line: Line, tables: _Tables) -> dict[str, Any]:
    table = tables.of(line.times_s, is_track=False)
    column = tables.all[table].add(line.values)
    return {"name": line.name, "table": table, "column": column, "colour": line.colour, "dashed": line.dashed}


def _track(track: Track, tables: _Tables) -> dict[str, Any]:
    table = tables.of(track.times_s, is_track=True)
    columns = [tables.all[table].add(track.points_m[:, axis]) for axis in range(3)]
    return {"name": track.name, "table": table, "columns": columns, "colour": track.colour, "dashed": track.dashed}


def _lane(lane: Lane, duration_s: float) -> dict[str, Any]:
    """Neighbours of one name that are nearer than the eye can see are one."""
    least_s = duration_s / SPANS
    merged: list[list[Any]] = []
    for span in lane.spans:
        if merged and merged[-1][2] == span.name and span.from_s - merged[-1][1] <= least_s:
            merged[-1][1] = round(span.to_s, 6)
        else:
            merged.append([round(span.from_s, 6), round(span.to_s, 6), span.name])
    return {"name": lane.name, "alarming": lane.alarming, "spans": merged[:SPANS]}


def _most_severe(marks: Sequence[Mark]) -> tuple[list[Mark], int]:
    """All of them, or where they are too many the gravest; how many were left out."""
    if len(marks) <= MARKS:
        return sorted(marks, key=lambda mark: mark.time_s), 0
    grave = sorted(marks, key=lambda mark: (math.inf if mark.severity is None else mark.severity, mark.time_s))
    return sorted(grave[:MARKS], key=lambda mark: mark.time_s), len(marks) - MARKS


def _thinned_remark(tables: Sequence[_Table], most: int) -> list[str]:
    longest = max((len(table.times_s) for table in tables if not table.is_track), default=0)
    if longest <= most:
        return []
    return [
        f"The page shows at most {most} of up to {longest} samples of each line, the extremes of every stretch among "
        "them; every sample is in the columns beside this page."
    ]


def _dropped_remark(dropped: int) -> list[str]:
    return [f"{dropped} texts are left out here, the least severe ones."] if dropped else []
