"""The good frames of a stretch of a log, as arrays: where each stands, whose it is, what it is, when it came."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavquad.endpoint import GRID_US
from mavquad.protocol.codec import MAGIC_V2
from mavquad.tlog.candidates import rows
from mavquad.tlog.record import Record

_LONGEST_PAYLOAD = 255


@dataclass(frozen=True, slots=True)
class Frames:
    """Good frames in the order of the file; every array has one entry a frame.

    Attributes:
        buffer: bytes of the file that hold them, and some more.
        base: where in the file the buffer begins.
        starts: where in the file each frame begins.
        ends: where in the file each frame is over.
        numbers: message ids.
        stamps: as recorded, the link's bits included (Unix us); -1 where no stamp survived so far.
    """

    buffer: NDArray[np.uint8]
    base: int
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    numbers: NDArray[np.int32]
    stamps: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.starts)

    @property
    def stamps_us(self) -> NDArray[np.int64]:
        """Unix time of each frame, us, with the link's bits cleared."""
        return self.stamps & -GRID_US

    @property
    def links(self) -> NDArray[np.int64]:
        """The link that each frame came or went by, 0 to 3; 3 is what the writer of the log sent."""
        return self.stamps & (GRID_US - 1)

    @property
    def is_v2(self) -> NDArray[np.bool_]:
        """Whether each frame is of MAVLink 2."""
        return np.equal(self._byte(0), MAGIC_V2)

    @property
    def systems(self) -> NDArray[np.uint8]:
        """System id of each frame's sender."""
        return self._byte(np.where(self.is_v2, 5, 3))

    @property
    def components(self) -> NDArray[np.uint8]:
        """Component id of each frame's sender."""
        return self._byte(np.where(self.is_v2, 6, 4))

    def _byte(self, offsets: Any) -> NDArray[np.uint8]:
        found: NDArray[np.uint8] = self.buffer[self.starts - self.base + offsets]
        return found

    def only(self, wanted: NDArray[Any]) -> Frames:
        """Those of these indices, or where this mask is true."""
        arrays = [getattr(self, field.name)[wanted] for field in fields(self)[2:]]
        return Frames(self.buffer, self.base, *arrays)

    def payloads(self, kind: np.dtype[Any]) -> NDArray[Any]:
        """The payload of each frame as this kind of record; what is not on the wire is zero."""
        heads = np.where(self.is_v2, 10, 6)
        found = rows(self.buffer, kind, self.starts - self.base + heads)
        lengths = self._byte(1)
        short = np.flatnonzero(lengths < kind.itemsize)
        if len(short):
            raw = found.view(np.uint8).reshape(-1, kind.itemsize)
            raw[short] *= np.arange(kind.itemsize) < lengths[short, None]
        return found

    def records(self) -> Iterator[Record]:
        """One by one."""
        data = self.buffer.tobytes()
        spans = zip((self.starts - self.base).tolist(), (self.ends - self.base).tolist(), strict=True)
        stamps = zip(self.stamps_us.tolist(), self.links.tolist(), strict=True)
        for (start, end), (stamp_us, link) in zip(spans, stamps, strict=True):
            yield Record(stamp_us, link, data[start:end])
