"""The flight phases of a log: armed and in the air, in one mode, by the vehicle's own HEARTBEAT and EXTENDED_SYS_STATE."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mavquad.analysis.modes import mode_name
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.tlog import TlogContents

_HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_EXTENDED = mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
_ON_GROUND = mavlink.MAV_LANDED_STATE_ON_GROUND
_UNDEFINED = mavlink.MAV_LANDED_STATE_UNDEFINED
LEAST_S = 1.0
"""A phase shorter than this is none: HEARTBEAT tells the mode once a second."""


@dataclass(frozen=True, slots=True)
class FlightPhase:
    """One stretch, s since the log began; `landed_told` is whether the log says when it was on the ground."""

    mode: str
    from_s: float
    to_s: float
    landed_told: bool


@dataclass(frozen=True, slots=True)
class _State:
    at_s: float
    armed: bool
    mode: str
    grounded: bool


def flight_phases(contents: TlogContents, sender: tuple[int, int]) -> tuple[FlightPhase, ...]:
    """The phases of one (system, component), in order."""
    beats: list[tuple[float, Message]] = []
    landed: list[tuple[float, int]] = []
    start_us = contents[0].stamp_us if len(contents) else 0
    for record in contents:
        if frame_source(record.frame) != sender:
            continue
        at_s, number = (record.stamp_us - start_us) * 1e-6, message_id(record.frame)
        if number == _HEARTBEAT:
            beats.append((at_s, decode(record.frame)))
        elif number == _EXTENDED:
            landed.append((at_s, decode(record.frame).landed_state))
    told = [(at_s, state) for at_s, state in landed if state != _UNDEFINED]
    return tuple(_phases(_states(_believed(beats), told), bool(told)))


def _believed(beats: Sequence[tuple[float, Message]]) -> list[tuple[float, Message]]:
    """The HEARTBEATs of the claim that is made most often, one of an autopilot before one of none."""
    claims = Counter((beat.type, beat.autopilot) for _, beat in beats)
    best = max(claims, key=lambda claim: (claim[1] != mavlink.MAV_AUTOPILOT_INVALID, claims[claim]), default=None)
    return [(at_s, beat) for at_s, beat in beats if (beat.type, beat.autopilot) == best]


def _states(beats: Sequence[tuple[float, Message]], landed: Sequence[tuple[float, int]]) -> Iterable[_State]:
    """What was known at each message, in the order of time."""
    armed, mode, grounded = False, "", False
    told = [(at_s, 0, None, state) for at_s, state in landed] + [(at_s, 1, beat, 0) for at_s, beat in beats]
    for at_s, _, beat, state in sorted(told, key=lambda item: item[:2]):
        if beat is None:
            grounded = state == _ON_GROUND
        else:
            armed = bool(beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
            mode = mode_name(beat.autopilot, beat.type, beat.custom_mode)
        yield _State(at_s, armed, mode, grounded)


def _phases(states: Iterable[_State], landed_told: bool) -> Iterable[FlightPhase]:
    begun_s, mode, last_s = 0.0, "", 0.0
    for state in states:
        now = state.mode if state.armed and not state.grounded else ""
        if now != mode:
            if mode and state.at_s - begun_s >= LEAST_S:
                yield FlightPhase(mode, begun_s, state.at_s, landed_told)
            begun_s, mode = state.at_s, now
        last_s = state.at_s
    if mode and last_s - begun_s >= LEAST_S:
        yield FlightPhase(mode, begun_s, last_s, landed_told)
