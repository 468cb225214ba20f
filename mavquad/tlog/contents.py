"""A whole log in memory, record by record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mavquad.endpoint import GRID_US
from mavquad.tlog.frames import Frames
from mavquad.tlog.log import with_leading_stamps
from mavquad.tlog.record import Record
from mavquad.tlog.scanner import PADDING, Scanner
from mavquad.tlog.selection import Selection
from mavquad.tlog.source import PIECE, not_a_log, pieces


@dataclass(slots=True)
class TlogContents:
    """A log in memory: its bytes and where the good frames are; iterate over it, or index it, for `Record`s.

    Attributes:
        data: the file's bytes.
        frames: the good ones, as arrays.
        bad_ranges: (offset, length) of what belongs to no record, in order.
        unknown_frames: intact records of messages that the dialect does not know; not among the good ones.
        repaired_stamps: good frames whose own stamp was lost and is the previous one's.
    """

    data: bytes
    frames: Frames
    bad_ranges: list[tuple[int, int]]
    unknown_frames: int
    repaired_stamps: int

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Stamp of each good frame as recorded, link bits included, in the order of the file (us)."""
        return self.frames.stamps

    @property
    def starts(self) -> NDArray[np.int64]:
        """Offset of each good frame's first byte."""
        return self.frames.starts

    @property
    def ends(self) -> NDArray[np.int64]:
        """Offset behind each good frame."""
        return self.frames.ends

    def only(self, selection: Selection) -> TlogContents:
        """The same with those good frames that are wanted."""
        return replace(self, frames=selection.among(self.frames))

    @property
    def bad_bytes(self) -> int:
        """Bytes that belong to no record."""
        return sum(length for _, length in self.bad_ranges)

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, index: int) -> Record:
        stamp = int(self.stamps[index])
        return Record(stamp & -GRID_US, stamp % GRID_US, self.data[self.starts[index] : self.ends[index]])

    def __iter__(self) -> Iterator[Record]:
        data = self.data
        for stamp, start, end in zip(self.stamps.tolist(), self.starts.tolist(), self.ends.tolist(), strict=True):
            yield Record(stamp & -GRID_US, stamp % GRID_US, data[start:end])


def read_records(path: Path | str) -> TlogContents:
    """Read a log whole, plain or gzip; a truncated tail and damage in between are reported, not raised.

    Raises:
        LogError: there is no such file, it cannot be read, it is empty, or it is not a telemetry log.
    """
    data = b"".join(pieces(Path(path)))
    contents = scan(data)
    if error := not_a_log(Path(path), len(data), int(np.sum(contents.ends - contents.starts)), data[:8]):
        raise error
    return contents


def scan(data: bytes) -> TlogContents:
    """Find every good frame of a log held in memory."""
    scanner = Scanner()
    nothing = Scanner().finish()
    parts = [*with_leading_stamps(part for part in _found(scanner, data) if len(part)), nothing]
    starts, ends, numbers, stamps = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("starts", "ends", "numbers", "stamps")
    )
    buffer = np.frombuffer(data + PADDING, np.uint8)
    frames = Frames(buffer, 0, starts, ends, numbers, stamps)
    return TlogContents(data, frames, scanner.bad_ranges, scanner.unknown_frames, scanner.repaired_stamps)


def _found(scanner: Scanner, data: bytes) -> Iterator[Frames]:
    for at in range(0, len(data), PIECE):
        yield scanner.push(data[at : at + PIECE])
    yield scanner.finish()
