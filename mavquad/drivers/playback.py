"""The pace of a log that is played back: which frames are due, sans-IO, with the time as an argument.

Frames go out at the distances of their stamps, divided by the speed. A frame stamped a little before the one that went
before it (logs of several links are like that) goes out at once. Where the stamps leap, forwards or back (a pause of
minutes, a clock that was set), the leap is played as one second.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import decode, frame_source, mavlink, message_id
from mavquad.tlog import Record

LEAP_US = 10_000_000
"""Stamps further apart than this are a leap."""
LEAP_PLAYED_US = 1_000_000
"""As what a leap, and the end before the next round, is played: of the log's time."""
LATE_MAX_US = 1_000_000
"""A player that was held up for longer goes on from where it was, and does not make up for it."""
MOST_AT_ONCE = 200

Open = Callable[[int], Iterator[Record]]
"""The records from a stamp on, in the order of the log."""


class Playback:
    """Plays a log. Each call has the present time of any one clock, us.

    Attributes:
        speed: log seconds in a second.
        paused: whether time stands still.
        done: whether everything was played.
        frames: how many were handed out.
        bytes: their bytes.
        rounds: how often the end was reached.
        leaps: how many were shortened.
    """

    def __init__(
        self, open_at: Open, first_us: int, last_us: int, now_us: int, *, speed: float = 1.0, loop: bool = False
    ) -> None:
        """Begin to play.

        Args:
            open_at: the log.
            first_us: stamp that it begins at.
            last_us: stamp that it ends at.
            now_us: the time.
            speed: above 0.
            loop: begin anew at the end.
        """
        self._open, self._first_us, self._last_us = open_at, first_us, last_us
        self._loop = loop
        self.speed = speed
        self.paused = False
        self.done = False
        self.frames = self.bytes = self.rounds = self.leaps = 0
        self._paused_us = 0
        self._begin(first_us, now_us)

    def next_deadline_us(self) -> int:
        """When the next frame is due; `NEVER_US` while paused, and at the end."""
        return NEVER_US if self.paused or self._next is None else self._due_us(self._next)

    def frames_due(self, now_us: int) -> list[bytes]:
        """The frames that are due, `MOST_AT_ONCE` of them at most: the next deadline tells whether there are more."""
        due: list[bytes] = []
        if self.paused or self._next is None:
            return due
        if now_us - self._due_us(self._next) > LATE_MAX_US:
            self._anchor(self._next.stamp_us, now_us)
        while self._next is not None and len(due) < MOST_AT_ONCE and self._due_us(self._next) <= now_us:
            due.append(self._next.frame)
            self._step(self._next, now_us)
        self.frames += len(due)
        self.bytes += sum(map(len, due))
        return due

    def position_us(self, now_us: int) -> int:
        """The stamp that is being played."""
        if self.paused:
            return self._paused_us
        if self._next is None:
            return self._last_us
        at_us = self._log_us + round((now_us - self._now_us) * self.speed)
        return max(self._latest_us, min(at_us, self._next.stamp_us))

    # ------------------------------------------------------------------ the listener's wishes

    def pause(self, now_us: int) -> None:
        """Let time stand still."""
        if not self.paused:
            self._paused_us = self.position_us(now_us)
            self.paused = True

    def resume(self, now_us: int) -> None:
        """Let it go on."""
        if self.paused:
            self.paused = False
            self._anchor(self._paused_us, now_us)

    def change_speed(self, speed: float, now_us: int) -> None:
        """Go on faster or slower from here."""
        if not self.paused:
            self._anchor(self.position_us(now_us), now_us)
        self.speed = speed

    def seek(self, stamp_us: int, now_us: int) -> None:
        """Go on from another stamp, within the log; a pause stays one, an end does not."""
        stamp_us = min(max(stamp_us, self._first_us), self._last_us)
        self.done = False
        self._begin(stamp_us, now_us)
        self._paused_us = stamp_us

    # ------------------------------------------------------------------ the log

    def _begin(self, stamp_us: int, now_us: int) -> None:
        self._records = self._open(stamp_us)
        self._latest_us = stamp_us
        self._anchor(stamp_us, now_us)
        self._next = next(self._records, None)
        self.done = self._next is None
        if self._next is not None and self._next.stamp_us - stamp_us > LEAP_US:
            self._latest_us = self._next.stamp_us
            self._anchor(self._next.stamp_us, now_us)

    def _anchor(self, log_us: int, now_us: int) -> None:
        """This stamp is played now."""
        self._log_us, self._now_us = log_us, now_us

    def _due_us(self, record: Record) -> int:
        return self._now_us + round((record.stamp_us - self._log_us) / self.speed)

    def _step(self, played: Record, now_us: int) -> None:
        """To the next record: on the same time line, behind a leap, or in the next round."""
        due_us = self._due_us(played)
        behind_us = max(due_us, min(now_us, due_us + LATE_MAX_US)) + round(LEAP_PLAYED_US / self.speed)
        self._latest_us = max(self._latest_us, played.stamp_us)
        self._next = next(self._records, None)
        if self._next is None:
            self._end(behind_us)
        elif abs(self._next.stamp_us - self._latest_us) > LEAP_US:
            self.leaps += 1
            self._latest_us = self._next.stamp_us
            self._anchor(self._next.stamp_us, behind_us)

    def _end(self, behind_us: int) -> None:
        self.rounds += 1
        self.done = True
        if self._loop:
            self._begin(self._first_us, behind_us)


class Listener:
    """Which frames are played: the vehicles', or those that the recorder sent, or both.

    A recorder marks what it sent itself; what ground stations sent through it is told by their HEARTBEATs.
    """

    def __init__(self, inbound: bool = True, outbound: bool = False) -> None:
        self._inbound, self._outbound = inbound, outbound
        self._stations: set[tuple[int, int]] = set()

    def hears(self, record: Record) -> bool:
        """Whether this one is played."""
        from_station = record.outbound or self._is_of_station(record.frame)
        return self._outbound if from_station else self._inbound

    def _is_of_station(self, frame: bytes) -> bool:
        source = frame_source(frame)
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_HEARTBEAT and decode(frame).type == mavlink.MAV_TYPE_GCS:
            self._stations.add(source)
        return source in self._stations
