"""A log, and what the law did in it, as an MCAP file for Foxglove and PlotJuggler: JSON messages with JSON schemas.

    /mavlink/SYSTEM/COMPONENT/MESSAGE   every message, its fields with units in their names
    /mavquad/trace                      every step of the law, as in trace.csv
    /pose                               foxglove.PoseInFrame: position and attitude, NWU, of the vehicle
    /texts                              foxglove.Log: what was said

The frame of /pose is x north, y west, z up, with the body's x forward, y left, z up. Messages lie in the order of time.
"""

from __future__ import annotations

import heapq
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

from mavquad.analysis.report.columns import columns_of
from mavquad.analysis.report.model import Mark, Numbers, Report
from mavquad.analysis.trace import row_values
from mavquad.errors import InputError
from mavquad.flight_record import TraceRow
from mavquad.tlog import Log, Table

FRAME = "home"
_LEVELS = (5, 5, 5, 4, 3, 2, 2, 1)  # foxglove.Log's of MAV_SEVERITY 0 to 7
_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_VECTOR = {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyz"}}
_QUATERNION = {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyzw"}}
_POSE_SCHEMA = {
    "timestamp": _TIME,
    "frame_id": {"type": "string"},
    "pose": {"type": "object", "properties": {"position": _VECTOR, "orientation": _QUATERNION}},
}
_LOG_SCHEMA = {
    "timestamp": _TIME,
    "level": {"type": "integer"},
    "message": {"type": "string"},
    "name": {"type": "string"},
    "file": {"type": "string"},
    "line": {"type": "integer"},
}
_JSON_TYPES = {"f": "number", "i": "integer", "u": "integer", "U": "string", "b": "boolean"}


class Stream(NamedTuple):
    """One topic: its schema's name and properties, and its messages as (stamp_us, message) in the order of time."""

    topic: str
    schema: str
    properties: Mapping[str, Any]
    messages: Iterator[tuple[int, Mapping[str, Any]]]


def write_mcap(path: Path, log: Log | None, rows: Sequence[TraceRow], report: Report) -> None:
    """Write it.

    Raises:
        InputError: the mcap library is not installed, or the log has no stamps.
        OSError: the file cannot be written.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        raise InputError("--export mcap: the library mcap is not installed", "pip install 'mavquad[mcap]'") from None
    if log is not None and not log.last_us:
        raise InputError("--export mcap: the log has no stamps", "a .tlog has them, a .raw has not")
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="mavquad")
        streams = list(_streams(log, rows, report))
        channels = [_register(writer, one) for one in streams]
        counts = [0] * len(streams)
        for stamp_us, index, message in heapq.merge(*map(_numbered, range(len(streams)), streams), key=_place):
            data = json.dumps(message, allow_nan=False).encode()
            writer.add_message(channels[index], stamp_us * 1000, data, stamp_us * 1000, counts[index])
            counts[index] += 1
        writer.finish()


def _numbered(index: int, stream: Stream) -> Iterator[tuple[int, int, Mapping[str, Any]]]:
    return ((stamp_us, index, message) for stamp_us, message in stream.messages)


def _place(item: tuple[int, int, Mapping[str, Any]]) -> tuple[int, int]:
    return item[:2]


def _register(writer: Any, stream: Stream) -> int:
    schema = {"title": stream.schema, "type": "object", "properties": stream.properties}
    number = writer.register_schema(stream.schema, "jsonschema", json.dumps(schema).encode())
    return int(writer.register_channel(stream.topic, "json", number))


def _streams(log: Log | None, rows: Sequence[TraceRow], report: Report) -> Iterator[Stream]:
    for table in log.tables.values() if log is not None else ():
        yield _table_stream(table)
    if rows:
        yield _trace_stream(rows)
    if report.marks:
        yield Stream("/texts", "foxglove.Log", _LOG_SCHEMA, _texts(report))
    for table in (log["LOCAL_POSITION_NED"] if log is not None else {}).values():
        assert log is not None
        attitude = log["ATTITUDE"].get(table.sender)
        if attitude is not None:
            topic = "/pose" if table.sender == (1, 1) else f"/pose/{table.sender[0]}/{table.sender[1]}"
            yield Stream(topic, "foxglove.PoseInFrame", _POSE_SCHEMA, _poses(table, attitude))


def _table_stream(table: Table) -> Stream:
    columns = columns_of(table)
    system, component = table.sender
    properties = {name: _json_type(values) for name, values in columns.items()}
    topic = f"/mavlink/{system}/{component}/{table.name}"
    return Stream(topic, f"mavlink.{table.name}", properties, _messages(table, columns))


def _json_type(values: NDArray[Any]) -> dict[str, Any]:
    plain = {"type": _JSON_TYPES[values.dtype.kind]}
    return plain if values.ndim == 1 else {"type": "array", "items": plain}


def _messages(table: Table, columns: Mapping[str, NDArray[Any]]) -> Iterator[tuple[int, dict[str, Any]]]:
    order = numpy.argsort(table.stamps_us, kind="stable")
    names = list(columns)
    lists = [columns[name][order].tolist() for name in names]
    stamps_us = table.stamps_us[order].tolist()
    for stamp_us, values in zip(stamps_us, zip(*lists, strict=True), strict=True):
        yield stamp_us, {name: _finite(value) for name, value in zip(names, values, strict=True)}


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return list(map(_finite, value)) if isinstance(value, list) else value


def _trace_stream(rows: Sequence[TraceRow]) -> Stream:
    first = row_values(rows[0])
    properties = {name: {"type": "string" if isinstance(value, str) else "number"} for name, value in first.items()}
    messages = ((row.stamp_us, {name: _finite(v) for name, v in row_values(row).items()}) for row in rows)
    return Stream("/mavquad/trace", "mavquad.Trace", properties, messages)


def _texts(report: Report) -> Iterator[tuple[int, dict[str, Any]]]:
    for mark in report.marks:
        stamp_us = report.start_us + round(mark.time_s * 1e6)
        yield (
            stamp_us,
            {
                "timestamp": _time(stamp_us),
                "level": _level(mark),
                "message": mark.text,
                "name": mark.kind,
                "file": "",
                "line": 0,
            },
        )


def _level(mark: Mark) -> int:
    return _LEVELS[min(mark.severity, 7)] if mark.severity is not None else 2


def _time(stamp_us: int) -> dict[str, int]:
    seconds, rest = divmod(stamp_us, 1_000_000)
    return {"sec": seconds, "nsec": rest * 1000}


def _poses(position: Table, attitude: Table) -> Iterator[tuple[int, dict[str, Any]]]:
    """Every position with the last attitude before it, both flipped to NWU and FLU (y and z change their signs)."""
    order = numpy.argsort(position.stamps_us, kind="stable")
    known = numpy.argsort(attitude.stamps_us, kind="stable")
    stamps_us = position.stamps_us[order]
    last = numpy.searchsorted(attitude.stamps_us[known], stamps_us, side="right") - 1
    angles = numpy.stack([attitude[name][known][numpy.maximum(last, 0)] for name in ("roll", "pitch", "yaw")])
    points = numpy.stack([position["x"], -position["y"], -position["z"]], axis=1)[order]
    quaternions = _quaternions(angles[0], -angles[1], -angles[2])
    usable = (last >= 0) & numpy.isfinite(points).all(axis=1) & numpy.isfinite(quaternions).all(axis=1)
    for index in numpy.flatnonzero(usable).tolist():
        stamp_us = int(stamps_us[index])
        pose = {
            "position": dict(zip("xyz", points[index].tolist(), strict=True)),
            "orientation": dict(zip("xyzw", quaternions[index].tolist(), strict=True)),
        }
        yield stamp_us, {"timestamp": _time(stamp_us), "frame_id": FRAME, "pose": pose}


def _quaternions(roll: Numbers, pitch: Numbers, yaw: Numbers) -> Numbers:
    """x, y, z, w (n, 4) of Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, sr), (cp, sp), (cy, sy) = ((numpy.cos(a / 2.0), numpy.sin(a / 2.0)) for a in (roll, pitch, yaw))
    return numpy.stack(
        (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ),
        axis=1,
    )
