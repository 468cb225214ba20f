"""Signatures of MAVLink 2 (mavlink.io, Message Signing). No clock: the time is an argument.

    signature = link id (1) | timestamp (6) | first 6 bytes of sha256(key + frame + link id + timestamp)

A timestamp counts 10 us since 2015-01-01 and grows with every frame of one stream (link id, system, component): one that
does not is a replay. The first frame of a stream may be up to a minute behind our own timestamp.
"""

from __future__ import annotations

import hashlib
import hmac
from typing import Literal

from mavquad.protocol.codec import frame_source, is_signed

Fault = Literal["unsigned", "wrong signature", "old timestamp"]
"""Why a frame does not count as signed."""
Streams = dict[tuple[int, int, int], int]
"""The last timestamp of every stream that was heard; one for all the links of a vehicle."""

KEY_LENGTH = 32
EPOCH_US = 1_420_070_400_000_000
"""2015-01-01 in Unix us."""
_TICK_US = 10
_NEW_STREAM_TICKS = 6_000_000
_SIGNED_PART, _DIGEST = 7, 6
"""Bytes of a signature: link id and timestamp, and the digest of all before it."""


def timestamp_at(now_us: int) -> int:
    """The timestamp of a moment in Unix us; 0 before 2015."""
    return max(0, (now_us - EPOCH_US) // _TICK_US)


def key_of_passphrase(passphrase: str) -> bytes:
    """The key that ground stations (MAVProxy, QGroundControl, Mission Planner) make of a passphrase."""
    return hashlib.sha256(passphrase.encode()).digest()


def key_of_hex(text: str) -> bytes:
    """The key that is written as 64 hexadecimal digits.

    Raises:
        ValueError: it is not.
    """
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != KEY_LENGTH:
        raise ValueError(f"a key is {2 * KEY_LENGTH} hexadecimal digits")
    return key


class Signing:
    """One end of one link: signs what goes out, checks what comes in.

    Attributes:
        timestamp: the newest, of what was sent here or heard.
    """

    def __init__(self, key: bytes, link_id: int, streams: Streams | None = None, timestamp: int = 0) -> None:
        self._key = key
        self._link_id = bytes((link_id,))
        self._streams: Streams = {} if streams is None else streams
        self.timestamp = timestamp

    def sign(self, frame: bytes, now_us: int) -> bytes:
        """A frame that was packed to be signed, with its signature."""
        self.timestamp = max(self.timestamp + 1, timestamp_at(now_us))
        signed = frame + self._link_id + self.timestamp.to_bytes(6, "little")
        return signed + self._digest(signed)

    def check(self, frame: bytes, now_us: int) -> Fault | None:
        """What is wrong with the signature of a whole frame, None if nothing is. A good one is remembered."""
        if not is_signed(frame):
            return "unsigned"
        signed, digest = frame[:-_DIGEST], frame[-_DIGEST:]
        if not hmac.compare_digest(self._digest(signed), digest):
            return "wrong signature"
        link_id, timestamp = signed[-_SIGNED_PART], int.from_bytes(signed[1 - _SIGNED_PART :], "little")
        stream = (link_id, *frame_source(frame))
        self.timestamp = max(self.timestamp, timestamp_at(now_us))
        if timestamp <= self._streams.get(stream, self.timestamp - _NEW_STREAM_TICKS - 1):
            return "old timestamp"
        self._streams[stream] = timestamp
        self.timestamp = max(self.timestamp, timestamp)
        return None

    def _digest(self, signed: bytes) -> bytes:
        return hashlib.sha256(self._key + signed).digest()[:_DIGEST]
