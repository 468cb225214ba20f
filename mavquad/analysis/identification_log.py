"""What a log holds for identification: commands sent, what the vehicle did, and when it was following.

Everything is in the wire's frames (FRD, NED) and in seconds since the log began. Commands of ours carry the time at
which the log has them; what the vehicle says carries its own stamp, put on the log's clock.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mavquad.analysis.identification_clock import Clock, Exchange, clock_of
from mavquad.analysis.identification_model import Array
from mavquad.analysis.identification_windows import Span
from mavquad.analysis.survey import survey
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.protocol.firmware.px4 import OFFBOARD, mode_from_custom
from mavquad.tlog import TlogContents
from mavquad.types import Depth, Vec3

REBOOT_S = 1.0
STATE_GAP_S = 3.0
"""HEARTBEAT and EXTENDED_SYS_STATE speak for this long."""
LEAST_HEIGHT_M = 0.5
"""Above where it was last disarmed: PX4 takes a throttle on the ground for a takeoff."""
COMMAND_GAP_S = 0.25
GAPS_OF_SPACING = 5.0
ENTRY_S = 0.5
"""Left out where a stretch begins: what was commanded before still acts."""
LARGEST_TILT_RAD = math.radians(60.0)

_COPTER_GUIDED = (4, 20)  # ArduCopter: GUIDED, GUIDED_NOGPS
_RATES_IGNORED = 0x07
_ATTITUDE_IGNORED = 0x80
_LEAST_COS_PITCH = 1e-3


@dataclass(frozen=True, slots=True)
class Commands:
    """Commands of one kind: log time (s), shape (n,), not decreasing; values about roll, pitch, yaw axis, shape (n, 3).

    Depth torque: normalised, -1..1; rate: rad/s; attitude: Euler angles FRD to NED, rad, continuous.
    """

    times_s: Array
    values: Array

    def spans(self) -> list[Span]:
        """While they flowed."""
        if len(self.times_s) < 2:
            return []
        limit_s = max(COMMAND_GAP_S, GAPS_OF_SPACING * float(np.median(np.diff(self.times_s))))
        parts = np.split(self.times_s, np.flatnonzero(np.diff(self.times_s) > limit_s) + 1)
        return [(float(part[0]), float(part[-1])) for part in parts]


@dataclass(frozen=True, slots=True)
class Answers:
    """ATTITUDE of the vehicle.

    Attributes:
        times_s: its stamps as log time, s, increasing, shape (n,).
        ages_s: how much later each arrived, s, shape (n,).
        angles_rad: Euler angles FRD to NED, continuous, shape (n, 3).
        rates_frd_rad_s: body rates, shape (n, 3).
    """

    times_s: Array
    ages_s: Array
    angles_rad: Array
    rates_frd_rad_s: Array


@dataclass(frozen=True, slots=True)
class FlightData:
    """What identification needs of one vehicle in a log.

    Attributes:
        vehicle: (system, component).
        answers: its ATTITUDE.
        sent: commands sent to it, by depth.
        own: rates that its own controllers asked for (ATTITUDE_TARGET), at its stamps on the log's clock.
        airborne: when it was armed and not on the ground, as far as the log says.
        offboard: when it was, moreover, in the mode that takes commands.
        round_trip_s: median round trip of TIMESYNC; None if the clocks are aligned by arrivals.
        boots: how often the vehicle started anew, its first start included.
    """

    vehicle: tuple[int, int]
    answers: Answers
    sent: dict[Depth, Commands]
    own: Commands
    airborne: list[Span]
    offboard: list[Span]
    round_trip_s: float | None
    boots: int


def flight_data(contents: TlogContents) -> FlightData | None:
    """Collect it of the log's main vehicle; None if there is no vehicle."""
    vehicle = survey(contents).main_vehicle()
    if vehicle is None:
        return None
    collected = _Collected(vehicle.sender, vehicle.autopilot)
    start_us = min(contents[index].stamp_us for index in range(len(contents)))
    for record in contents:
        collected.take((record.stamp_us - start_us) * 1e-6, record.frame)
    return collected.finish()


def intersection(one: Sequence[Span], other: Sequence[Span]) -> list[Span]:
    """What is in both; spans in order, s."""
    return [
        (max(a, c), min(b, d)) for a, b in one for c, d in other if max(a, c) < min(b, d)
    ]  # fmt: skip


def without_entry(spans: Iterable[Span]) -> list[Span]:
    """Each span without its first moments."""
    return [(from_s + ENTRY_S, to_s) for from_s, to_s in spans if to_s > from_s + ENTRY_S]


@dataclass(slots=True)
class _Boot:
    """What came between two starts of the vehicle: arrival (s), stamp (s) and values of each message."""

    attitudes: list[tuple[float, float, tuple[float, ...]]] = field(default_factory=list)
    own: list[tuple[float, float, Vec3]] = field(default_factory=list)
    exchanges: list[Exchange] = field(default_factory=list)


class _Collected:
    """One pass over the log."""

    def __init__(self, vehicle: tuple[int, int], autopilot: str) -> None:
        self._vehicle = vehicle
        self._autopilot = autopilot
        self._boots = [_Boot()]
        self._sent: dict[Depth, list[tuple[float, Vec3]]] = {"torque": [], "rate": [], "attitude": []}
        self._asked_s: dict[int, float] = {}
        self._modes: list[tuple[float, bool, bool]] = []
        self._landed: list[tuple[float, bool]] = []
        self._high: list[tuple[float, bool]] = []
        self._ground_ned_m: float | None = None  # where it last was disarmed

    def take(self, time_s: float, frame: bytes) -> None:
        """One frame."""
        number, own = message_id(frame), frame_source(frame) == self._vehicle
        readers = _OF_VEHICLE if own else _OF_OTHERS
        if number in readers:
            readers[number](self, time_s, decode(frame))

    def attitude(self, time_s: float, message: Message) -> None:
        angles = (message.roll, message.pitch, message.yaw)
        values = (*angles, message.rollspeed, message.pitchspeed, message.yawspeed)
        if not all(map(math.isfinite, values)):
            return
        stamp_s = message.time_boot_ms * 1e-3
        past = self._boots[-1].attitudes
        if past and stamp_s < past[-1][1] - REBOOT_S:
            self._boots.append(_Boot())
        elif past and stamp_s <= past[-1][1]:
            return
        self._boots[-1].attitudes.append((time_s, stamp_s, values))

    def own_target(self, time_s: float, message: Message) -> None:
        rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        past = self._boots[-1].own
        stamp_s = message.time_boot_ms * 1e-3
        if all(map(math.isfinite, rates)) and not (past and stamp_s <= past[-1][1]):
            past.append((time_s, stamp_s, rates))

    def heartbeat(self, time_s: float, message: Message) -> None:
        entry = mavlink.enums["MAV_AUTOPILOT"].get(message.autopilot)
        if entry is None or entry.name != self._autopilot:
            return  # forged, or another vehicle with the same ids
        armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self._modes.append((time_s, armed, armed and _takes_commands(message)))

    def position(self, time_s: float, message: Message) -> None:
        if not math.isfinite(message.z):
            return
        if not (self._modes and self._modes[-1][1]):
            self._ground_ned_m = message.z
        elif self._ground_ned_m is not None:
            self._high.append((time_s, self._ground_ned_m - message.z > LEAST_HEIGHT_M))

    def landed(self, time_s: float, message: Message) -> None:
        self._landed.append((time_s, message.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND))

    def question(self, time_s: float, message: Message) -> None:
        if message.tc1 == 0:
            self._asked_s[message.ts1] = time_s

    def answered(self, time_s: float, message: Message) -> None:
        sent_s = self._asked_s.pop(message.ts1, None) if message.tc1 else None
        if sent_s is not None and time_s >= sent_s:
            self._boots[-1].exchanges.append(Exchange(sent_s, time_s, message.tc1 * 1e-9))

    def torque(self, time_s: float, message: Message) -> None:
        if message.group_mlx == 0 and self._is_addressed(message):
            self._add("torque", time_s, tuple(message.controls[:3]))

    def attitude_setpoint(self, time_s: float, message: Message) -> None:
        if not self._is_addressed(message):
            return
        ignored = message.type_mask & (_RATES_IGNORED | _ATTITUDE_IGNORED)
        if ignored == _ATTITUDE_IGNORED:
            self._add("rate", time_s, (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate))
        elif ignored == _RATES_IGNORED:
            self._add("attitude", time_s, _euler_frd_ned(message.q))

    def _is_addressed(self, message: Message) -> bool:
        return message.target_system in (0, self._vehicle[0])

    def _add(self, depth: Depth, time_s: float, values: tuple[float, ...]) -> None:
        if all(map(math.isfinite, values)):
            self._sent[depth].append((time_s, (values[0], values[1], values[2])))

    def finish(self) -> FlightData:
        """Everything on the log's clock."""
        boots = [boot for boot in self._boots if boot.attitudes]
        clocks = [_clock(boot) for boot in boots]
        airborne = [(time_s, armed) for time_s, armed, _ in self._modes]
        offboard = [(time_s, follows) for time_s, _, follows in self._modes]
        flying = intersection(_spans(self._landed), _spans(self._high))
        trips_s = [clock.round_trip_s for clock in clocks if clock.round_trip_s is not None]
        return FlightData(
            vehicle=self._vehicle,
            answers=_answers(boots, clocks),
            sent={depth: _commands(found, depth == "attitude") for depth, found in self._sent.items() if found},
            own=_own(boots, clocks),
            airborne=intersection(_spans(airborne), flying),
            offboard=intersection(_spans(offboard), flying),
            round_trip_s=float(np.median(trips_s)) if len(trips_s) == len(clocks) and trips_s else None,
            boots=len(boots),
        )


_OF_VEHICLE = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _Collected.attitude,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: _Collected.own_target,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _Collected.position,
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: _Collected.heartbeat,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: _Collected.landed,
    mavlink.MAVLINK_MSG_ID_TIMESYNC: _Collected.answered,
}
_OF_OTHERS = {
    mavlink.MAVLINK_MSG_ID_TIMESYNC: _Collected.question,
    mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: _Collected.torque,
    mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: _Collected.attitude_setpoint,
}


def _takes_commands(heartbeat: Message) -> bool:
    """Whether the mode obeys setpoints; of an autopilot that is neither PX4 nor ArduPilot it is not known: yes."""
    if heartbeat.autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return mode_from_custom(heartbeat.custom_mode) == OFFBOARD
    if heartbeat.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return heartbeat.custom_mode in _COPTER_GUIDED
    return True


def _spans(states: Sequence[tuple[float, bool]]) -> list[Span]:
    """From one report to the next where both say yes; without any report, always."""
    if not states:
        return [(-math.inf, math.inf)]
    spans: list[Span] = []
    for (from_s, before), (to_s, after) in pairwise(states):
        if not (before and after and 0.0 < to_s - from_s <= STATE_GAP_S):
            continue
        if spans and spans[-1][1] == from_s:
            spans[-1] = (spans[-1][0], to_s)
        else:
            spans.append((from_s, to_s))
    return spans


def _euler_frd_ned(q: Sequence[float]) -> Vec3:
    """Euler angles ZYX of a quaternion FRD to NED of any length, rad; NaN without a direction or a heading."""
    length = math.hypot(*q)
    if not (math.isfinite(length) and length > 0.0):
        return (math.nan, math.nan, math.nan)
    w, x, y, z = (part / length for part in q)
    sin_pitch = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    if 1.0 - sin_pitch * sin_pitch < _LEAST_COS_PITCH**2:
        return (math.nan, math.nan, math.nan)
    roll_rad = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return (roll_rad, math.asin(sin_pitch), yaw_rad)


def _clock(boot: _Boot) -> Clock:
    arrivals_s = np.array([arrival_s for arrival_s, _, _ in boot.attitudes])
    return clock_of(np.array([stamp_s for _, stamp_s, _ in boot.attitudes]), arrivals_s, boot.exchanges)


def _answers(boots: Sequence[_Boot], clocks: Sequence[Clock]) -> Answers:
    times_s, arrivals_s, values = _merged([boot.attitudes for boot in boots], clocks, 6)
    upright = np.all(np.abs(values[:, :2]) < LARGEST_TILT_RAD, axis=1)
    angles_rad = np.unwrap(values[upright, :3], axis=0)
    return Answers(times_s[upright], (arrivals_s - times_s)[upright], angles_rad, values[upright, 3:])


def _own(boots: Sequence[_Boot], clocks: Sequence[Clock]) -> Commands:
    times_s, _, values = _merged([boot.own for boot in boots], clocks, 3)
    return Commands(times_s, values)


def _merged(
    found: Sequence[Sequence[tuple[float, float, tuple[float, ...]]]], clocks: Sequence[Clock], width: int
) -> tuple[Array, Array, Array]:
    """Log time of the stamps, arrivals and values of all boots, in order of log time."""
    samples = [np.array([(stamp_s, arrival_s, *values) for arrival_s, stamp_s, values in part]) for part in found]
    pairs = [(part, clock) for part, clock in zip(samples, clocks, strict=True) if len(part)]
    if not pairs:
        return np.zeros(0), np.zeros(0), np.zeros((0, width))
    times_s = np.concatenate([clock.log_time_s(part[:, 0]) for part, clock in pairs])
    rows = np.concatenate([part for part, _ in pairs])
    increasing = np.flatnonzero(times_s > np.concatenate(([-np.inf], np.maximum.accumulate(times_s)[:-1])))
    return times_s[increasing], rows[increasing, 1], rows[increasing, 2:]


def _commands(found: Sequence[tuple[float, Vec3]], are_angles: bool) -> Commands:
    ordered = sorted(found, key=lambda command: command[0])
    values = np.array([values for _, values in ordered])
    return Commands(np.array([time_s for time_s, _ in ordered]), np.unwrap(values, axis=0) if are_angles else values)
