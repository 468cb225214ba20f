"""The pose stream of one vehicle in a log: positions, velocities and attitudes by the vehicle's own clock, in NWU.

Positions come from LOCAL_POSITION_NED, ODOMETRY or GLOBAL_POSITION_INT, attitudes from ATTITUDE, ATTITUDE_QUATERNION or
ODOMETRY: of each the one that the log has most of, where a finer one counts for more. GLOBAL_POSITION_INT is metres from
GPS_GLOBAL_ORIGIN, as the local positions are, or else from HOME_POSITION, or else from its own first fix.

A stamp of the vehicle that repeats or steps back a little is skipped; one that steps back far is a reboot, and one that
jumps ahead is a gap: each begins a new segment.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from mavquad.analysis.pose_messages import (
    Geodetic,
    euler_attitude,
    local_position,
    odometry_attitude,
    odometry_position,
    quaternion_attitude,
)
from mavquad.control.euler import euler_rates, trig
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.tlog import TlogContents
from mavquad.types import Attitude, Position

_LOCAL = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
_ODOMETRY = mavlink.MAVLINK_MSG_ID_ODOMETRY
_GLOBAL = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE
_QUATERNION = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION
_ORIGIN = mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN
_HOME = mavlink.MAVLINK_MSG_ID_HOME_POSITION
_POSITION_WORTH = {_LOCAL: 1.0, _ODOMETRY: 0.9, _GLOBAL: 0.3}
_ATTITUDE_WORTH = {_ATTITUDE: 1.0, _QUATERNION: 0.9, _ODOMETRY: 0.8}
_REBOOT_US = 1_000_000
_GAP_US = 5_000_000
_CLOCK_US = 1_000_000
_OTHER_CLOCK_US = 86_400_000_000  # ODOMETRY may have Unix time
_LEAST_COS_PITCH = 1e-3  # nearer to vertical than that there is no heading


@dataclass(frozen=True, slots=True)
class HeadingSample:
    """Yaw (rad, wrapped, NWU) and the log's own yaw rate (rad/s, time derivative of yaw) at `stamp_us`."""

    stamp_us: int
    yaw_rad: float
    yaw_rate_rad_s: float


@dataclass(frozen=True, slots=True)
class PoseSegment:
    """A stretch without reboot or long gap; its first sample arrived `log_start_s` after the log began.

    Attributes:
        log_start_s: s since the log began.
        first_stamp_us: of the vehicle's clock.
        poses: positions with the log's own velocities.
        attitudes: attitudes with the log's own body rates.
        clock: (stamp of the vehicle's clock in us, s since the log began) of the least delayed sample of each second.
    """

    log_start_s: float
    first_stamp_us: int
    poses: list[Position] = field(default_factory=list)
    attitudes: list[Attitude] = field(default_factory=list)
    clock: list[tuple[int, float]] = field(default_factory=list)

    def log_time_s(self, stamp_us: int) -> float:
        """A stamp of the vehicle's clock as seconds since the log began.

        The vehicle's clock may run slower than the log's (a simulator's by some per cent): between two seconds on a line.
        """
        place = bisect_right(self.clock, stamp_us, key=lambda pair: pair[0])
        if place == 0 or place == len(self.clock):
            us, at_s = self.clock[max(place - 1, 0)] if self.clock else (self.first_stamp_us, self.log_start_s)
            return at_s + (stamp_us - us) * 1e-6
        (us, at_s), (later_us, later_s) = self.clock[place - 1 : place + 1]
        return at_s + (later_s - at_s) * (stamp_us - us) / (later_us - us)

    def heard(self, stamp_us: int, log_s: float) -> None:
        """A sample arrived."""
        second, last = stamp_us // _CLOCK_US, self.clock[-1][0] // _CLOCK_US if self.clock else -1
        if second > last:
            self.clock.append((stamp_us, log_s))
        elif second == last and self._delay_s(stamp_us, log_s) < self._delay_s(*self.clock[-1]):
            self.clock[-1] = (stamp_us, log_s)

    @staticmethod
    def _delay_s(stamp_us: int, log_s: float) -> float:
        return log_s - stamp_us * 1e-6

    @property
    def headings(self) -> list[HeadingSample]:
        """Headings and the rates at which they turn; none where the nose points straight up or down."""
        return [
            _heading(attitude) for attitude in self.attitudes if abs(math.cos(attitude.pitch_rad)) >= _LEAST_COS_PITCH
        ]


@dataclass(frozen=True, slots=True)
class PoseStream:
    """All of one vehicle's poses.

    Attributes:
        source: the message that the positions are from; "" if there is no usable one.
        attitude_source: the message that the attitudes are from; "" likewise.
        segments: between reboots and gaps, in order.
        repeated: samples skipped for a stamp that was seen already.
        backward: samples skipped for a stamp a little before the last one.
        invalid: samples skipped for a value that is not finite, or a fix at 0, 0.
        geodetic: of GLOBAL_POSITION_INT, in the frame of these positions; None where that is not known.
    """

    source: str
    attitude_source: str
    segments: tuple[PoseSegment, ...]
    repeated: int
    backward: int
    invalid: int
    geodetic: Geodetic | None = None


Reader = Callable[[Message], Position | Attitude | None]
_POSITIONS: dict[int, Reader] = {_LOCAL: local_position, _ODOMETRY: odometry_position}
_ATTITUDES: dict[int, Reader] = {
    _ATTITUDE: euler_attitude,
    _QUATERNION: quaternion_attitude,
    _ODOMETRY: odometry_attitude,
}


def pose_stream(contents: TlogContents, sender: tuple[int, int]) -> PoseStream:
    """Collect the poses of one (system, component)."""
    counts: Counter[int] = Counter()
    origins: dict[int, tuple[int, int, int]] = {}
    for record in contents:
        if frame_source(record.frame) == sender:
            number = message_id(record.frame)
            counts[number] += 1
            if number in (_ORIGIN, _HOME) and number not in origins:
                message = decode(record.frame)
                origins[number] = (message.latitude, message.longitude, message.altitude)
    position_id, attitude_id = _best(counts, _POSITION_WORTH), _best(counts, _ATTITUDE_WORTH)
    geodetic = Geodetic(origins.get(_ORIGIN) or origins.get(_HOME))
    readers: dict[int, list[Reader]] = {position_id: [], attitude_id: []}
    readers[position_id].append(_POSITIONS.get(position_id, geodetic))
    readers[attitude_id].append(_ATTITUDES[attitude_id])
    collector = _Collector(contents[0].stamp_us if len(contents) else 0)
    _collect(contents, sender, collector, readers)
    segments = tuple(collector.segments)
    return PoseStream(
        source=_name(position_id) if any(segment.poses for segment in segments) else "",
        attitude_source=_name(attitude_id) if any(segment.attitudes for segment in segments) else "",
        segments=segments,
        repeated=collector.repeated,
        backward=collector.backward,
        invalid=collector.invalid,
        geodetic=geodetic if position_id == _GLOBAL or _ORIGIN in origins else None,
    )


def _collect(
    contents: TlogContents, sender: tuple[int, int], collector: _Collector, readers: dict[int, list[Reader]]
) -> None:
    for record in contents:
        if frame_source(record.frame) != sender:
            continue
        if wanted := readers.get(message_id(record.frame)):
            message = decode(record.frame)
            for read in wanted:
                collector.add(read, record.stamp_us, read(message))


def _best(counts: Counter[int], worth: dict[int, float]) -> int:
    """The message with the most samples, by their worth; a single one is none."""
    return max(worth, key=lambda number: (counts[number] > 1, counts[number] * worth[number]))


def _name(number: int) -> str:
    return str(mavlink.mavlink_map[number].msgname)


class _Collector:
    """Sorts samples into segments by their stamps."""

    def __init__(self, log_start_us: int) -> None:
        self.segments: list[PoseSegment] = []
        self.repeated = self.backward = self.invalid = 0
        self._log_start_us = log_start_us
        self._newest_us = 0
        self._last_us: dict[Reader, int] = {}
        self._shifts_us: dict[Reader, int] = {}

    def add(self, stream: Reader, log_stamp_us: int, sample: Position | Attitude | None) -> None:
        """Take in a sample of a stream; None is one without a usable value."""
        if sample is None:
            self.invalid += 1
            return
        sample = self._on_one_clock(stream, sample)
        if not self.segments or self._begins_anew(stream, sample.stamp_us):
            self._begin(log_stamp_us, sample.stamp_us)
        last_us = self._last_us.get(stream, -1)
        if sample.stamp_us == last_us:
            self.repeated += 1
        elif sample.stamp_us < last_us:
            self.backward += 1
        else:
            self._append(stream, sample)
            self.segments[-1].heard(sample.stamp_us, (log_stamp_us - self._log_start_us) * 1e-6)

    def _on_one_clock(self, stream: Reader, sample: Position | Attitude) -> Position | Attitude:
        """A stream that counts from elsewhere is moved to where the others are as it begins."""
        if stream not in self._shifts_us:
            ahead_us = sample.stamp_us - self._newest_us if self.segments else 0
            self._shifts_us[stream] = ahead_us if abs(ahead_us) > _OTHER_CLOCK_US else 0
        shift_us = self._shifts_us[stream]
        return sample._replace(stamp_us=sample.stamp_us - shift_us) if shift_us else sample

    def _begins_anew(self, stream: Reader, stamp_us: int) -> bool:
        """Whether the clock stepped back for good, or this message (or all of them) paused for long."""
        silent_since_us = self._last_us.get(stream, self._newest_us)
        return stamp_us < self._newest_us - _REBOOT_US or stamp_us > silent_since_us + _GAP_US

    def _begin(self, log_stamp_us: int, stamp_us: int) -> None:
        self.segments.append(PoseSegment((log_stamp_us - self._log_start_us) * 1e-6, stamp_us))
        self._last_us.clear()
        self._newest_us = stamp_us

    def _append(self, stream: Reader, sample: Position | Attitude) -> None:
        self._last_us[stream] = sample.stamp_us
        self._newest_us = max(self._newest_us, sample.stamp_us)
        if isinstance(sample, Position):
            self.segments[-1].poses.append(sample)
        else:
            self.segments[-1].attitudes.append(sample)


def _heading(attitude: Attitude) -> HeadingSample:
    turning = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    return HeadingSample(attitude.stamp_us, attitude.yaw_rad, euler_rates(turning, attitude.rates_flu_rad_s)[2])
