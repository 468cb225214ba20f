"""Records of a telemetry log, one by one: what they are, and a writer.

A record is an 8-byte big-endian Unix time in microseconds and one raw MAVLink frame. The two lowest bits of the stamp
carry a link number (pymavlink's `mavlogfile`; MAVProxy writes 3 for what it sends), so stamps are multiples of 4 us.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import BinaryIO

from mavquad.endpoint import GRID_US
from mavquad.errors import InternalError

LINK_INBOUND = 0
LINK_OUTBOUND = 3
STAMP_LENGTH = 8


@dataclass(frozen=True, slots=True)
class Record:
    """One frame of a log; `stamp_us` is Unix time with the link's bits cleared, `link` what they held (0 to 3)."""

    stamp_us: int
    link: int
    frame: bytes

    @property
    def outbound(self) -> bool:
        """Whether the writer of the log sent this frame (rather than received it)."""
        return self.link == LINK_OUTBOUND


def pack_record(stamp_us: int, frame: bytes, outbound: bool) -> bytes:
    """One record as bytes.

    Raises:
        InternalError: the stamp is not on the grid of 4 us (it would not read back as it was).
    """
    if stamp_us % GRID_US:
        raise InternalError(f"a log's stamps are multiples of {GRID_US} us, not {stamp_us}")
    link = LINK_OUTBOUND if outbound else LINK_INBOUND
    return (stamp_us | link).to_bytes(STAMP_LENGTH, "big") + frame


class TlogWriter:
    """Appends records to a binary stream; whoever opened the stream flushes and closes it."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def write(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        """Append one frame that was sent (outbound) or received at `stamp_us`, a multiple of 4."""
        self._stream.write(pack_record(stamp_us, frame, outbound))
