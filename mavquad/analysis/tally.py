"""One pass over a log's frames: what each sender sent, how often, when it was silent, and its HEARTBEATs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavquad.protocol.codec import mavlink
from mavquad.tlog import Frames, Sender, wire_type

_GAP_US = 2_000_000
_HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT


class Heartbeat(NamedTuple):
    """What a HEARTBEAT says, at `stamp_us` of the log."""

    stamp_us: int
    type: int
    autopilot: int
    base_mode: int
    custom_mode: int

    @property
    def is_armed(self) -> bool:
        """Whether its motors may turn."""
        return bool(self.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


@dataclass(slots=True)
class Tally:
    """Of one sender; stamps are Unix us, messages by their ids."""

    counts: Counter[int] = field(default_factory=Counter)
    first_us: dict[int, int] = field(default_factory=dict)
    last_us: dict[int, int] = field(default_factory=dict)
    heartbeats: list[Heartbeat] = field(default_factory=list)
    gaps_us: list[tuple[int, int]] = field(default_factory=list)
    latest_us: int | None = None

    def note(self, number: int, count: int, first_us: int, last_us: int) -> None:
        """So many messages more."""
        self.counts[number] += count
        self.first_us.setdefault(number, first_us)
        self.last_us[number] = last_us

    def heard(self, stamps_us: NDArray[np.int64]) -> None:
        """Frames that follow in the log."""
        before = stamps_us[0] if self.latest_us is None else self.latest_us
        with_last = np.concatenate(([before], stamps_us))
        for index in np.flatnonzero(np.diff(with_last) >= _GAP_US).tolist():
            self.gaps_us.append((int(with_last[index]), int(with_last[index + 1])))
        self.latest_us = int(stamps_us[-1])


@dataclass(slots=True)
class Tallies:
    """Of all senders, and of the frames whose stamp is before that of the one before."""

    frames: int = 0
    backward_stamps: int = 0
    senders: dict[Sender, Tally] = field(default_factory=dict)
    _latest_us: int | None = None

    def add(self, frames: Frames) -> None:
        """What follows in the log."""
        if not len(frames):
            return
        stamps_us = frames.stamps_us
        before = stamps_us[0] if self._latest_us is None else self._latest_us
        self.backward_stamps += int(np.count_nonzero(np.diff(stamps_us, prepend=before) < 0))
        self._latest_us = int(stamps_us[-1])
        self.frames += len(frames)
        self._add_messages(frames, stamps_us)
        self._add_heartbeats(frames.only(frames.numbers == _HEARTBEAT))

    def _add_messages(self, frames: Frames, stamps_us: NDArray[np.int64]) -> None:
        """Frames in the order of their senders and messages; a stable sort leaves those of one kind in their order."""
        senders = frames.systems.astype(np.int64) << 8 | frames.components
        for sender in np.unique(senders).tolist():
            self._of(sender).heard(stamps_us[senders == sender])
        keys = senders << 24 | frames.numbers
        kinds, firsts, counts = np.unique(keys, return_index=True, return_counts=True)
        lasts = len(keys) - 1 - np.unique(keys[::-1], return_index=True)[1]
        columns = (kinds, counts, stamps_us[firsts], stamps_us[lasts])
        for key, count, first_us, last_us in zip(*(column.tolist() for column in columns), strict=True):
            self._of(key >> 24).note(key & 0xFFFFFF, count, first_us, last_us)

    def _add_heartbeats(self, frames: Frames) -> None:
        senders = frames.systems.astype(np.int64) << 8 | frames.components
        beats = frames.payloads(wire_type("HEARTBEAT"))[["type", "autopilot", "base_mode", "custom_mode"]]
        for sender, stamp_us, beat in zip(senders.tolist(), frames.stamps_us.tolist(), beats.tolist(), strict=True):
            self._of(sender).heartbeats.append(Heartbeat(stamp_us, *beat))

    def _of(self, key: int) -> Tally:
        return self.senders.setdefault((key >> 8, key & 0xFF), Tally())
