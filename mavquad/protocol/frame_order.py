"""Frames that come twice, and HEARTBEATs that come after a later one: they would show a mode that the vehicle has left.

Every frame of a sender has the next sequence number, modulo 256. The nearest turn to the newest frame unwraps it, so that
a frame up to 127 behind is seen as late (half a second of a vehicle's frames). A HEARTBEAT is compared with the HEARTBEAT
before it and not with the newest frame: the first one of another mode counts even where later frames have overtaken it.
Other messages may come late: poses have stamps of their own, and the rest is asked for again or told again.

A copy is known by its bytes: the same content under the same number. What follows right behind the newest frame is new all
the same: by chance it may be what was said a few turns ago.
"""

from __future__ import annotations

from typing import Literal

from mavquad.protocol.codec import frame_sequence

OutOfOrder = Literal["doubled", "late"]

_TURN = 256
_SILENCE_US = 1_000_000
"""After this long without any frame the vehicle may have rebooted: it counts from 0 again."""
_PATIENCE_US = 2_500_000
"""No HEARTBEAT is left out for longer than this since the last one that counted."""
_MEMORY_US = 5_000_000
"""A copy is known for this long at least, and at most for twice as long."""


class FrameOrder:
    """Follows the frames of one sender."""

    def __init__(self) -> None:
        self._newest = 0
        self._heard_us = -_SILENCE_US
        self._heartbeat: int | None = None
        self._heartbeat_us = 0
        self._frames: set[bytes] = set()
        self._earlier: set[bytes] = set()
        self._since_us = 0

    def fault(self, frame: bytes, is_heartbeat: bool, now_us: int) -> OutOfOrder | None:
        """The sender's next frame, as it arrived; why it must not count, None where it may."""
        if now_us - self._heard_us > _SILENCE_US:
            self._newest, self._heartbeat = frame_sequence(frame) - 1, None
        ahead = (frame_sequence(frame) - self._newest + _TURN // 2) % _TURN - _TURN // 2
        is_needed = is_heartbeat and now_us - self._heartbeat_us > _PATIENCE_US
        if self._is_known(frame, now_us) and ahead != 1 and not is_needed:
            return "doubled"
        self._heard_us = now_us
        place = self._newest + ahead
        self._newest = max(self._newest, place)
        if not is_heartbeat:
            return None
        if self._heartbeat is not None and place <= self._heartbeat and not is_needed:
            return "late"
        self._heartbeat, self._heartbeat_us = place, now_us
        return None

    def _is_known(self, frame: bytes, now_us: int) -> bool:
        if now_us - self._since_us > _MEMORY_US:
            self._frames, self._earlier, self._since_us = set(), self._frames, now_us
        if frame in self._frames or frame in self._earlier:
            return True
        self._frames.add(frame)
        return False
