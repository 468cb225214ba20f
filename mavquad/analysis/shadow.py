"""The extended observer in the shadow of a flight that someone else flew.

Per output (z, yaw, x, y) a chain of two integrators whose input is unknown, hence zero: its sigma is then the whole
acceleration. Fed with positions and headings only, its velocity is held against the log's own, which the autopilot's
estimator made with inertial sensors. Gains follow the data: kappa = 2 / (median spacing), 10 rad/s at most.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any, TypeVar

from mavquad.analysis.metrics import root_mean_square
from mavquad.analysis.poses import HeadingSample, PoseSegment, PoseStream, pose_stream
from mavquad.control.observer import Chain, ChainSpec, rows
from mavquad.frames import unwrap_near
from mavquad.tlog import TlogContents
from mavquad.types import CHANNELS, Position, Vec3, Vec4

T = TypeVar("T")

_LENGTH = 2
_LARGEST_KAPPA_RAD_S = 10.0
_KAPPA_TIMES_SPACING = 2.0
_SETTLING_KAPPA = 8.0
_NO_INPUT: Vec4 = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ShadowTrack:
    """One segment, ready to be plotted: positions by `times_s`, headings by `heading_times_s` (s since the log began).

    NWU throughout: position (m), velocity as the observer has it and as the log has it (m/s), acceleration that the
    observer sees (m/s^2); yaw (rad, continuous) and its rate (rad/s), observer's and log's.
    """

    times_s: tuple[float, ...]
    position_nwu_m: tuple[Vec3, ...]
    velocity_nwu_m_s: tuple[Vec3, ...]
    logged_velocity_nwu_m_s: tuple[Vec3, ...]
    acceleration_nwu_m_s2: tuple[Vec3, ...]
    heading_times_s: tuple[float, ...]
    yaw_rad: tuple[float, ...]
    yaw_rate_rad_s: tuple[float, ...]
    logged_yaw_rate_rad_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Shadow:
    """The observer over a whole log. RMS values leave out the first 8 / kappa seconds of each segment.

    Attributes:
        sender: (system, component) of the vehicle.
        source: message that the positions are from; "" if the log has none.
        position_rate_hz: one over the median spacing of the positions; None without any.
        heading_rate_hz: the same of the headings.
        kappa_rad_s: of the observer of z, x, y; None without positions.
        yaw_kappa_rad_s: of the observer of yaw.
        velocity_rms_m_s: RMS of the velocity estimate minus the log's own, north, west, up.
        logged_speed_rms_m_s: RMS of the log's own speed, as the scale of the former.
        yaw_rate_rms_rad_s: RMS of the yaw rate's estimate minus the log's own.
        skipped: samples not used, by reason.
        tracks: one a segment.
    """

    sender: tuple[int, int]
    source: str
    position_rate_hz: float | None
    heading_rate_hz: float | None
    kappa_rad_s: float | None
    yaw_kappa_rad_s: float | None
    velocity_rms_m_s: tuple[float | None, float | None, float | None]
    logged_speed_rms_m_s: float | None
    yaw_rate_rms_rad_s: float | None
    skipped: dict[str, int]
    tracks: tuple[ShadowTrack, ...]

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`, without the tracks."""
        return {
            "system": self.sender[0],
            "component": self.sender[1],
            "source": self.source,
            "segments": len(self.tracks),
            "poses": sum(len(track.times_s) for track in self.tracks),
            "headings": sum(len(track.heading_times_s) for track in self.tracks),
            "position_rate_hz": self.position_rate_hz,
            "heading_rate_hz": self.heading_rate_hz,
            "kappa_rad_s": self.kappa_rad_s,
            "yaw_kappa_rad_s": self.yaw_kappa_rad_s,
            "velocity_rms_nwu_m_s": list(self.velocity_rms_m_s),
            "logged_speed_rms_m_s": self.logged_speed_rms_m_s,
            "yaw_rate_rms_rad_s": self.yaw_rate_rms_rad_s,
            "skipped": dict(self.skipped),
        }


def shadow(contents: TlogContents, sender: tuple[int, int]) -> Shadow:
    """Run the observer over the poses of one vehicle of a log."""
    return shadow_of_poses(pose_stream(contents, sender), sender)


def shadow_of_poses(stream: PoseStream, sender: tuple[int, int]) -> Shadow:
    """Run the observer over a pose stream."""
    spacing_s = _median_spacing_s([segment.poses for segment in stream.segments])
    heading_spacing_s = _median_spacing_s([segment.headings for segment in stream.segments])
    kappa, yaw_kappa = adapted_kappa_rad_s(spacing_s), adapted_kappa_rad_s(heading_spacing_s)
    tracks = tuple(_track(segment, kappa, yaw_kappa) for segment in stream.segments)
    return Shadow(
        sender=sender,
        source=stream.source,
        position_rate_hz=_inverse(spacing_s),
        heading_rate_hz=_inverse(heading_spacing_s),
        kappa_rad_s=kappa,
        yaw_kappa_rad_s=yaw_kappa,
        velocity_rms_m_s=_velocity_rms(tracks, kappa),
        logged_speed_rms_m_s=root_mean_square([math.hypot(*v) for t in tracks for v in t.logged_velocity_nwu_m_s]),
        yaw_rate_rms_rad_s=_yaw_rate_rms(tracks, yaw_kappa),
        skipped={"repeated": stream.repeated, "backward": stream.backward, "invalid": stream.invalid},
        tracks=tracks,
    )


def adapted_kappa_rad_s(spacing_s: float | None) -> float | None:
    """The observer's gain for a stream of this spacing; None where there is no stream."""
    return None if spacing_s is None else min(_LARGEST_KAPPA_RAD_S, _KAPPA_TIMES_SPACING / spacing_s)


def observe(
    kappa_rad_s: float, channel: int, stamps_us: Sequence[int], outputs: Sequence[float]
) -> list[tuple[float, ...]]:
    """Estimates of one output (m or rad) at each of its stamps: output, rate, acceleration; it starts at rest."""
    if not stamps_us:
        return []
    spec = ChainSpec(_LENGTH, rows(_LENGTH, {0: kappa_rad_s}, spread=1.0))
    commands = ((stamps_us[0], _NO_INPUT),)
    chain = Chain(spec, (outputs[0], 0.0, 0.0), stamps_us[0])
    now_us, estimates = stamps_us[0], [tuple(chain.values)]
    for stamp_us, output in zip(stamps_us[1:], outputs[1:], strict=True):
        if not chain.measured_before(0, stamp_us):
            chain.predict(chain.span(commands, now_us, stamp_us), channel)
            chain.correct(0, output - chain.predicted(0), stamp_us)
            now_us = stamp_us
        estimates.append(tuple(chain.values))
    return estimates


def _track(segment: PoseSegment, kappa: float | None, yaw_kappa: float | None) -> ShadowTrack:
    headings = segment.headings
    by_axis = [_observe_axis(segment.poses, axis, kappa) for axis in range(3)]
    x, y, z = by_axis
    yaw_rad = _continuous([sample.yaw_rad for sample in headings])
    stamps_us = [sample.stamp_us for sample in headings]
    yaw = observe(yaw_kappa, CHANNELS.index("yaw"), stamps_us, yaw_rad) if yaw_kappa else []
    return ShadowTrack(
        times_s=tuple(segment.log_time_s(pose.stamp_us) for pose in segment.poses),
        position_nwu_m=tuple(pose.position_nwu_m for pose in segment.poses),
        velocity_nwu_m_s=tuple((a[1], b[1], c[1]) for a, b, c in zip(x, y, z, strict=True)),
        logged_velocity_nwu_m_s=tuple(pose.velocity_nwu_m_s for pose in segment.poses),
        acceleration_nwu_m_s2=tuple((a[2], b[2], c[2]) for a, b, c in zip(x, y, z, strict=True)),
        heading_times_s=tuple(map(segment.log_time_s, stamps_us)),
        yaw_rad=tuple(yaw_rad),
        yaw_rate_rad_s=tuple(estimate[1] for estimate in yaw),
        logged_yaw_rate_rad_s=tuple(sample.yaw_rate_rad_s for sample in segment.headings),
    )


def _observe_axis(poses: Sequence[Position], axis: int, kappa: float | None) -> list[tuple[float, ...]]:
    if kappa is None:
        return []
    channel = CHANNELS.index("xyz"[axis])
    return observe(kappa, channel, [p.stamp_us for p in poses], [p.position_nwu_m[axis] for p in poses])


def _continuous(angles_rad: Sequence[float]) -> list[float]:
    unwrapped: list[float] = []
    for angle_rad in angles_rad:
        unwrapped.append(unwrap_near(angle_rad, unwrapped[-1]) if unwrapped else angle_rad)
    return unwrapped


def _velocity_rms(
    tracks: Sequence[ShadowTrack], kappa: float | None
) -> tuple[float | None, float | None, float | None]:
    pairs = [
        pair
        for track in tracks
        for pair in _settled(track.times_s, track.velocity_nwu_m_s, track.logged_velocity_nwu_m_s, kappa)
    ]
    north, west, up = (
        root_mean_square([estimated[axis] - logged[axis] for estimated, logged in pairs]) for axis in range(3)
    )
    return (north, west, up)


def _yaw_rate_rms(tracks: Sequence[ShadowTrack], kappa: float | None) -> float | None:
    return root_mean_square(
        [
            estimated - logged
            for track in tracks
            for estimated, logged in _settled(
                track.heading_times_s, track.yaw_rate_rad_s, track.logged_yaw_rate_rad_s, kappa
            )
        ]
    )


def _settled(
    times_s: Sequence[float], estimated: Sequence[T], logged: Sequence[T], kappa: float | None
) -> list[tuple[T, T]]:
    """Pairs of the two from the moment on that the observer has forgotten its start."""
    if kappa is None or not times_s:
        return []
    from_s = times_s[0] + _SETTLING_KAPPA / kappa
    return [(e, v) for time_s, e, v in zip(times_s, estimated, logged, strict=True) if time_s >= from_s]


def _median_spacing_s(stretches: Sequence[Sequence[Position | HeadingSample]]) -> float | None:
    spacings_us = [later.stamp_us - earlier.stamp_us for samples in stretches for earlier, later in pairwise(samples)]
    return median(spacings_us) * 1e-6 if spacings_us else None


def _inverse(value: float | None) -> float | None:
    return None if value is None else 1.0 / value
