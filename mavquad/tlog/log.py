"""The doors of the reader: a log's columns, its records one by one, its messages one by one."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavquad.endpoint import GRID_US
from mavquad.protocol.codec import Message, decode, mavlink
from mavquad.tlog.columns import Table, wire_type
from mavquad.tlog.frames import Frames
from mavquad.tlog.record import Record
from mavquad.tlog.scanner import NO_STAMP, Scanner
from mavquad.tlog.selection import Selection, Sender
from mavquad.tlog.source import not_a_log, pieces

_MOST_HELD = 8  # pieces of a file that are held while no stamp is known


@dataclass(slots=True)
class Reading:
    """One pass over a log's file, in pieces; the attributes tell of what has been passed so far.

    Attributes:
        path: the file.
        size: bytes (of what a gzip holds).
        frames: good frames.
        first_us: earliest stamp, Unix us; 0 without any.
        last_us: latest stamp.
        scanner: knows of the damage.
    """

    path: Path
    size: int = 0
    frames: int = 0
    first_us: int = 0
    last_us: int = 0
    scanner: Scanner = field(default_factory=Scanner)

    def __iter__(self) -> Iterator[Frames]:
        """The good frames, piece by piece.

        Raises:
            LogError: at the start, if it cannot be read; at the end, if it was no log.
        """
        for frames in with_leading_stamps(self._frames()):
            self._note(frames)
            yield frames

    def _frames(self) -> Iterator[Frames]:
        good_bytes, head = 0, b""
        for data in chain(pieces(self.path), (None,)):
            head = head or data or b""
            self.size += len(data or b"")
            frames = self.scanner.finish() if data is None else self.scanner.push(data)
            good_bytes += int(np.sum(frames.ends - frames.starts))
            if len(frames):
                yield frames
        if error := not_a_log(self.path, self.size, good_bytes, head[:8]):
            raise error

    def _note(self, frames: Frames) -> None:
        self.frames += len(frames)
        stamped_us = frames.stamps_us[frames.stamps > 0]
        if len(stamped_us):
            self.first_us = min(self.first_us or sys.maxsize, int(stamped_us.min()))
            self.last_us = max(self.last_us, int(stamped_us.max()))


def with_leading_stamps(parts: Iterator[Frames]) -> Iterator[Frames]:
    """Frames before the first surviving stamp get that one; 0 where there is none near the beginning of the file."""
    held: list[Frames] = []
    first = NO_STAMP
    for part in parts:
        held.append(part)
        first = int(part.stamps[np.argmax(part.stamps != NO_STAMP)])  # NO_STAMP where all are lost
        if first != NO_STAMP or len(held) == _MOST_HELD:
            break
    leading = 0 if first == NO_STAMP else first & -GRID_US
    for part in chain(held, parts):
        part.stamps[part.stamps == NO_STAMP] = leading
        yield part


@dataclass(frozen=True, slots=True)
class Log:
    """What `read` found. `log["ATTITUDE"]` has the table of each sender of it; `log["ATTITUDE"][1, 1]["roll_rad"]`.

    Attributes:
        path: the file.
        size: its bytes (of what a gzip holds).
        frames: good frames in it, wanted or not.
        unknown_frames: intact records of messages that the dialect does not know; not among the good ones.
        repaired_stamps: good frames whose own stamp was lost.
        bad_ranges: (offset, length) of what belongs to no record, in order.
        first_us: earliest stamp in it, Unix us; 0 without any.
        last_us: latest stamp.
        tables: by the message's name and the sender, in that order.
    """

    path: Path
    size: int
    frames: int
    unknown_frames: int
    repaired_stamps: int
    bad_ranges: tuple[tuple[int, int], ...]
    first_us: int
    last_us: int
    tables: dict[tuple[str, Sender], Table]

    @property
    def bad_bytes(self) -> int:
        """Bytes that belong to no record."""
        return sum(length for _, length in self.bad_ranges)

    @property
    def types(self) -> tuple[str, ...]:
        """Names of the messages that were found."""
        return tuple(dict.fromkeys(name for name, _ in self.tables))

    def __getitem__(self, name: str) -> dict[Sender, Table]:
        """The tables of one message by their sender; none where nobody sent it."""
        return {sender: table for (of, sender), table in self.tables.items() if of == name}


def read(
    path: Path | str,
    types: Iterable[str] | None = None,
    *,
    system: int | None = None,
    component: int | None = None,
    from_us: int | None = None,
    to_us: int | None = None,
) -> Log:
    """Read a log's messages as columns.

    The file is read in pieces; memory holds what is wanted of it. Each frame's CRC is checked. MAVLink 1 and 2, signed
    or not, any number of systems; plain or gzip; with stamps (.tlog) or without (.raw: all stamps are 0). A truncated
    tail and damage in between cost no good frame and are reported as `bad_ranges`. A frame whose stamp was lost has the
    one before.

        log = tlog.read("flight.tlog", ("ATTITUDE", "LOCAL_POSITION_NED"), system=1)
        attitude = log["ATTITUDE"][1, 1]
        attitude.stamps_us, attitude["roll_rad"], attitude["time_boot_ms"]

    Args:
        path: the file.
        types: names of messages; None: every message that there is.
        system: system id of the sender; None: all.
        component: component id of the sender; None: all.
        from_us: earliest stamp, Unix us.
        to_us: latest stamp, Unix us.

    Raises:
        LogError: there is no such file, it cannot be read, it is empty, or it is not a telemetry log.
        InputError: MAVLink has no message of that name.
    """
    selection = Selection.of(types, system, component, from_us, to_us)
    reading = Reading(Path(path))
    parts: dict[int, list[_Part]] = {}
    for frames in reading:
        wanted = selection.among(frames)
        for number in np.unique(wanted.numbers).tolist():
            parts.setdefault(number, []).append(_part(wanted.only(wanted.numbers == number), number))
    return Log(
        path=reading.path,
        size=reading.size,
        frames=reading.frames,
        unknown_frames=reading.scanner.unknown_frames,
        repaired_stamps=reading.scanner.repaired_stamps,
        bad_ranges=tuple(reading.scanner.bad_ranges),
        first_us=reading.first_us,
        last_us=reading.last_us,
        tables={key: table for number in sorted(parts) for key, table in _tables(number, parts[number])},
    )


def records(path: Path | str, **selection: Any) -> Iterator[Record]:
    """The records of a log in the order of the file, in bounded memory; arguments and errors as of `read`."""
    wanted = Selection.of(**selection)
    for frames in Reading(Path(path)):
        yield from wanted.among(frames).records()


def messages(path: Path | str, **selection: Any) -> Iterator[tuple[Record, Message]]:
    """Records, each with its message as pymavlink's object; else as `records`."""
    for record in records(path, **selection):
        yield record, decode(record.frame)


class _Part(NamedTuple):
    """Messages of one kind in one piece of the file, one row each."""

    senders: NDArray[Any]
    stamps: NDArray[np.int64]
    offsets: NDArray[np.int64]
    payloads: NDArray[Any]


def _part(frames: Frames, number: int) -> _Part:
    senders = frames.systems.astype(np.int32) << 8 | frames.components
    return _Part(senders, frames.stamps, frames.starts, frames.payloads(wire_type(mavlink.mavlink_map[number].msgname)))


def _tables(number: int, parts: list[_Part]) -> Iterator[tuple[tuple[str, Sender], Table]]:
    name: str = mavlink.mavlink_map[number].msgname
    whole = _Part(*map(np.concatenate, zip(*parts, strict=True)))
    for key in np.unique(whole.senders).tolist():
        _, stamps, offsets, payloads = (array[whole.senders == key] for array in whole)
        sender = divmod(key, 256)
        links = (stamps & (GRID_US - 1)).astype(np.int8)
        yield (name, sender), Table(name, sender, stamps & -GRID_US, links, offsets, payloads)
