"""What the autopilot of a log aimed at: its own position targets as a reference, and its own attitude and thrust commands."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeVar

from mavquad.analysis.pose_messages import Geodetic
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.reference import Pose, hold
from mavquad.flight.guards import tilt_rad
from mavquad.frames import nwu_from_ned
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.protocol.messages import attitude_target_from
from mavquad.tlog import TlogContents
from mavquad.types import Attitude, AttitudeTarget, Position, ReferencePoint, Vec3

_LOCAL_TARGET = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED
_GLOBAL_TARGET = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT
_ATTITUDE_TARGET = mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET
_NO_POSITION, _NO_YAW = 0x7, 0x400  # of type_mask
_ABOVE_SEA = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
_LEAST_HOVER, _MOST_HOVER, _SLOW_M_S = 0.1, 0.9, 0.5
_LEAST_HOVER_COUNT = 10
FRESH_US = 1_500_000
"""A target counts for this long: ArduPilot sends them once a second."""


class PositionTarget(NamedTuple):
    """Where the autopilot wanted the vehicle to be, NWU, and how that place moved; yaw None where it did not say."""

    stamp_us: int
    position_nwu_m: Vec3
    yaw_rad: float | None
    velocity_nwu_m_s: Vec3 = (0.0, 0.0, 0.0)
    acceleration_nwu_m_s2: Vec3 = (0.0, 0.0, 0.0)


Stamped = TypeVar("Stamped", Position, Attitude, AttitudeTarget, PositionTarget)


@dataclass(frozen=True, slots=True)
class Targets:
    """Both, by increasing stamps of the vehicle's clock; `source` is the message of the positions."""

    positions: tuple[PositionTarget, ...]
    attitudes: tuple[AttitudeTarget, ...]
    source: str

    def position_at(self, stamp_us: int) -> PositionTarget | None:
        """The latest, while it counts."""
        found = _latest(self.positions, stamp_us)
        return found if found is not None and stamp_us - found.stamp_us <= FRESH_US else None

    def attitude_at(self, stamp_us: int) -> AttitudeTarget | None:
        """Likewise."""
        found = _latest(self.attitudes, stamp_us)
        return found if found is not None and stamp_us - found.stamp_us <= FRESH_US else None


def targets(contents: TlogContents, sender: tuple[int, int], geodetic: Geodetic | None) -> Targets:
    """The targets of one (system, component). Without local ones, global ones where it is known where zero is."""
    found: dict[int, list[Message]] = defaultdict(list)
    for record in contents:
        if frame_source(record.frame) == sender and message_id(record.frame) in _READ:
            found[message_id(record.frame)].append(decode(record.frame))
    local = _ordered(found[_LOCAL_TARGET], _local_target)
    far = _ordered(found[_GLOBAL_TARGET], lambda message: _global_target(message, geodetic)) if not local else ()
    source = "POSITION_TARGET_LOCAL_NED" if local else "POSITION_TARGET_GLOBAL_INT" if far else ""
    return Targets(_moving(local or far), _ordered(found[_ATTITUDE_TARGET], attitude_target_from), source)


_READ = frozenset((_LOCAL_TARGET, _GLOBAL_TARGET, _ATTITUDE_TARGET))


def hover_thrust(
    attitudes: Sequence[AttitudeTarget], poses: Sequence[Position], measured: Sequence[Attitude]
) -> float | None:
    """The thrust that carries the weight: the median of thrust times cos(tilt) while it climbs or sinks slowly."""
    norms = []
    for target in attitudes:
        pose, attitude = _latest(poses, target.stamp_us), _latest(measured, target.stamp_us)
        if pose is None or attitude is None or abs(pose.velocity_nwu_m_s[2]) > _SLOW_M_S:
            continue
        norm = target.thrust_norm * math.cos(tilt_rad(attitude))
        if _LEAST_HOVER < norm < _MOST_HOVER:
            norms.append(norm)
    return sorted(norms)[len(norms) // 2] if len(norms) >= _LEAST_HOVER_COUNT else None


def thrusts(attitudes: Sequence[AttitudeTarget], hover_norm: float | None) -> list[tuple[int, float]]:
    """Thrust per mass (m/s^2) by stamp; empty where the hover thrust is not known."""
    if hover_norm is None:
        return []
    return [(target.stamp_us, target.thrust_norm * GRAVITY_M_S2 / hover_norm) for target in attitudes]


def reference_point(target: PositionTarget, stamp_us: int, yaw_rad: float) -> ReferencePoint:
    """A target as the law's reference at a moment: on its line; where it has no yaw, looking as it does."""
    since_s = (stamp_us - target.stamp_us) * 1e-6
    yaw = yaw_rad if target.yaw_rad is None else target.yaw_rad
    north, west, up = (
        (p + since_s * (v + 0.5 * since_s * a), v + since_s * a, a, 0.0, 0.0)
        for p, v, a in zip(target.position_nwu_m, target.velocity_nwu_m_s, target.acceleration_nwu_m_s2, strict=True)
    )
    return ReferencePoint(up, (yaw, 0.0, 0.0, 0.0, 0.0), north, west)


def holding(pose: Position, yaw_rad: float) -> Callable[[int], ReferencePoint]:
    """The reference that stays where this pose is."""
    point = hold(Pose(pose.position_nwu_m, yaw_rad))
    return lambda _: point


def _latest(items: Sequence[Stamped], stamp_us: int) -> Stamped | None:
    place = bisect_right(items, stamp_us, key=lambda item: item.stamp_us)
    return items[place - 1] if place else None


def _ordered(messages: Sequence[Message], read: Callable[[Message], Stamped | None]) -> tuple[Stamped, ...]:
    """What can be used, by increasing stamps; a stamp that was there before is left out."""
    found: dict[int, Stamped] = {}
    for message in messages:
        if (target := read(message)) is not None:
            found[target.stamp_us] = target
    return tuple(found[stamp_us] for stamp_us in sorted(found))


def _local_target(message: Message) -> PositionTarget | None:
    place = (message.x, message.y, message.z)
    if message.coordinate_frame != mavlink.MAV_FRAME_LOCAL_NED:
        return None
    return _target(message, place)


def _global_target(message: Message, geodetic: Geodetic | None) -> PositionTarget | None:
    if geodetic is None or message.coordinate_frame not in _ABOVE_SEA or (message.lat_int == message.lon_int == 0):
        return None
    return _target(message, geodetic.place_ned_m(message.lat_int, message.lon_int, message.alt * 1e3))


def _target(message: Message, place_ned_m: Vec3) -> PositionTarget | None:
    if message.type_mask & _NO_POSITION or not all(map(math.isfinite, place_ned_m)):
        return None
    looks = not message.type_mask & _NO_YAW and math.isfinite(message.yaw)
    return PositionTarget(message.time_boot_ms * 1000, nwu_from_ned(place_ned_m), -message.yaw if looks else None)


def _moving(targets_: Sequence[PositionTarget]) -> tuple[PositionTarget, ...]:
    """With velocities and accelerations from the places alone.

    The message's own velocity and acceleration are no feed-forward: in PX4 they are what its loops made of the error.
    """
    times_s = [target.stamp_us * 1e-6 for target in targets_]
    velocities = _slopes(times_s, [target.position_nwu_m for target in targets_])
    accelerations = _slopes(times_s, velocities)
    return tuple(
        target._replace(velocity_nwu_m_s=velocity, acceleration_nwu_m_s2=acceleration)
        for target, velocity, acceleration in zip(targets_, velocities, accelerations, strict=True)
    )


def _slopes(times_s: Sequence[float], vectors: Sequence[Vec3]) -> list[Vec3]:
    """At each point the lesser of the slopes to its neighbours, none where they differ in sign: a step stays a step."""
    secants: list[Vec3] = [(0.0, 0.0, 0.0)]
    for (t0, t1), (one, other) in zip(pairwise(times_s), pairwise(vectors), strict=True):
        near = t1 - t0 <= FRESH_US * 1e-6
        x, y, z = ((b - a) / (t1 - t0) if near else 0.0 for a, b in zip(one, other, strict=True))
        secants.append((x, y, z))
    secants.append((0.0, 0.0, 0.0))
    slopes: list[Vec3] = []
    for before, after in pairwise(secants[: len(vectors) + 1]):
        x, y, z = (_lesser(a, b) for a, b in zip(before, after, strict=True))
        slopes.append((x, y, z))
    return slopes


def _lesser(a: float, b: float) -> float:
    if a * b <= 0.0:
        return 0.0
    return math.copysign(min(abs(a), abs(b)), a)
