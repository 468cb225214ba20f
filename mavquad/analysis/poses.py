"""The pose stream of one vehicle in a log: positions, velocities and headings by the vehicle's own clock, in NWU.

Positions come from LOCAL_POSITION_NED, or else from GLOBAL_POSITION_INT as metres from its first fix; headings from
ATTITUDE. A stamp (`time_boot_ms`) that repeats or steps back a little is skipped; one that steps back far is a reboot,
and one that jumps ahead is a gap: each begins a new segment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mavquad.frames import euler_flipped, flu_from_frd, nwu_from_ned
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.tlog import TlogContents
from mavquad.types import Vec3

_LOCAL = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
_GLOBAL = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE
_REBOOT_US = 1_000_000
_GAP_US = 5_000_000
_EARTH_RADIUS_M = 6_378_137.0
_LEAST_COS_PITCH = 1e-3  # nearer to vertical than that there is no heading


@dataclass(frozen=True, slots=True)
class PoseSample:
    """Position (m) and the log's own velocity (m/s), NWU, at `stamp_us` of the vehicle's clock."""

    stamp_us: int
    position_nwu_m: Vec3
    velocity_nwu_m_s: Vec3


@dataclass(frozen=True, slots=True)
class HeadingSample:
    """Yaw (rad, wrapped, NWU) and the log's own yaw rate (rad/s, time derivative of yaw) at `stamp_us`."""

    stamp_us: int
    yaw_rad: float
    yaw_rate_rad_s: float


@dataclass(frozen=True, slots=True)
class PoseSegment:
    """A stretch without reboot or long gap; its first sample arrived `log_start_s` after the log began."""

    log_start_s: float
    first_stamp_us: int
    poses: list[PoseSample] = field(default_factory=list)
    headings: list[HeadingSample] = field(default_factory=list)

    def log_time_s(self, stamp_us: int) -> float:
        """A stamp of the vehicle's clock as seconds since the log began."""
        return self.log_start_s + (stamp_us - self.first_stamp_us) * 1e-6


@dataclass(frozen=True, slots=True)
class PoseStream:
    """All of one vehicle's poses.

    Attributes:
        source: the message that the positions are from; "" if there is no usable one.
        segments: between reboots and gaps, in order.
        repeated: samples skipped for a stamp that was seen already.
        backward: samples skipped for a stamp a little before the last one.
        invalid: samples skipped for a value that is not finite, or a fix at 0, 0.
    """

    source: str
    segments: tuple[PoseSegment, ...]
    repeated: int
    backward: int
    invalid: int


def pose_stream(contents: TlogContents, sender: tuple[int, int]) -> PoseStream:
    """Collect the poses of one (system, component)."""
    ids = [message_id(record.frame) for record in contents if frame_source(record.frame) == sender]
    position_id = _LOCAL if ids.count(_LOCAL) > 1 else _GLOBAL
    collector = _Collector(contents[0].stamp_us if len(contents) else 0)
    locate = _local_pose if position_id == _LOCAL else _Geodetic()
    for record in contents:
        if frame_source(record.frame) != sender:
            continue
        number = message_id(record.frame)
        if number == position_id:
            collector.add(number, record.stamp_us, locate(decode(record.frame)))
        elif number == _ATTITUDE:
            collector.add(number, record.stamp_us, _heading(decode(record.frame)))
    located = any(segment.poses for segment in collector.segments)
    source = mavlink.mavlink_map[position_id].msgname if located else ""
    return PoseStream(source, tuple(collector.segments), collector.repeated, collector.backward, collector.invalid)


class _Collector:
    """Sorts samples into segments by their stamps."""

    def __init__(self, log_start_us: int) -> None:
        self.segments: list[PoseSegment] = []
        self.repeated = self.backward = self.invalid = 0
        self._log_start_us = log_start_us
        self._newest_us = 0
        self._last_us: dict[int, int] = {}

    def add(self, number: int, log_stamp_us: int, sample: PoseSample | HeadingSample | None) -> None:
        """Take in a sample of message `number`; None is one without a usable value."""
        if sample is None:
            self.invalid += 1
            return
        if not self.segments or self._begins_anew(number, sample.stamp_us):
            self._begin(log_stamp_us, sample.stamp_us)
        last_us = self._last_us.get(number, -1)
        if sample.stamp_us == last_us:
            self.repeated += 1
        elif sample.stamp_us < last_us:
            self.backward += 1
        else:
            self._append(number, sample)

    def _begins_anew(self, number: int, stamp_us: int) -> bool:
        """Whether the clock stepped back for good, or this message (or all of them) paused for long."""
        silent_since_us = self._last_us.get(number, self._newest_us)
        return stamp_us < self._newest_us - _REBOOT_US or stamp_us > silent_since_us + _GAP_US

    def _begin(self, log_stamp_us: int, stamp_us: int) -> None:
        self.segments.append(PoseSegment((log_stamp_us - self._log_start_us) * 1e-6, stamp_us))
        self._last_us.clear()
        self._newest_us = stamp_us

    def _append(self, number: int, sample: PoseSample | HeadingSample) -> None:
        self._last_us[number] = sample.stamp_us
        self._newest_us = max(self._newest_us, sample.stamp_us)
        if isinstance(sample, PoseSample):
            self.segments[-1].poses.append(sample)
        else:
            self.segments[-1].headings.append(sample)


def _pose(time_boot_ms: int, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> PoseSample | None:
    if not all(map(math.isfinite, (*position_ned_m, *velocity_ned_m_s))):
        return None
    return PoseSample(time_boot_ms * 1000, nwu_from_ned(position_ned_m), nwu_from_ned(velocity_ned_m_s))


def _local_pose(message: Message) -> PoseSample | None:
    position_ned_m = (message.x, message.y, message.z)
    return _pose(message.time_boot_ms, position_ned_m, (message.vx, message.vy, message.vz))


class _Geodetic:
    """GLOBAL_POSITION_INT as metres from the first fix, on a plane that touches the Earth there."""

    def __init__(self) -> None:
        self._origin: tuple[int, int, int] | None = None

    def __call__(self, message: Message) -> PoseSample | None:
        if message.lat == 0 and message.lon == 0:
            return None
        if self._origin is None:
            self._origin = (message.lat, message.lon, message.alt)
        lat0, lon0, alt0 = self._origin
        north_m = math.radians((message.lat - lat0) * 1e-7) * _EARTH_RADIUS_M
        east_m = math.radians((message.lon - lon0) * 1e-7) * _EARTH_RADIUS_M * math.cos(math.radians(lat0 * 1e-7))
        velocity_ned_m_s = (message.vx * 0.01, message.vy * 0.01, message.vz * 0.01)
        return _pose(message.time_boot_ms, (north_m, east_m, (alt0 - message.alt) * 1e-3), velocity_ned_m_s)


def _heading(message: Message) -> HeadingSample | None:
    """Yaw of ATTITUDE, and its time derivative (q sin(roll) + r cos(roll)) / cos(pitch)."""
    rates_frd_rad_s = (message.rollspeed, message.pitchspeed, message.yawspeed)
    if not all(map(math.isfinite, (message.roll, message.pitch, message.yaw, *rates_frd_rad_s))):
        return None
    roll_rad, pitch_rad, yaw_rad = euler_flipped(message.roll, message.pitch, message.yaw)
    if abs(math.cos(pitch_rad)) < _LEAST_COS_PITCH:
        return None
    _, q, r = flu_from_frd(rates_frd_rad_s)
    yaw_rate_rad_s = (q * math.sin(roll_rad) + r * math.cos(roll_rad)) / math.cos(pitch_rad)
    return HeadingSample(message.time_boot_ms * 1000, yaw_rad, yaw_rate_rad_s)
