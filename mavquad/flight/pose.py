"""The pose as it comes in: the last attitude and position, how old they are, and what is wrong with them."""

from __future__ import annotations

from mavquad.endpoint import NEVER_US, grid_us
from mavquad.flight.guards import GuardParams, Tripped, not_a_number, stale
from mavquad.protocol.codec import Message
from mavquad.protocol.messages import attitude_from, position_from
from mavquad.types import Attitude, Position

_LONG_AGO_US = -NEVER_US


class PoseIntake:
    """Takes in pose messages; only one that is finite and newer than the last counts as a measurement.

    Attributes:
        attitude: the last one, None before the first.
        position: the last one, None before the first.
        old: messages with a stamp not newer than the last one's (duplicates, late ones), not used.
    """

    def __init__(self, params: GuardParams) -> None:
        self._limit_us = grid_us(params.stale_pose_s)
        self._params = params
        self.attitude: Attitude | None = None
        self.position: Position | None = None
        self.old = 0
        self._attitude_us = _LONG_AGO_US
        self._position_us = _LONG_AGO_US

    def take_attitude(self, message: Message, now_us: int) -> Attitude | Tripped | None:
        """The attitude if it is a fresh measurement; the guard that it trips; None if it is old."""
        attitude = attitude_from(message)
        if attitude is None:
            return not_a_number("ATTITUDE")
        if self.attitude is not None and attitude.stamp_us <= self.attitude.stamp_us:
            self.old += 1
            return None
        self.attitude = attitude
        self._attitude_us = now_us
        return attitude

    def take_position(self, message: Message, now_us: int) -> Position | Tripped | None:
        """The position if it is a fresh measurement; the guard that it trips; None if it is old."""
        position = position_from(message)
        if position is None:
            return not_a_number("LOCAL_POSITION_NED")
        if self.position is not None and position.stamp_us <= self.position.stamp_us:
            self.old += 1
            return None
        self.position = position
        self._position_us = now_us
        return position

    def stale_deadline_us(self) -> int:
        """When the older of the two streams becomes stale."""
        return min(self._attitude_us, self._position_us) + self._limit_us

    def stale(self, now_us: int) -> Tripped | None:
        """The guard that an old pose trips."""
        for name, last_us in (("ATTITUDE", self._attitude_us), ("LOCAL_POSITION_NED", self._position_us)):
            if now_us - last_us >= self._limit_us:
                return stale(name, min((now_us - last_us) * 1e-6, 1e3), self._params)
        return None
