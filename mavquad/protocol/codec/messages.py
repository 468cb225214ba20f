"""Messages out of frames, and into frames."""

from __future__ import annotations

import struct

from fastcrc.crc16 import mcrf4xx

from mavquad.errors import InternalError
from mavquad.protocol.codec.dialect import Message, pymavlink
from mavquad.protocol.codec.frame import (
    HEADER_V1,
    HEADER_V2,
    LEAST_V1,
    LEAST_V2,
    MAGIC_V1,
    MAGIC_V2,
    SIGNATURE_LENGTH,
    SIGNED,
)
from mavquad.protocol.codec.layout import BY_KIND, BY_NUMBER

_V1 = struct.Struct("<BBBBB")
_V2 = struct.Struct("<BBBBBBHB")
_START_V1, _START_V2 = bytes((MAGIC_V1,)), bytes((MAGIC_V2,))
_CRC = struct.Struct("<H")
_LAST_ID_V1 = 255


def decode(frame: bytes) -> Message:
    """The message in one whole, valid frame (as `Framer` hands out); its CRC and signature are not looked at again.

    Raises:
        InternalError: the frame is not whole; a caller must not pass one on.
    """
    length = len(frame)
    if length >= LEAST_V2 and frame[0] == MAGIC_V2 and frame[2] <= SIGNED:
        at, number, size = HEADER_V2, frame[7] | frame[8] << 8 | frame[9] << 16, frame[1]
        is_whole = length == size + (LEAST_V2 + SIGNATURE_LENGTH if frame[2] else LEAST_V2)
    else:
        at, number, size = HEADER_V1, frame[5] if length > HEADER_V1 else 0, frame[1] if length > 1 else 0
        is_whole = length == size + LEAST_V1 and frame[0] == MAGIC_V1
    if not is_whole:
        raise InternalError("decode was given an invalid frame: it is not whole")
    layout = BY_NUMBER[number]
    if layout is None:
        return pymavlink.MAVLink_unknown(number, bytearray(frame))
    if size >= layout.size:
        return layout.unpack(frame, frame, at)
    # Zeros at the end of a payload are not sent.
    return layout.unpack(frame, frame[at : at + size].ljust(layout.size, b"\0"), 0)


class Encoder:
    """Packs messages of one sender, with its running sequence number.

    Attributes:
        version: of MAVLink, 1 or 2.
        sequence: the number of the next frame, 0 to 255.
    """

    def __init__(self, system_id: int, component_id: int, version: int = 2) -> None:
        self.version = version
        self._system_id, self._component_id = system_id, component_id
        self.sequence = 0

    def encode(self, message: Message, signed: bool = False) -> bytes:
        """The message as one frame. Version 2: zeros at the end of the payload are cut, but for the first byte.
        Version 1: extension fields are left out.

        Args:
            message: what to pack.
            signed: whether a signature will be put behind it; version 2.

        Raises:
            InternalError: version 1 has no such message.
        """
        number, crc_extra, _, base_size, pack, _, _ = BY_KIND[type(message)]
        payload: bytes = pack(message)
        sequence, system_id, component_id = self.sequence, self._system_id, self._component_id
        if self.version == 1:
            if number > _LAST_ID_V1:
                raise InternalError(f"MAVLink 1 has no message {number}")
            payload, start = payload[:base_size], _START_V1
            header = _V1.pack(len(payload), sequence, system_id, component_id, number)
        else:
            payload, start, flags = payload.rstrip(b"\0") or payload[:1], _START_V2, SIGNED if signed else 0
            header = _V2.pack(len(payload), flags, 0, sequence, system_id, component_id, number & 0xFFFF, number >> 16)
        self.sequence = (sequence + 1) % 256
        body = header + payload
        return start + body + _CRC.pack(mcrf4xx(body + crc_extra))

    def can_say(self, message: Message) -> bool:
        """Whether this version has the message: version 1 ends at id 255."""
        return self.version != 1 or BY_KIND[type(message)].number <= _LAST_ID_V1
