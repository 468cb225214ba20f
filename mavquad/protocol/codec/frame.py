"""One frame, from outside: its length, its header's fields, its checksum.

version 1    FE len seq system component id          payload crc(2)
version 2    FD len incompat compat seq system component id(3)  payload crc(2) [signature(13)]
"""

from __future__ import annotations

from fastcrc.crc16 import mcrf4xx

from mavquad.protocol.codec.dialect import pymavlink

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
HEADER_V1 = 6
HEADER_V2 = 10
LEAST_V1, LEAST_V2 = HEADER_V1 + 2, HEADER_V2 + 2
"""Length of a frame without a payload."""
SIGNED = 0x01
"""The one incompatibility flag that exists: a signature follows the CRC."""
SIGNATURE_LENGTH = 13
_CRC_EXTRA: dict[int, bytes] = {msg_id: bytes((cls.crc_extra,)) for msg_id, cls in pymavlink.mavlink_map.items()}


def frame_length(buffer: bytes | bytearray, at: int) -> int:
    """Length of the frame that would start at `at`; 0 if more bytes are needed to tell, -1 if none starts there."""
    magic = buffer[at]
    available = len(buffer) - at
    if magic == MAGIC_V2:
        if available < 3:
            return 0
        flags = buffer[at + 2]
        if flags & ~SIGNED:
            return -1
        return buffer[at + 1] + 12 + (SIGNATURE_LENGTH if flags & SIGNED else 0)
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


def frame_version(frame: bytes) -> int:
    """1 or 2: the version of MAVLink that a whole frame is of."""
    return 1 if frame[0] == MAGIC_V1 else 2


def is_signed(frame: bytes) -> bool:
    """Whether a whole frame ends in a signature; it is not checked here."""
    return frame[0] == MAGIC_V2 and bool(frame[2] & SIGNED)


def is_valid(frame: bytes) -> bool:
    """Whether a whole frame is of a known message and has the right CRC (X.25 with the message's CRC_EXTRA)."""
    if frame[0] == MAGIC_V2:
        end = HEADER_V2 + frame[1]
        crc_extra = _CRC_EXTRA.get(frame[7] | frame[8] << 8 | frame[9] << 16)
    else:
        end = HEADER_V1 + frame[1]
        crc_extra = _CRC_EXTRA.get(frame[5])
    if crc_extra is None:
        return False
    return bool(mcrf4xx(frame[1:end] + crc_extra) == frame[end] | frame[end + 1] << 8)


def is_one_frame(data: bytes) -> bool:
    """Whether these bytes are exactly one valid frame: what a datagram usually is."""
    length = len(data)
    if length < LEAST_V1:
        return False
    if data[0] == MAGIC_V2:
        flags, end = data[2], HEADER_V2 + data[1]
        if flags > SIGNED or length != end + (2 + SIGNATURE_LENGTH if flags else 2):
            return False
        crc_extra = _CRC_EXTRA.get(data[7] | data[8] << 8 | data[9] << 16)
    elif data[0] == MAGIC_V1 and length == data[1] + LEAST_V1:
        end = length - 2
        crc_extra = _CRC_EXTRA.get(data[5])
    else:
        return False
    return crc_extra is not None and mcrf4xx(data[1:end] + crc_extra) == data[end] | data[end + 1] << 8


def is_known(frame: bytes | bytearray) -> bool:
    """Whether a whole frame is of a message of the dialect, so that its CRC can be checked."""
    return message_id(frame) in _CRC_EXTRA
