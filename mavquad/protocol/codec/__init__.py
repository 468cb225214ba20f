"""Bytes to MAVLink messages and back. The only room that imports pymavlink.

`Framer` cuts a byte stream (or datagrams) into whole frames whose CRC is right and resynchronises on anything else;
`decode` turns one frame into pymavlink's message object; `Encoder` packs messages for one sender. The work is done by
struct and by code written out for each kind of message (`layout`), with the same bytes and values as pymavlink's own.
"""

from mavquad.protocol.codec.dialect import Message
from mavquad.protocol.codec.frame import (
    MAGIC_V1,
    MAGIC_V2,
    frame_length,
    frame_sequence,
    frame_source,
    frame_version,
    is_known,
    is_signed,
    is_valid,
    message_id,
)
from mavquad.protocol.codec.framer import Framer
from mavquad.protocol.codec.layout import mavlink
from mavquad.protocol.codec.messages import Encoder, decode

__all__ = [
    "MAGIC_V1",
    "MAGIC_V2",
    "Encoder",
    "Framer",
    "Message",
    "decode",
    "frame_length",
    "frame_sequence",
    "frame_source",
    "frame_version",
    "is_known",
    "is_signed",
    "is_valid",
    "mavlink",
    "message_id",
]
