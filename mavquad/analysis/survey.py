"""Who is in a log: every sender, what it is, what it sent and how often, and when it was armed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from mavquad.protocol.codec import decode, frame_source, mavlink, message_id
from mavquad.tlog import TlogContents

Sender = tuple[int, int]
"""(system id, component id)."""

_POSE_NAMES = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")


@dataclass(frozen=True, slots=True)
class MessageCount:
    """How often one sender sent one message; `rate_hz` is the mean over the time from its first to its last."""

    name: str
    count: int
    rate_hz: float | None


@dataclass(frozen=True, slots=True)
class ArmedSpan:
    """From the first HEARTBEAT that says armed to the first that does not, or the last one; s since the log began."""

    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class SenderSurvey:
    """One component of one system.

    Attributes:
        sender: (system id, component id).
        vehicle_type: MAV_TYPE name from HEARTBEAT, "" if it sent none.
        autopilot: MAV_AUTOPILOT name from HEARTBEAT, "" if it sent none.
        contradicting_heartbeats: HEARTBEATs under the same ids that claim another type or autopilot (another vehicle
            with the same ids, or a forger); the most frequent claim to be an autopilot is believed.
        frames: its frames in the log.
        messages: its messages, the most frequent first.
        armed_spans: when it was armed.
    """

    sender: Sender
    vehicle_type: str
    autopilot: str
    contradicting_heartbeats: int
    frames: int
    messages: tuple[MessageCount, ...]
    armed_spans: tuple[ArmedSpan, ...]

    @property
    def is_vehicle(self) -> bool:
        """Whether it says that it is an autopilot."""
        return self.autopilot not in ("", "MAV_AUTOPILOT_INVALID")

    def count(self, name: str) -> int:
        """How many messages of that name it sent."""
        return next((message.count for message in self.messages if message.name == name), 0)


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a log. `duration_s` goes from its earliest to its latest stamp; stamps are Unix us."""

    frames: int
    unknown_frames: int
    bad_bytes: int
    bad_ranges: tuple[tuple[int, int], ...]
    first_stamp_us: int
    duration_s: float
    backward_stamps: int
    senders: tuple[SenderSurvey, ...]

    def main_vehicle(self) -> SenderSurvey | None:
        """The sender of the most pose messages; without any, the autopilot (or whoever) with the most frames."""
        return max(
            self.senders,
            key=lambda sender: (sum(map(sender.count, _POSE_NAMES)), sender.is_vehicle, sender.frames),
            default=None,
        )

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`."""
        return {
            "frames": self.frames,
            "unknown_frames": self.unknown_frames,
            "bad_bytes": self.bad_bytes,
            "bad_ranges": [list(bad_range) for bad_range in self.bad_ranges],
            "first_stamp_us": self.first_stamp_us,
            "duration_s": self.duration_s,
            "backward_stamps": self.backward_stamps,
            "senders": [_sender_json(survey) for survey in self.senders],
        }


@dataclass(slots=True)
class _Tally:
    """What one pass over the log collects of one sender."""

    counts: Counter[int] = field(default_factory=Counter)
    first_us: dict[int, int] = field(default_factory=dict)
    last_us: dict[int, int] = field(default_factory=dict)
    heartbeats: list[tuple[int, Any]] = field(default_factory=list)

    def add(self, stamp_us: int, frame: bytes) -> None:
        number = message_id(frame)
        self.counts[number] += 1
        self.first_us.setdefault(number, stamp_us)
        self.last_us[number] = stamp_us
        if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self.heartbeats.append((stamp_us, decode(frame)))


def survey(contents: TlogContents) -> Survey:
    """Go once through a log."""
    tallies: dict[Sender, _Tally] = {}
    stamps_us: list[int] = []
    for record in contents:
        stamps_us.append(record.stamp_us)
        tallies.setdefault(frame_source(record.frame), _Tally()).add(record.stamp_us, record.frame)
    first_us = min(stamps_us, default=0)
    return Survey(
        frames=len(contents),
        unknown_frames=contents.unknown_frames,
        bad_bytes=contents.bad_bytes,
        bad_ranges=tuple(contents.bad_ranges),
        first_stamp_us=first_us,
        duration_s=(max(stamps_us, default=0) - first_us) * 1e-6,
        backward_stamps=sum(later < earlier for earlier, later in pairwise(stamps_us)),
        senders=tuple(_survey_sender(sender, tally, first_us) for sender, tally in sorted(tallies.items())),
    )


def _survey_sender(sender: Sender, tally: _Tally, log_start_us: int) -> SenderSurvey:
    believed = _believed_claim(tally)
    honest = [(at, beat) for at, beat in tally.heartbeats if (beat.type, beat.autopilot) == believed]
    return SenderSurvey(
        sender=sender,
        vehicle_type=_enum_name("MAV_TYPE", believed[0]) if believed else "",
        autopilot=_enum_name("MAV_AUTOPILOT", believed[1]) if believed else "",
        contradicting_heartbeats=len(tally.heartbeats) - len(honest),
        frames=tally.counts.total(),
        messages=tuple(_message_count(tally, number) for number, _ in tally.counts.most_common()),
        armed_spans=tuple(_armed_spans(honest, log_start_us)),
    )


def _believed_claim(tally: _Tally) -> tuple[int, int] | None:
    """The (type, autopilot) that most HEARTBEATs claim; one that names an autopilot goes before one that does not."""
    claims = Counter((heartbeat.type, heartbeat.autopilot) for _, heartbeat in tally.heartbeats)
    return max(claims, key=lambda claim: (claim[1] != mavlink.MAV_AUTOPILOT_INVALID, claims[claim]), default=None)


def _message_count(tally: _Tally, number: int) -> MessageCount:
    count = tally.counts[number]
    span_s = (tally.last_us[number] - tally.first_us[number]) * 1e-6
    rate_hz = (count - 1) / span_s if count > 1 and span_s > 0.0 else None
    return MessageCount(mavlink.mavlink_map[number].msgname, count, rate_hz)


def _armed_spans(heartbeats: Sequence[tuple[int, Any]], log_start_us: int) -> Iterable[ArmedSpan]:
    began_us = None
    for stamp_us, heartbeat in heartbeats:
        armed = bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if armed and began_us is None:
            began_us = stamp_us
        elif not armed and began_us is not None:
            yield ArmedSpan((began_us - log_start_us) * 1e-6, (stamp_us - log_start_us) * 1e-6)
            began_us = None
    if began_us is not None:
        yield ArmedSpan((began_us - log_start_us) * 1e-6, (heartbeats[-1][0] - log_start_us) * 1e-6)


def _enum_name(enum: str, value: int) -> str:
    entry = mavlink.enums[enum].get(value)
    return entry.name if entry else f"{enum} {value}"


def _sender_json(survey: SenderSurvey) -> dict[str, Any]:
    return {
        "system": survey.sender[0],
        "component": survey.sender[1],
        "type": survey.vehicle_type,
        "autopilot": survey.autopilot,
        "contradicting_heartbeats": survey.contradicting_heartbeats,
        "frames": survey.frames,
        "messages": {message.name: {"count": message.count, "rate_hz": message.rate_hz} for message in survey.messages},
        "armed_spans": [{"from_s": span.from_s, "to_s": span.to_s} for span in survey.armed_spans],
    }
