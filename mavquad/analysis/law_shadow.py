"""The law in the shadow of a flight that someone else flew: observer and law, phase by phase, open loop.

The law sees the log's positions and attitudes, not its velocities, whatever their rate, and is asked for a command at each
position; what acted instead is the motion that was measured (`mavquad.analysis.open_loop`). Its reference is the autopilot's
own position target while the log has one: then both pursue the same. Without one it is the place where the phase began, or
where the last target lapsed: nobody knows what was meant, and to stay is the one thing that can be asked anywhere. So the
setpoints of a phase that flew away without a target say what it would have taken to come back.

Held against the log: velocity against the autopilot's own; the disturbance (acceleration that is not the thrust's) against
what the autopilot's own velocity amounts to, over half a second; setpoints against its ATTITUDE_TARGET, and against the
motion that was measured.
"""

from __future__ import annotations

import heapq
import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

from mavquad.analysis.metrics import root_mean_square
from mavquad.analysis.open_loop import Motion, OpenLoop
from mavquad.analysis.phases import FlightPhase, flight_phases
from mavquad.analysis.poses import PoseSegment, PoseStream, pose_stream
from mavquad.analysis.rate_verdict import Judge, Spacing, Verdict, spacing
from mavquad.analysis.targets import (
    Targets,
    holding,
    hover_thrust,
    reference_point,
    targets,
    thrusts,
)
from mavquad.control.euler import trig
from mavquad.control.inversion import to_world
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import Tuning, tuning
from mavquad.flight.guards import GuardParams, tilt_rad
from mavquad.frames import wrap_pi
from mavquad.protocol.codec import decode, frame_source, mavlink, message_id
from mavquad.protocol.firmware import ARDUCOPTER, PX4, Version
from mavquad.tlog import TlogContents
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    Depth,
    LawCommand,
    Position,
    RateCommand,
    ReferencePoint,
    Vec3,
)

SETTLING_S = 2.0
"""The observer starts from the log's own velocity; the first seconds of a phase are left out of its figures."""
WINDOW_US = 500_000
_LEAST_POSES = 5
_VERSION = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
_SETPOINTS = {
    "attitude": ("roll", "pitch", "yaw", "thrust"),
    "rate": ("roll rate", "pitch rate", "yaw rate"),
    "torque": ("roll acceleration", "pitch acceleration", "yaw acceleration"),
}
_UNITS = {"attitude": ("rad", "rad", "rad", "m/s²"), "rate": ("rad/s",) * 3, "torque": ("rad/s²",) * 3}
Numbers = tuple[float, ...]


@dataclass(slots=True)
class LawTrack:
    """One phase's steps, one entry a position; `times_s` since the log began. World NWU, body FLU.

    Attributes:
        times_s: of the positions.
        position_nwu_m: as logged.
        reference_nwu_m: what the law was to pursue.
        velocity_nwu_m_s: the observer's.
        logged_velocity_nwu_m_s: the autopilot's own.
        disturbance_nwu_m_s2: the observer's: the acceleration that is not the thrust's.
        setpoints: what the law would have sent; see `names`.
        moved: the measured motion as such setpoints.
        own: the autopilot's own; None where it told none.
        limits: how often each limit was active.
    """

    times_s: list[float] = field(default_factory=list)
    position_nwu_m: list[Vec3] = field(default_factory=list)
    reference_nwu_m: list[Vec3] = field(default_factory=list)
    velocity_nwu_m_s: list[Vec3] = field(default_factory=list)
    logged_velocity_nwu_m_s: list[Vec3] = field(default_factory=list)
    disturbance_nwu_m_s2: list[Vec3] = field(default_factory=list)
    setpoints: list[Numbers] = field(default_factory=list)
    moved: list[Numbers] = field(default_factory=list)
    own: list[Numbers | None] = field(default_factory=list)
    limits: list[tuple[str, ...]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ShadowPhase:
    """One flight phase. RMS values leave out its first seconds; None where there is nothing to tell.

    Attributes:
        phase: mode and time.
        positions: spacing of the positions.
        attitudes: of the attitudes.
        verdicts: of each depth: would this data have done?
        depth: of the setpoints.
        reference: what the law was to pursue, in words.
        away_m: the farthest that the vehicle was from it.
        velocity_rms_m_s: estimate minus the autopilot's own; north, west, up.
        disturbance_mean_m_s2: the estimate; north, west, up.
        disturbance_rms_m_s2: estimate minus what the autopilot's own velocity amounts to, over half a second.
        moved_rms: setpoints minus the measured motion.
        own_rms: setpoints minus the autopilot's own.
        limits: share of the steps at each limit.
        track: the steps.
    """

    phase: FlightPhase
    positions: Spacing
    attitudes: Spacing
    verdicts: tuple[Verdict, ...]
    depth: Depth
    reference: str
    away_m: float | None
    velocity_rms_m_s: tuple[float | None, ...]
    disturbance_mean_m_s2: tuple[float | None, ...]
    disturbance_rms_m_s2: tuple[float | None, ...]
    moved_rms: tuple[float | None, ...]
    own_rms: tuple[float | None, ...]
    limits: dict[str, float]
    track: LawTrack

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`, without the track."""
        names = [f"{name} ({unit})" for name, unit in zip(_SETPOINTS[self.depth], _UNITS[self.depth], strict=True)]
        return {
            "mode": self.phase.mode,
            "from_s": self.phase.from_s,
            "to_s": self.phase.to_s,
            "position_hz": self.positions.rate_hz,
            "attitude_hz": self.attitudes.rate_hz,
            "positions": self.positions.count,
            "attitudes": self.attitudes.count,
            "longest_gap_s": max((*self.positions.gaps_s[:1], *self.attitudes.gaps_s[:1]), default=None),
            "verdicts": {verdict.depth: verdict.to_json() for verdict in self.verdicts},
            "depth": self.depth,
            "reference": self.reference,
            "away_m": self.away_m,
            "velocity_rms_nwu_m_s": list(self.velocity_rms_m_s),
            "disturbance_mean_nwu_m_s2": list(self.disturbance_mean_m_s2),
            "disturbance_rms_nwu_m_s2": list(self.disturbance_rms_m_s2),
            "setpoint_minus_motion_rms": dict(zip(names, self.moved_rms, strict=True)),
            "setpoint_minus_own_rms": dict(zip(names, self.own_rms, strict=True)),
            "limits": self.limits,
        }


@dataclass(frozen=True, slots=True)
class LawShadow:
    """The law over all flight phases of one vehicle of a log.

    Attributes:
        sender: (system, component).
        source: message of the positions; "" without any.
        attitude_source: message of the attitudes.
        target_source: message of the position targets; "" without any.
        hover_thrust_norm: the thrust that carries the weight, by ATTITUDE_TARGET; None where the log does not tell it: the
            thrust is then taken to hold the hover, and what it does besides is a disturbance of z.
        takes: the depths at which this autopilot takes commands, whatever the data; by AUTOPILOT_VERSION, if the log has it.
        phases: in order.
    """

    sender: tuple[int, int]
    source: str
    attitude_source: str
    target_source: str
    hover_thrust_norm: float | None
    takes: tuple[Depth, ...]
    phases: tuple[ShadowPhase, ...]

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`."""
        return {
            "system": self.sender[0],
            "component": self.sender[1],
            "source": self.source,
            "attitude_source": self.attitude_source,
            "target_source": self.target_source,
            "hover_thrust_norm": self.hover_thrust_norm,
            "takes": list(self.takes),
            "phases": [phase.to_json() for phase in self.phases],
        }


def setpoint_names(depth: Depth) -> tuple[tuple[str, str], ...]:
    """Names and units of the setpoints of a depth, in their order."""
    return tuple(zip(_SETPOINTS[depth], _UNITS[depth], strict=True))


def law_shadow(contents: TlogContents, sender: tuple[int, int], law: LawParams, guards: GuardParams) -> LawShadow:
    """Put the law beside every flight phase of one (system, component).

    Args:
        contents: the log.
        sender: the vehicle.
        law: what flies in its shadow. Its depth "auto" is attitude: what the setpoints of every autopilot can be held
            against, at any rate of data. Its measurements "auto" are position and attitude: the log's velocity is what the
            observer's is held against. Its friction "auto" is none: nobody told it the vehicle's, sigma finds it.
        guards: of which those on old poses count.
    """
    stream = pose_stream(contents, sender)
    aims = targets(contents, sender, stream.geodetic)
    hover = _hover(stream, aims)
    depth: Depth = "attitude" if law.depth == "auto" else law.depth
    shadow_law = _in_shadow(law)
    tune, judge = tuning(shadow_law, depth), Judge(law, guards)
    flown = _Flown(stream, aims, hover, shadow_law, depth, tune, judge)
    phases = tuple(flown.phase(phase) for phase in flight_phases(contents, sender))
    takes = (ARDUCOPTER if law.autopilot == "arducopter" else PX4).depths(_version(contents, sender))
    return LawShadow(sender, stream.source, stream.attitude_source, aims.source, hover, takes, phases)


def _version(contents: TlogContents, sender: tuple[int, int]) -> Version:
    """The release that flies it; zeros where the log does not tell."""
    for record in contents:
        if message_id(record.frame) == _VERSION and frame_source(record.frame) == sender:
            number = decode(record.frame).flight_sw_version
            return number >> 24, number >> 16 & 0xFF, number >> 8 & 0xFF
    return 0, 0, 0


def _in_shadow(law: LawParams) -> LawParams:
    update: dict[str, Any] = {}
    if law.measurements == "auto":
        update["measurements"] = "position_attitude"
    if law.friction_1_s is None:
        update["friction_1_s"] = 0.0
    return law.model_copy(update=update)


def _hover(stream: PoseStream, aims: Targets) -> float | None:
    """Of the segment that tells it: stamps count anew in each."""
    found = (hover_thrust(aims.attitudes, segment.poses, segment.attitudes) for segment in stream.segments)
    return next((norm for norm in found if norm is not None), None)


@dataclass(frozen=True, slots=True)
class _Flown:
    """What is the same for all phases."""

    stream: PoseStream
    aims: Targets
    hover_norm: float | None
    law: LawParams
    depth: Depth
    tune: Tuning
    judge: Judge

    def phase(self, phase: FlightPhase) -> ShadowPhase:
        segment, poses, attitudes = self._within(phase)
        track, reference = LawTrack(), ""
        if segment is not None and len(poses) >= _LEAST_POSES and len(attitudes) >= _LEAST_POSES:
            run = _Run(self, segment, poses, attitudes)
            run.into(track)
            reference = self._reference_words(run.followed / len(poses))
        positions, turns = (spacing([item.stamp_us for item in items]) for items in (poses, attitudes))
        settled = [i for i, time_s in enumerate(track.times_s) if time_s - track.times_s[0] >= SETTLING_S]
        return ShadowPhase(
            phase=phase,
            positions=positions,
            attitudes=turns,
            verdicts=self.judge.verdicts(positions, turns),
            depth=self.depth,
            reference=reference,
            away_m=max(
                (math.dist(a, b) for a, b in zip(track.position_nwu_m, track.reference_nwu_m, strict=True)),
                default=None,
            ),
            velocity_rms_m_s=_rms(track.velocity_nwu_m_s, track.logged_velocity_nwu_m_s, settled, 3),
            disturbance_mean_m_s2=_mean(track.disturbance_nwu_m_s2, settled),
            disturbance_rms_m_s2=self._disturbance_rms(track, poses, attitudes),
            moved_rms=_rms(track.setpoints, track.moved, settled, len(_SETPOINTS[self.depth])),
            own_rms=_rms(track.setpoints, track.own, settled, len(_SETPOINTS[self.depth])),
            limits=_shares(track.limits),
            track=track,
        )

    def _reference_words(self, followed: float) -> str:
        if followed == 0.0:
            return "hold where the phase begins"
        return self.aims.source if followed == 1.0 else f"{self.aims.source} ({followed:.0%}), else hold"

    def _within(self, phase: FlightPhase) -> tuple[PoseSegment | None, list[Position], list[Attitude]]:
        """The segment that has most of the phase, and its samples in it."""
        best: tuple[PoseSegment | None, list[Position], list[Attitude]] = (None, [], [])
        for segment in self.stream.segments:
            poses = [p for p in segment.poses if phase.from_s <= segment.log_time_s(p.stamp_us) <= phase.to_s]
            attitudes = [a for a in segment.attitudes if phase.from_s <= segment.log_time_s(a.stamp_us) <= phase.to_s]
            if len(poses) + len(attitudes) > len(best[1]) + len(best[2]):
                best = (segment, poses, attitudes)
        return best

    def thrusts(self) -> list[tuple[int, float]]:
        """Thrust per mass as commanded; empty where that is not told."""
        return thrusts(self.aims.attitudes, self.hover_norm)

    def _disturbance_rms(
        self, track: LawTrack, poses: Sequence[Position], attitudes: Sequence[Attitude]
    ) -> tuple[float | None, ...]:
        """The means of both over windows, so that the noise of a difference quotient does not decide."""
        if not track.times_s:
            return (None,) * 3
        pushes = _Means(*_pushes(attitudes, Motion(attitudes, self.thrusts()), self.tune))
        seen = _Means([pose.stamp_us for pose in poses], track.disturbance_nwu_m_s2)
        pairs: list[tuple[Vec3, Vec3]] = []
        first_us = poses[0].stamp_us + round(SETTLING_S * 1e6)
        for start, end in _windows(poses, first_us):
            push, estimate = pushes.between(start.stamp_us, end.stamp_us), seen.between(start.stamp_us, end.stamp_us)
            if push is not None and estimate is not None:
                dt_s = (end.stamp_us - start.stamp_us) * 1e-6
                x, y, z = (
                    (b - a) / dt_s - c
                    for a, b, c in zip(start.velocity_nwu_m_s, end.velocity_nwu_m_s, push, strict=True)
                )
                pairs.append((estimate, (x, y, z)))
        return tuple(root_mean_square([one[axis] - other[axis] for one, other in pairs]) for axis in range(3))


class _Run:
    """The open loop through one phase.

    Attributes:
        followed: steps with a target of the autopilot's own.
    """

    def __init__(
        self,
        flown: _Flown,
        segment: PoseSegment,
        poses: Sequence[Position],
        attitudes: Sequence[Attitude],
    ) -> None:
        self._flown, self._segment = flown, segment
        self._poses, self._attitudes = poses, attitudes
        self.followed = 0
        self._motion = Motion(attitudes, flown.thrusts())
        self._attitude = attitudes[0]
        self._held: Callable[[int], ReferencePoint] | None = None

    def into(self, track: LawTrack) -> None:
        """Fill the track."""
        first, law = self._poses[0], self._flown.law
        before = [attitude for attitude in self._attitudes if attitude.stamp_us <= first.stamp_us]
        self._attitude = before[-1] if before else self._attitudes[0]
        trim_m_s2 = GRAVITY_M_S2 / max(math.cos(tilt_rad(self._attitude)), 0.3)
        controller = OpenLoop(law, self._flown.depth, first, self._attitude, trim_m_s2)
        for sample in self._samples():
            if isinstance(sample, Attitude):
                self._attitude = sample
                controller.observe_attitude(sample)
            else:
                controller.observe_position(sample)
                self._step(controller, sample, track)

    def _samples(self) -> Iterator[Attitude | Position]:
        """In the order of their stamps; of the same stamp the attitude first."""
        streams: tuple[Sequence[Attitude | Position], ...] = (self._attitudes, self._poses)
        return heapq.merge(*streams, key=lambda sample: sample.stamp_us)

    def _step(self, controller: OpenLoop, pose: Position, track: LawTrack) -> None:
        asked = controller.command(self._reference(pose))
        trace = controller.trace
        assert trace is not None
        acted = controller.instead(self._motion.acted(self._flown.tune, controller.arrives_us))
        z, _, x, y = controller.estimator.values()
        rz, _, rx, ry = trace.reference
        track.times_s.append(self._segment.log_time_s(pose.stamp_us))
        track.position_nwu_m.append(pose.position_nwu_m)
        track.reference_nwu_m.append((rx, ry, rz))
        track.velocity_nwu_m_s.append((x[1], y[1], z[1]))
        track.logged_velocity_nwu_m_s.append(pose.velocity_nwu_m_s)
        track.disturbance_nwu_m_s2.append(trace.wind)
        track.setpoints.append(_numbers(asked))
        track.moved.append(_numbers(acted))
        track.own.append(self._own(controller.arrives_us))
        track.limits.append(trace.limits_active)

    def _reference(self, pose: Position) -> Callable[[int], ReferencePoint]:
        target, yaw_rad = self._flown.aims.position_at(pose.stamp_us), self._attitude.yaw_rad
        if target is not None:
            self.followed += 1
            self._held = None
            return lambda stamp_us: reference_point(target, stamp_us, yaw_rad)
        if self._held is None:
            self._held = holding(pose, yaw_rad)
        return self._held

    def _own(self, arrive_us: int) -> Numbers | None:
        target = self._flown.aims.attitude_at(arrive_us)
        if target is None or self._flown.depth == "torque":
            return None
        if self._flown.depth == "rate":
            return target.rates_flu_rad_s
        thrust = (
            math.nan if self._flown.hover_norm is None else target.thrust_norm * GRAVITY_M_S2 / self._flown.hover_norm
        )
        return (*target.euler_rad, thrust)


def _numbers(command: LawCommand) -> Numbers:
    if isinstance(command, AttitudeCommand):
        return command
    return command.rates_flu_rad_s if isinstance(command, RateCommand) else command.angular_acceleration_flu_rad_s2


# ---------------------------------------------------------------------- figures of a phase


def _rms(
    ones: Sequence[Sequence[float]], others: Sequence[Sequence[float] | None], kept: Sequence[int], width: int
) -> tuple[float | None, ...]:
    """RMS of one minus the other, by column; angles of yaw come wrapped."""
    pairs = [(ones[i], other) for i in kept if (other := others[i]) is not None]
    return tuple(
        root_mean_square([_difference(one[k] - other[k], width == 4 and k == 2) for one, other in pairs])
        for k in range(width)
    )


def _difference(value: float, is_yaw: bool) -> float:
    return wrap_pi(value) if is_yaw else value


def _mean(vectors: Sequence[Vec3], kept: Sequence[int]) -> tuple[float | None, ...]:
    if not kept:
        return (None,) * 3
    return tuple(math.fsum(vectors[i][axis] for i in kept) / len(kept) for axis in range(3))


def _shares(limits: Sequence[tuple[str, ...]]) -> dict[str, float]:
    names = sorted({name for active in limits for name in active})
    return {name: sum(name in active for active in limits) / len(limits) for name in names}


def _pushes(attitudes: Sequence[Attitude], motion: Motion, tune: Tuning) -> tuple[list[int], list[Vec3]]:
    """T r3 - g e3 at each attitude; the thrust acts its lag after the command."""
    lag_us = round(tune.vertical.spec.lag_s * 1e6)
    pushes: list[Vec3] = []
    for attitude in attitudes:
        thrust, _ = motion.thrust(attitude.stamp_us - lag_us)
        turned = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
        x, y, z = to_world(turned, (0.0, 0.0, thrust))
        pushes.append((x, y, z - GRAVITY_M_S2))
    return [attitude.stamp_us for attitude in attitudes], pushes


class _Means:
    """Means of vectors between two stamps."""

    def __init__(self, stamps_us: Sequence[int], vectors: Sequence[Vec3]) -> None:
        self._stamps_us = stamps_us
        self._sums = [[0.0, *accumulate(vector[axis] for vector in vectors)] for axis in range(3)]

    def between(self, from_us: int, to_us: int) -> Vec3 | None:
        """None where there is none."""
        low, high = bisect_left(self._stamps_us, from_us), bisect_right(self._stamps_us, to_us)
        if high <= low:
            return None
        x, y, z = ((sums[high] - sums[low]) / (high - low) for sums in self._sums)
        return (x, y, z)


def _windows(poses: Sequence[Position], from_us: int) -> Iterator[tuple[Position, Position]]:
    """Pairs half a second apart, or one sample apart where that is more, one behind the other."""
    start: Position | None = None
    for pose in poses:
        if pose.stamp_us < from_us:
            continue
        if start is None:
            start = pose
        elif pose.stamp_us - start.stamp_us >= WINDOW_US:
            if pose.stamp_us - start.stamp_us <= 4 * WINDOW_US:
                yield start, pose
            start = pose
