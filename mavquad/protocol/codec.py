"""Bytes to MAVLink messages and back. The only importer of pymavlink.

`Framer` cuts a byte stream (or datagrams) into whole frames whose CRC is right and resynchronises on anything else;
`decode` turns one frame into pymavlink's message object; `Encoder` packs messages for one sender.
"""

from __future__ import annotations

from typing import Any

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mavquad.errors import InternalError
from mavquad.protocol.sequence import SequenceCount

__all__ = ["Encoder", "Framer", "Message", "decode", "frame_length", "frame_source", "is_valid", "mavlink"]

Message = Any
"""A pymavlink message object, e.g. `mavlink.MAVLink_attitude_message`."""

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
_SIGNED = 0x01
_SIGNATURE_LENGTH = 13
_CRC_EXTRA: dict[int, int] = {msg_id: cls.crc_extra for msg_id, cls in mavlink.mavlink_map.items()}
_decoder = mavlink.MAVLink(None)


def frame_length(buffer: bytes | bytearray, at: int) -> int:
    """Length of the frame that would start at `at`; 0 if more bytes are needed to tell, -1 if none starts there."""
    magic = buffer[at]
    available = len(buffer) - at
    if magic == MAGIC_V2:
        if available < 3:
            return 0
        flags = buffer[at + 2]
        if flags & ~_SIGNED:
            return -1
        return buffer[at + 1] + 12 + (_SIGNATURE_LENGTH if flags & _SIGNED else 0)
    if magic == MAGIC_V1:
        return buffer[at + 1] + 8 if available >= 2 else 0
    return -1


def message_id(frame: bytes | bytearray) -> int:
    """The message id of a whole frame."""
    return frame[5] if frame[0] == MAGIC_V1 else frame[7] | frame[8] << 8 | frame[9] << 16


def frame_source(frame: bytes) -> tuple[int, int]:
    """(system id, component id) of the sender of a whole frame."""
    return (frame[3], frame[4]) if frame[0] == MAGIC_V1 else (frame[5], frame[6])


def frame_sequence(frame: bytes) -> int:
    """The sequence number of a whole frame, 0 to 255."""
    return frame[2] if frame[0] == MAGIC_V1 else frame[4]


def is_valid(frame: bytes) -> bool:
    """Whether a whole frame is of a known message and has the right CRC (X.25 with the message's CRC_EXTRA)."""
    crc_extra = _CRC_EXTRA.get(message_id(frame))
    if crc_extra is None:
        return False
    end = 8 + frame[1] + 2 if frame[0] == MAGIC_V2 else 6 + frame[1]
    crc = mcrf4xx(bytes(frame[1:end]) + bytes((crc_extra,)))
    return bool(frame[end] == crc & 0xFF and frame[end + 1] == crc >> 8)


def is_known(frame: bytes | bytearray) -> bool:
    """Whether a whole frame is of a message of the dialect, so that its CRC can be checked."""
    return message_id(frame) in _CRC_EXTRA


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
        self._sequences: dict[tuple[int, int], SequenceCount] = {}
        self._rest = b""

    def lost(self, source: tuple[int, int]) -> int:
        """Frames of a sender (system id, component id) that are missing in its sequence numbers."""
        return self._sequences[source].lost if source in self._sequences else 0

    def push(self, chunk: bytes) -> list[bytes]:
        """Take in a datagram or a piece of a stream; return the whole frames that it completes, in order."""
        before = self.bad_bytes
        if self._rest and _frame_starts(chunk, 0):
            self.bad_bytes += len(self._rest)
            self._rest = b""
        frames, self._rest = self._cut(self._rest + chunk)
        if self.bad_bytes > before:
            self.bad_chunks += 1
        for frame in frames:
            self._sequences.setdefault(frame_source(frame), SequenceCount()).take(frame_sequence(frame))
        return frames

    def forget_rest(self) -> None:
        """What comes next does not continue what was there: a partial frame counts as damage."""
        self.bad_bytes += len(self._rest)
        self.bad_chunks += bool(self._rest)
        self._rest = b""

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


def decode(frame: bytes) -> Message:
    """The message in one whole, valid frame (as `Framer` hands out).

    Raises:
        InternalError: the frame is not valid; a caller must not pass one on.
    """
    try:
        return _decoder.decode(bytearray(frame))
    except mavlink.MAVError as error:
        raise InternalError(f"decode was given an invalid frame: {error}") from error


class Encoder:
    """Packs messages of one sender as MAVLink 2, with its running sequence number."""

    def __init__(self, system_id: int, component_id: int) -> None:
        self._mav = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)

    def encode(self, message: Message) -> bytes:
        """The message as one frame; trailing zeros of the payload are cut as MAVLink 2 wants."""
        frame: bytes = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return frame
