"""The reader's rules once more, byte by byte and slow, to hold the fast reader against."""

from __future__ import annotations

from mavquad.protocol.codec import frame_length, is_known, is_valid

NO_STAMP = -1
DAY_US = 86_400_000_000
YEAR_2100_US = 4_102_444_800_000_000


class Oracle:
    """Attributes as those of `Scanner`; `found` has (stamp, start, end) of each good frame."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.found: list[tuple[int, int, int]] = []
        self.bad_ranges: list[tuple[int, int]] = []
        self.unknown_frames = self.repaired_stamps = 0
        at = 0
        while at < len(data):
            at = self.next_record(at)

    def next_record(self, at: int) -> int:
        if end := self.good_end(at + 8):
            stamp = self.stamp(at)
            return self.take(stamp if stamp < YEAR_2100_US else NO_STAMP, at + 8, end)
        if end := self.unknown_record_end(at):
            self.unknown_frames += 1
            return end
        start = next((start for start in range(at, len(self.data)) if self.good_end(start)), len(self.data))
        if start == len(self.data):
            self.bad_ranges.append((at, start - at))
            return start
        stamp = self.stamp(start - 8) if start - 8 >= at else NO_STAMP
        if not self.is_plausible(stamp, self.last()):
            stamp = NO_STAMP
        damage_end = start if stamp == NO_STAMP else start - 8
        if damage_end > at:
            self.bad_ranges.append((at, damage_end - at))
        return self.take(stamp, start, self.good_end(start))

    def take(self, stamp: int, start: int, end: int) -> int:
        if stamp == NO_STAMP:
            self.repaired_stamps += 1
            stamp = self.last() if self.last() == NO_STAMP else self.last() & -4
        self.found.append((stamp, start, end))
        return end

    def last(self) -> int:
        return self.found[-1][0] if self.found else NO_STAMP

    def stamp(self, at: int) -> int:
        return int.from_bytes(self.data[at : at + 8], "big")

    def whole_end(self, start: int) -> int:
        length = frame_length(self.data, start) if start < len(self.data) else 0
        return start + length if 8 <= length <= len(self.data) - start else 0

    def good_end(self, start: int) -> int:
        end = self.whole_end(start)
        return end if end and is_valid(self.data[start:end]) else 0

    def unknown_end(self, start: int) -> int:
        end = self.whole_end(start)
        if not end or is_known(self.data[start:end]) or any(self.good_end(at) for at in range(start, end)):
            return 0
        return end

    def unknown_record_end(self, at: int) -> int:
        end, stamp = self.unknown_end(at + 8), self.stamp(at)
        follows = end == len(self.data) or (self.is_plausible(self.stamp(end), stamp) and self.is_marker(end + 8))
        if end and stamp < YEAR_2100_US and follows and not any(self.good_end(inside) for inside in range(at, end)):
            return end
        end = self.unknown_end(at) if self.last() == NO_STAMP else 0
        return end if end and (end == len(self.data) or self.is_marker(end)) else 0

    def is_marker(self, at: int) -> bool:
        return self.data[at : at + 1] in (b"\xfd", b"\xfe")

    def is_plausible(self, stamp: int, last: int) -> bool:
        return 0 <= stamp < YEAR_2100_US and (last == NO_STAMP or abs(stamp - last) < DAY_US)
