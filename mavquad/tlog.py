"""Telemetry logs: a writer, and a reader that resynchronises on CRC and never loses a good frame.

A record is an 8-byte big-endian Unix time in microseconds and one raw MAVLink frame. The two lowest bits of the stamp
carry a link number (pymavlink's `mavlogfile`; MAVProxy writes 3 for what it sends), so stamps are multiples of 4 us.

The reader goes from record to record as long as each begins right behind the last. Where one does not, it looks for
the next marker byte whose frame has the right CRC, from the first byte behind the last good frame on: whatever else is
damaged, a whole frame is found, with its stamp where that survived. A frame of an unknown message cannot be checked;
it is passed over when the records around it are intact, and is damage otherwise.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mavquad.endpoint import GRID_US, floor_to_grid_us
from mavquad.errors import InternalError, LogError
from mavquad.protocol.codec import frame_length, is_valid, mavlink, message_id

LINK_INBOUND = 0
LINK_OUTBOUND = 3
STAMP_LENGTH = 8

_MARKER = re.compile(b"[\xfd\xfe]")
_LATEST_US = 4_102_444_800_000_000  # the year 2100
_LARGEST_JUMP_US = 86_400_000_000  # a day: what a stamp found behind damage may differ from the last good one
_NO_STAMP = -1
_LEAST_GOOD_PART = 1000  # random bytes hold about one "frame" with a right CRC in 10 MB; a log holds more than that


@dataclass(frozen=True, slots=True)
class Record:
    """One frame of a log; `stamp_us` is Unix time with the link's bits cleared, `link` what they held (0 to 3)."""

    stamp_us: int
    link: int
    frame: bytes

    @property
    def outbound(self) -> bool:
        """Whether the writer of the log sent this frame (rather than received it)."""
        return self.link == LINK_OUTBOUND


def pack_record(stamp_us: int, frame: bytes, outbound: bool) -> bytes:
    """One record as bytes.

    Raises:
        InternalError: the stamp is not on the grid of 4 us (it would not read back as it was).
    """
    if stamp_us % GRID_US:
        raise InternalError(f"a log's stamps are multiples of {GRID_US} us, not {stamp_us}")
    link = LINK_OUTBOUND if outbound else LINK_INBOUND
    return (stamp_us | link).to_bytes(STAMP_LENGTH, "big") + frame


class TlogWriter:
    """Appends records to a binary stream; whoever opened the stream flushes and closes it."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def write(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        """Append one frame that was sent (outbound) or received at `stamp_us`, a multiple of 4."""
        self._stream.write(pack_record(stamp_us, frame, outbound))


@dataclass(slots=True)
class TlogContents:
    """A log in memory: its bytes and where the good frames are; iterate over it, or index it, for `Record`s.

    Attributes:
        data: the file's bytes.
        stamps: stamp of each good frame as recorded, link bits included, in the order of the file (us).
        starts: offset of each good frame's first byte.
        ends: offset behind each good frame.
        bad_ranges: (offset, length) of what belongs to no record, in order.
        unknown_frames: intact records of messages that the dialect does not know; not among the good ones.
        repaired_stamps: good frames whose own stamp was lost and is the previous one's.
    """

    data: bytes
    stamps: array[int] = field(default_factory=lambda: array("q"))
    starts: array[int] = field(default_factory=lambda: array("q"))
    ends: array[int] = field(default_factory=lambda: array("q"))
    bad_ranges: list[tuple[int, int]] = field(default_factory=list)
    unknown_frames: int = 0
    repaired_stamps: int = 0

    @property
    def bad_bytes(self) -> int:
        """Bytes that belong to no record."""
        return sum(length for _, length in self.bad_ranges)

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, index: int) -> Record:
        stamp = self.stamps[index]
        frame = self.data[self.starts[index] : self.ends[index]]
        return Record(floor_to_grid_us(stamp), stamp % GRID_US, frame)

    def __iter__(self) -> Iterator[Record]:
        for index in range(len(self)):
            yield self[index]


def read_records(path: Path | str) -> TlogContents:
    """Read a log whole; a truncated tail and damage in between are reported, not raised.

    Raises:
        LogError: there is no such file, it cannot be read, it is empty, or it is not a telemetry log.
    """
    data = _read_bytes(Path(path))
    if not data:
        raise LogError(str(path), "the file is empty", "was the recording stopped before anything arrived?")
    contents = scan(data)
    good_bytes = sum(contents.ends) - sum(contents.starts)
    if good_bytes * _LEAST_GOOD_PART < len(data):
        raise LogError(
            str(path),
            f"not a telemetry log: no MAVLink frames in {len(data)} bytes",
            "a .tlog, as written by mavquad, MAVProxy, Mission Planner or QGroundControl, is wanted",
        )
    return contents


def scan(data: bytes) -> TlogContents:
    """Find every good frame of a log held in memory."""
    contents = TlogContents(data)
    at = 0
    while at < len(data):
        start = at + STAMP_LENGTH
        if end := good_frame_end(data, start):
            stamp = int.from_bytes(data[at:start], "big")
            _add(contents, stamp if stamp < _LATEST_US else _NO_STAMP, start, end)
        elif end := _unknown_record_end(data, at):
            contents.unknown_frames += 1
        else:
            end = _resynchronise(contents, at)
        at = end
    _fill_leading_stamps(contents)
    return contents


def good_frame_end(data: bytes, start: int) -> int:
    """Offset behind the whole frame with a right CRC that starts at `start`; 0 if there is none."""
    if start >= len(data):
        return 0
    length = frame_length(data, start)
    end = start + length
    if length <= 0 or end > len(data) or not is_valid(data[start:end]):
        return 0
    return end


def _resynchronise(contents: TlogContents, at: int) -> int:
    """Take the next good frame that starts at or behind `at`, note the damage before it; return its end."""
    data = contents.data
    for marker in _MARKER.finditer(data, at):
        start = marker.start()
        if end := good_frame_end(data, start):
            break
    else:
        contents.bad_ranges.append((at, len(data) - at))
        return len(data)
    stamp = _stamp_before(contents, at, start)
    damage_end = start if stamp == _NO_STAMP else start - STAMP_LENGTH
    if damage_end > at:
        contents.bad_ranges.append((at, damage_end - at))
    _add(contents, stamp, start, end)
    return end


def _stamp_before(contents: TlogContents, at: int, start: int) -> int:
    """The stamp right before a frame found behind damage that begins at `at`, if it can be one."""
    if start - STAMP_LENGTH < at:
        return _NO_STAMP
    stamp = int.from_bytes(contents.data[start - STAMP_LENGTH : start], "big")
    return stamp if _is_plausible(stamp, _last_stamp(contents)) else _NO_STAMP


def _is_plausible(stamp: int, last: int) -> bool:
    return stamp < _LATEST_US and (last == _NO_STAMP or abs(stamp - last) < _LARGEST_JUMP_US)


def _last_stamp(contents: TlogContents) -> int:
    return contents.stamps[-1] if contents.stamps else _NO_STAMP


def _add(contents: TlogContents, stamp: int, start: int, end: int) -> None:
    if stamp == _NO_STAMP:
        contents.repaired_stamps += 1
        last = _last_stamp(contents)
        stamp = last if last == _NO_STAMP else floor_to_grid_us(last)
    contents.stamps.append(stamp)
    contents.starts.append(start)
    contents.ends.append(end)


def _fill_leading_stamps(contents: TlogContents) -> None:
    """Frames before the first surviving stamp get that one; 0 where no stamp survived at all."""
    known = next((index for index, stamp in enumerate(contents.stamps) if stamp != _NO_STAMP), None)
    first_us = 0 if known is None else floor_to_grid_us(contents.stamps[known])
    for index in range(len(contents) if known is None else known):
        contents.stamps[index] = first_us


def _unknown_record_end(data: bytes, at: int) -> int:
    """Offset behind the record of an unknown message at `at`, if it and the record behind it look intact; else 0."""
    start = at + STAMP_LENGTH
    length = frame_length(data, start) if start < len(data) else -1
    end = start + length
    if length <= 0 or end > len(data) or message_id(data[start:end]) in mavlink.mavlink_map:
        return 0
    stamp = int.from_bytes(data[at:start], "big")
    if stamp >= _LATEST_US or not _record_may_start(data, end, stamp):
        return 0
    inner = (marker.start() for marker in _MARKER.finditer(data, start + 1, end))
    return 0 if any(good_frame_end(data, position) for position in inner) else end


def _record_may_start(data: bytes, at: int, last: int) -> bool:
    """Whether the file ends at `at`, or a plausible stamp and a marker stand there."""
    start = at + STAMP_LENGTH
    if at == len(data):
        return True
    if start >= len(data) or not _MARKER.match(data, start):
        return False
    return _is_plausible(int.from_bytes(data[at:start], "big"), last)


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise LogError(str(path), "no such file") from None
    except IsADirectoryError:
        hint = f"did you mean {path / 'flight.tlog'}?" if (path / "flight.tlog").exists() else "name a .tlog file"
        raise LogError(str(path), "is a folder, not a file", hint) from None
    except PermissionError:
        raise LogError(str(path), "no permission to read it", f"chmod u+r {path}") from None
    except OSError as error:
        raise LogError(str(path), error.strerror or str(error)) from None
