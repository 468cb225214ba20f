"""A recording of a real autopilot: what the client sent and what the vehicle sent, on the vehicle's own clock.

Times count from the first record in microseconds of the vehicle's clock: a simulator in lockstep runs 1 to 2 % slow
against the wall, and everything the autopilot times (failsafes, streams) it times by its own clock. The stamps of
ATTITUDE tell how the two clocks lie; of every two seconds the message that was least delayed is believed.
"""

from __future__ import annotations

import bisect
import gzip
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mavquad.endpoint import GRID_US, floor_to_grid_us
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.tlog import Record, read_records, scan

Autopilot = Literal["px4", "ardupilot"]
Timed = tuple[int, Message]
"""(microseconds since the first record, message)."""

VEHICLE = (1, 1)
_CLOCK_WINDOW_US = 2_000_000
_NAME = re.compile(r"(px4-v|arducopter-)(\d+\.\d+)")
_ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording.

    Attributes:
        name: short, of the file.
        autopilot: whose.
        firmware: its release as the mock names it, e.g. "1.16".
        boot_us: the vehicle's time since boot at the first record.
        client: the client's frames with their times, strictly increasing and on the grid of an `Endpoint`.
        vehicle: the vehicle's messages with their times.
        end_us: time of the last record.
        is_cut: whether it holds exchanges alone, without the telemetry.
    """

    name: str
    autopilot: Autopilot
    firmware: str
    boot_us: int
    client: list[tuple[int, bytes]]
    vehicle: list[Timed]
    end_us: int
    is_cut: bool


def is_recording(path: Path) -> bool:
    """Whether the file's name is that of a recording of a real autopilot."""
    return _NAME.match(path.name) is not None and ".tlog" in path.suffixes


def short_name(path: Path) -> str:
    """The file's name without its ending and without what happens in it."""
    return path.name.split(".tlog")[0].split("_")[0]


def read(path: Path) -> Recording:
    """Read a recording; one that is packed (`.gz`) was cut."""
    contents = scan(gzip.decompress(path.read_bytes())) if path.suffix == ".gz" else read_records(path)
    records = sorted(contents, key=lambda record: record.stamp_us)
    match = _NAME.match(path.name)
    if match is None or not records:
        raise ValueError(f"{path}: not a recording of a real autopilot")
    clock = _Clock(records)
    start_us = clock.boot_us(records[0].stamp_us)
    client, vehicle = [], []
    for record in records:
        at_us = clock.boot_us(record.stamp_us) - start_us
        if frame_source(record.frame) == VEHICLE:
            vehicle.append((at_us, decode(record.frame)))
        else:
            client.append((max(floor_to_grid_us(at_us), client[-1][0] + GRID_US if client else 0), record.frame))
    return Recording(
        short_name(path),
        "px4" if match[1].startswith("px4") else "ardupilot",
        match[2],
        start_us,
        client,
        vehicle,
        clock.boot_us(records[-1].stamp_us) - start_us,
        path.suffix == ".gz",
    )


def clock_of(records: list[Record]) -> list[Record]:
    """The ATTITUDEs that tell the vehicle's clock: in each window of two seconds the one that was least delayed."""
    best: dict[int, Record] = {}
    for record in records:
        if frame_source(record.frame) == VEHICLE and message_id(record.frame) == _ATTITUDE:
            window = record.stamp_us // _CLOCK_WINDOW_US
            if window not in best or _offset_us(record) < _offset_us(best[window]):
                best[window] = record
    return list(best.values())


def _offset_us(record: Record) -> int:
    return int(record.stamp_us - decode(record.frame).time_boot_ms * 1000)


class _Clock:
    """Turns the recorder's stamps into the vehicle's time since boot."""

    def __init__(self, records: list[Record]) -> None:
        told = clock_of(records)
        if not told:
            raise ValueError("no ATTITUDE in the recording: nothing tells the vehicle's clock")
        self._stamps_us = [record.stamp_us for record in told]
        self._offsets_us = [_offset_us(record) for record in told]

    def boot_us(self, stamp_us: int) -> int:
        after = bisect.bisect(self._stamps_us, stamp_us)
        if after == 0:
            return stamp_us - self._offsets_us[0]
        if after == len(self._stamps_us):
            return stamp_us - self._offsets_us[-1]
        (t0, t1), (o0, o1) = self._stamps_us[after - 1 : after + 1], self._offsets_us[after - 1 : after + 1]
        return stamp_us - (o0 + (o1 - o0) * (stamp_us - t0) // (t1 - t0))
