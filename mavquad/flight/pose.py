"""The pose as it comes in: the last attitude and position, how old they are, and what is wrong with them.

The age of a sample is known but for the link's least delay: arrival minus stamp is the clocks' offset plus the delay, and
its running minimum stands for the offset plus the least delay. The minimum is let rise slowly, since clocks drift (real
PX4 in lockstep: 13 ms/s). Where TIMESYNC says that a sample is younger than that, it is believed. So what waited in a buffer
while this computer stalled is not taken for fresh, and what a simulator sends after it has stalled is not taken for old.
"""

from __future__ import annotations

from collections.abc import Callable

from mavquad.endpoint import NEVER_US, floor_to_grid_us, grid_us
from mavquad.flight.guards import GuardParams, Tripped, not_a_number, stale
from mavquad.protocol.codec import Message
from mavquad.protocol.messages import attitude_from, position_from
from mavquad.types import Attitude, Depth, Position

_LONG_AGO_US = -NEVER_US
_DRIFT = 0.03
_REBOOT_US = 1_000_000


class _Stream:
    """When the last sample of one stream was taken, on our clock."""

    def __init__(self, limit_us: int) -> None:
        self.limit_us = limit_us
        self._stamp_us = _LONG_AGO_US
        self._arrival_us = _LONG_AGO_US
        self._offset_us = NEVER_US
        self.sampled_us = _LONG_AGO_US

    def accept(self, stamp_us: int, now_us: int, may_restart: bool, age_us: int | None) -> bool:
        """Whether a sample is newer than the last and not yet too old."""
        if may_restart and stamp_us < self._stamp_us - _REBOOT_US:
            self._stamp_us, self._offset_us = _LONG_AGO_US, NEVER_US
        if stamp_us <= self._stamp_us:
            return False
        drifted_us = (
            self._offset_us + int(_DRIFT * (now_us - self._arrival_us)) if self._offset_us < NEVER_US else NEVER_US
        )
        self._offset_us = min(now_us - stamp_us, drifted_us)
        self._stamp_us, self._arrival_us = stamp_us, now_us
        sampled_us = floor_to_grid_us(stamp_us + self._offset_us)
        if age_us is not None:
            # A simulator that stalls stands still with its clock: by the minimum all that comes after would be old.
            sampled_us = max(sampled_us, floor_to_grid_us(now_us - age_us))
        if now_us - sampled_us >= self.limit_us:
            return False
        self.sampled_us = sampled_us
        return True


class PoseIntake:
    """Takes in pose messages; only one that is finite, newer than the last and young enough counts as a measurement.

    Attributes:
        attitude: the last one, None before the first.
        position: the last one, None before the first.
        old: messages not used: with a stamp not newer than the last one's (duplicates, late ones), or too old.
        may_restart: whether stamps that step back by more than a second mean a reboot; False in flight.
    """

    def __init__(
        self, params: GuardParams, age_us: Callable[[int, int], int | None] = lambda stamp_us, now_us: None
    ) -> None:
        """`age_us`: of a sample by its stamp and the time now, as TIMESYNC has it; None while that is not known."""
        self._params = params
        self._age_us = age_us
        self._attitudes = _Stream(grid_us(params.stale_attitude_s))
        self._positions = _Stream(grid_us(params.stale_position_s))
        self.attitude: Attitude | None = None
        self.position: Position | None = None
        self.old = 0
        self.may_restart = True

    def choose(self, depth: Depth) -> None:
        """The depth decides how old an attitude may be."""
        limit_s = self._params.stale_attitude_at_torque_s if depth == "torque" else self._params.stale_attitude_s
        self._attitudes.limit_us = grid_us(limit_s)

    def take_attitude(self, message: Message, now_us: int) -> Attitude | Tripped | None:
        """The attitude if it is a fresh measurement; the guard that it trips; None if it is old."""
        attitude = attitude_from(message)
        if attitude is None:
            return not_a_number("ATTITUDE", self._params.nan.reaction)
        if not self._attitudes.accept(
            attitude.stamp_us, now_us, self.may_restart, self._age_us(attitude.stamp_us, now_us)
        ):
            self.old += 1
            return None
        self.attitude = attitude
        return attitude

    def take_position(self, message: Message, now_us: int) -> Position | Tripped | None:
        """The position if it is a fresh measurement; the guard that it trips; None if it is old."""
        position = position_from(message)
        if position is None:
            return not_a_number("LOCAL_POSITION_NED", self._params.nan.reaction)
        if not self._positions.accept(
            position.stamp_us, now_us, self.may_restart, self._age_us(position.stamp_us, now_us)
        ):
            self.old += 1
            return None
        self.position = position
        return position

    def stale_deadline_us(self) -> int:
        """When the first of the two streams becomes stale."""
        attitudes, positions = self._attitudes, self._positions
        return min(attitudes.sampled_us + attitudes.limit_us, positions.sampled_us + positions.limit_us)

    def authority(self, now_us: int) -> float:
        """1 while the position is fresh; from `late_position_s` on it shrinks, to 0 at `stale_position_s`."""
        late_s, stale_s = self._params.late_position_s, self._params.stale_position_s
        age_s = (now_us - self._positions.sampled_us) * 1e-6
        if age_s <= late_s:
            return 1.0
        return max((stale_s - age_s) / (stale_s - late_s), 0.0) if stale_s > late_s else 0.0

    def stale(self, now_us: int) -> Tripped | None:
        """The guard that an old pose trips."""
        for name, stream in (("ATTITUDE", self._attitudes), ("LOCAL_POSITION_NED", self._positions)):
            if now_us - stream.sampled_us >= stream.limit_us:
                return stale(
                    name,
                    min((now_us - stream.sampled_us) * 1e-6, 1e3),
                    stream.limit_us * 1e-6,
                    self._params.stale_reaction,
                )
        return None
