"""From bytes to good frames: resynchronises on CRC and never loses a good frame, in bounded memory.

A log is record behind record. `candidates` finds every frame with a right CRC, wherever it stands; here those that do
not overlap are taken, the stamp before each is read, and what lies between them is sorted out: an intact record of a
message that the dialect does not know is passed over (its CRC cannot be checked), all else is damage.

What is found does not depend on how the bytes are cut into pieces: what the next bytes might still change is kept for
later. That is never much more than one record, however long the damage is.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mavquad.endpoint import GRID_US
from mavquad.protocol.codec import MAGIC_V1, MAGIC_V2, frame_length, is_known
from mavquad.tlog.candidates import LONGEST_FRAME, Candidates, find_frames, rows
from mavquad.tlog.frames import Frames
from mavquad.tlog.record import STAMP_LENGTH

NO_STAMP = -1
_LATEST_US = 4_102_444_800_000_000  # the year 2100
_LARGEST_JUMP_US = 86_400_000_000  # a day: what a stamp found behind damage may differ from the last good one
_REACH = STAMP_LENGTH + LONGEST_FRAME + STAMP_LENGTH + 1  # a record, and the stamp and the marker behind it
_SHORTEST_FRAME = 8
PADDING = bytes(LONGEST_FRAME + STAMP_LENGTH)
"""Behind the bytes that `Frames` are in, so that a payload may be read at full length."""


@dataclass(slots=True)
class Scanner:
    """Takes in a log piece by piece, from its beginning.

    Attributes:
        bad_ranges: (offset, length) of what belongs to no record, in order, as far as it is decided.
        unknown_frames: intact records of messages that the dialect does not know; not among the good ones.
        repaired_stamps: good frames whose own stamp was lost; they get the one before, or -1 where there is none.
    """

    bad_ranges: list[tuple[int, int]] = field(default_factory=list)
    unknown_frames: int = 0
    repaired_stamps: int = 0
    _buffer: bytes = b""
    _base: int = 0
    """Where in the file the buffer begins."""
    _at: int = 0
    """Up to where the file is sorted out: the end of the last record; or where the damage began that is going on."""
    _is_damaged: bool = False
    _last: int = NO_STAMP

    def push(self, data: bytes) -> Frames:
        """Take in what follows in the file; return the good frames that it decides on."""
        return self._advance(data, is_end=False)

    def finish(self) -> Frames:
        """There is no more: the frames that were not decided on, and the rest of the damage."""
        return self._advance(b"", is_end=True)

    def _advance(self, data: bytes, is_end: bool) -> Frames:
        self._buffer += data
        size = len(self._buffer)
        limit = self._base + (size if is_end else max(size - _REACH, 0))
        padded = np.frombuffer(self._buffer + PADDING, np.uint8)
        starts, ends, numbers = self._taken(find_frames(padded, size), limit)
        stamps = self._stamps(padded, starts, ends)
        frames = Frames(padded, self._base, starts, ends, numbers, stamps)
        if len(frames):
            self._at, self._is_damaged = int(ends[-1]), False
        self._pass_over(limit, is_end)
        self._forget(limit)
        return frames

    def _taken(self, found: Candidates, limit: int) -> Candidates:
        """Those up to a limit that do not overlap, by their places in the file."""
        found = Candidates(found.starts + self._base, found.ends + self._base, found.numbers)
        if np.any(found.starts[1:] < found.ends[:-1]):
            found = found.only(_without_overlaps(found.starts.tolist(), found.ends.tolist(), self._at))
        return found.only(found.starts < limit)

    def _stamps(
        self, padded: NDArray[np.uint8], starts: NDArray[np.int64], ends: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """The stamp of each frame. What lies between two frames and is not just a stamp is sorted out, in order."""
        before = np.concatenate(([self._at], ends))[:-1]
        gaps = starts - before
        stamps = rows(padded, np.dtype(">i8"), np.maximum(starts - self._base - STAMP_LENGTH, 0)).astype(np.int64)
        stamps[(gaps != STAMP_LENGTH) | (stamps < 0) | (stamps >= _LATEST_US)] = NO_STAMP
        latest = _latest_stamped(stamps)
        found = -1
        for index in np.flatnonzero((gaps != STAMP_LENGTH) & (gaps != 0)).tolist():
            found = max(found, int(latest[index - 1]) if index else -1)
            last = int(stamps[found]) if found >= 0 else self._last
            stamps[index] = self._sort_out(int(before[index]), int(starts[index]), last)
            if stamps[index] != NO_STAMP:
                found = index
            self._is_damaged = False
        return self._filled(stamps)

    def _filled(self, stamps: NDArray[np.int64]) -> NDArray[np.int64]:
        """With the one before where a stamp was lost, without its link's bits."""
        lost = stamps == NO_STAMP
        self.repaired_stamps += int(np.count_nonzero(lost))
        with_last = np.concatenate(([self._last], stamps))
        filled = with_last[1 + _latest_stamped(stamps)]
        filled[lost & (filled != NO_STAMP)] &= -GRID_US
        self._last = int(filled[-1]) if len(filled) else self._last
        return filled

    def _sort_out(self, at: int, start: int, last: int) -> int:
        """Note what lies between `at` and a good frame at `start`; return the frame's stamp.

        Args:
            at: where the record before is over, or the damage that is going on began.
            start: where the good frame begins.
            last: the last good stamp.
        """
        while not self._is_damaged and 0 < (end := self._unknown_end(at, last)) <= start:
            self.unknown_frames += 1
            at = end
        if start - at < STAMP_LENGTH:
            self._note_damage(at, start)
            return NO_STAMP
        stamp = self._stamp_at(start - STAMP_LENGTH)
        if start - at == STAMP_LENGTH:
            return stamp if stamp < _LATEST_US else NO_STAMP
        is_plausible = _is_plausible(stamp, last)
        self._note_damage(at, start - STAMP_LENGTH if is_plausible else start)
        return stamp if is_plausible else NO_STAMP

    def _pass_over(self, limit: int, is_end: bool) -> None:
        """Sort out what is behind the last good frame, as far as it is sure that no good one begins there."""
        while not self._is_damaged and (self._at < limit if is_end else self._at + STAMP_LENGTH < limit):
            end = self._unknown_end(self._at, self._last)
            if end > limit:
                return
            self._is_damaged = not end
            self.unknown_frames += bool(end)
            self._at = end or self._at
        if is_end:
            self._note_damage(self._at, limit)

    def _forget(self, limit: int) -> None:
        """Keep what is not sorted out; of damage that is going on, what may be the stamp of a frame to come."""
        keep = max(limit - STAMP_LENGTH, self._at) if self._is_damaged else self._at
        self._buffer = self._buffer[keep - self._base :]
        self._base = keep

    def _note_damage(self, at: int, end: int) -> None:
        if end > at:
            self.bad_ranges.append((at, end - at))

    def _stamp_at(self, at: int) -> int:
        return int.from_bytes(self._buffer[at - self._base : at - self._base + STAMP_LENGTH], "big")

    def _unknown_end(self, at: int, last: int) -> int:
        """Where the intact record of an unknown message at `at` is over; 0 if there is none.

        Intact is one whose stamp and length lead to the end of the file or to what looks like the next record. A file
        in which no stamp was seen so far has none: there, a frame that leads to the next one.
        """
        end = self._unknown_frame_end(at + STAMP_LENGTH)
        if end and (stamp := self._stamp_at(at)) < _LATEST_US and self._record_may_start(end, stamp):
            return end
        end = self._unknown_frame_end(at) if last == NO_STAMP else 0
        return end if end and self._frame_may_start(end) else 0

    def _unknown_frame_end(self, start: int) -> int:
        """Where the whole frame of an unknown message that starts here is over; 0 if there is none."""
        at = start - self._base
        if at + _SHORTEST_FRAME > len(self._buffer):
            return 0
        length = frame_length(self._buffer, at)
        if length <= 0 or at + length > len(self._buffer) or is_known(self._buffer[at : at + length]):
            return 0
        return start + length

    def _record_may_start(self, at: int, last: int) -> bool:
        """Whether the file ends at `at`, or a plausible stamp and a marker stand there."""
        is_end = at == self._base + len(self._buffer)
        return is_end or (_is_plausible(self._stamp_at(at), last) and self._frame_may_start(at + STAMP_LENGTH, False))

    def _frame_may_start(self, at: int, or_end: bool = True) -> bool:
        """Whether a marker stands there, or the file ends."""
        following = self._buffer[at - self._base : at - self._base + 1]
        return following[0] in (MAGIC_V1, MAGIC_V2) if following else or_end


def _is_plausible(stamp: int, last: int) -> bool:
    return stamp < _LATEST_US and (last == NO_STAMP or abs(stamp - last) < _LARGEST_JUMP_US)


def _latest_stamped(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of the latest good stamp up to each; -1 where there is none."""
    return np.maximum.accumulate(np.where(stamps == NO_STAMP, -1, np.arange(len(stamps))))


def _without_overlaps(starts: list[int], ends: list[int], at: int) -> list[int]:
    """Indices of those to be taken: the first, then the first behind that; but one right behind a stamp goes before.

    Args:
        starts: of frames that may overlap, in order.
        ends: where each is over.
        at: where the record before them is over.
    """
    known = set(starts)
    taken = []
    for index, (start, end) in enumerate(zip(starts, ends, strict=True)):
        is_in_a_stamp = at <= start < at + STAMP_LENGTH < end and at + STAMP_LENGTH in known
        if start >= at and not is_in_a_stamp:
            taken.append(index)
            at = end
    return taken
