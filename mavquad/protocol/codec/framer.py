"""Whole frames out of what a transport delivers: datagrams, or a byte stream cut anywhere."""

from __future__ import annotations

from mavquad.protocol.codec.frame import (
    MAGIC_V1,
    MAGIC_V2,
    frame_length,
    is_known,
    is_one_frame,
    is_valid,
)
from mavquad.protocol.sequence import SequenceCount


class Framer:
    """Cuts what a transport delivers into whole frames.

    A frame of a known message has the right CRC. One of a message that the dialect does not know cannot be checked: it
    counts as a frame if it is whole, nothing or what may be a frame follows right behind it, and no valid one is inside it.
    Carries a partial frame over to the next chunk, since serial bridges cut frames anywhere; a datagram that itself
    starts with a whole frame discards such a rest.

    Attributes:
        bad_bytes: bytes that belong to no frame.
        bad_chunks: chunks in which such bytes were found.
        unknown: frames of messages that the dialect does not know.
    """

    def __init__(self) -> None:
        self.bad_bytes = 0
        self.bad_chunks = 0
        self.unknown = 0
        self._sequences: dict[bytes, SequenceCount] = {}
        self._rest = b""

    def lost(self, source: tuple[int, int]) -> int:
        """Frames of a sender (system id, component id) that are missing in its sequence numbers."""
        count = self._sequences.get(bytes(source))
        return count.lost if count is not None else 0

    def takes(self, chunk: bytes) -> bool:
        """Take in a chunk that is exactly one valid frame, as a datagram usually is; False: it is for `push`."""
        if self._rest or not is_one_frame(chunk):
            return False
        self._count(chunk)
        return True

    def push(self, chunk: bytes) -> list[bytes]:
        """Take in a datagram or a piece of a stream; return the whole frames that it completes, in order."""
        if self.takes(chunk):
            return [chunk]
        before = self.bad_bytes
        if self._rest and _frame_starts(chunk, 0):
            self.bad_bytes += len(self._rest)
            self._rest = b""
        frames, self._rest = self._cut(self._rest + chunk)
        if self.bad_bytes > before:
            self.bad_chunks += 1
        for frame in frames:
            self._count(frame)
        return frames

    def forget_rest(self) -> None:
        """What comes next does not continue what was there: a partial frame counts as damage."""
        self.bad_bytes += len(self._rest)
        self.bad_chunks += bool(self._rest)
        self._rest = b""

    def _count(self, frame: bytes) -> None:
        # The sequence number, and behind it system and component.
        at = 2 if frame[0] == MAGIC_V1 else 4
        source = frame[at + 1 : at + 3]
        count = self._sequences.get(source)
        if count is None:
            count = self._sequences[source] = SequenceCount()
        count.take(frame[at])

    def _cut(self, buffer: bytes) -> tuple[list[bytes], bytes]:
        frames: list[bytes] = []
        valid = _ValidFrames(buffer)
        at = 0
        while at < len(buffer):
            length = frame_length(buffer, at)
            if length == 0 or length > len(buffer) - at:
                return frames, buffer[at:]
            frame = buffer[at : at + length]
            if length > 0 and (is_valid(frame) or self._is_unknown(frame, at, valid)):
                frames.append(frame)
                at += length
            else:
                self.bad_bytes += 1
                at += 1
        return frames, b""

    def _is_unknown(self, frame: bytes, start: int, valid: _ValidFrames) -> bool:
        end = start + len(frame)
        if is_known(frame) or not valid.may_end_at(end) or valid.any_in(start + 1, end):
            return False
        self.unknown += 1
        return True


class _ValidFrames:
    """Where valid frames start in a buffer. Each offset is looked at once, or a crafted datagram would stall a flight."""

    def __init__(self, buffer: bytes) -> None:
        self._buffer = buffer
        self._found = -1
        self._searched = 0

    def may_end_at(self, at: int) -> bool:
        """Whether the buffer ends there or something that may be a frame begins."""
        return at >= len(self._buffer) or self._buffer[at] in (MAGIC_V1, MAGIC_V2)

    def any_in(self, start: int, end: int) -> bool:
        """Whether one starts in this range; to be asked with growing starts."""
        if self._found >= start:
            return self._found < end
        for at in range(max(start, self._searched), end):
            self._searched = at + 1
            if _frame_starts(self._buffer, at):
                self._found = at
                return True
        return False


def _frame_starts(buffer: bytes, at: int) -> bool:
    if at >= len(buffer):
        return False
    length = frame_length(buffer, at)
    return 0 < length <= len(buffer) - at and is_valid(buffer[at : at + length])
