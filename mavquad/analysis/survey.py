"""Who is in a log: every sender, what it is, what it sent and how often, when it was armed, silent, in which mode."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mavquad.analysis.modes import mode_name
from mavquad.analysis.tally import Heartbeat, Tallies, Tally
from mavquad.protocol.codec import mavlink
from mavquad.tlog import Reading, Selection, TlogContents
from mavquad.tlog import Sender as Sender

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
class ModeSpan:
    """From the first HEARTBEAT in a mode to the first in another one, or the last one; s since the log began."""

    from_s: float
    to_s: float
    mode: str


@dataclass(frozen=True, slots=True)
class Gap:
    """Nothing is in the log from a sender for 2 s or more; s since the log began."""

    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class Flight:
    """One armed span of one vehicle; all of a log are numbered by their beginnings, from 1."""

    number: int
    sender: Sender
    span: ArmedSpan


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
        modes: its flight modes, in order; empty if it is no autopilot.
        gaps: when it was silent.
    """

    sender: Sender
    vehicle_type: str
    autopilot: str
    contradicting_heartbeats: int
    frames: int
    messages: tuple[MessageCount, ...]
    armed_spans: tuple[ArmedSpan, ...]
    modes: tuple[ModeSpan, ...]
    gaps: tuple[Gap, ...]

    @property
    def is_vehicle(self) -> bool:
        """Whether it says that it is an autopilot."""
        return self.autopilot not in ("", "MAV_AUTOPILOT_INVALID")

    def count(self, name: str) -> int:
        """How many messages of that name it sent."""
        return next((message.count for message in self.messages if message.name == name), 0)


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a log, or in a selection of it.

    Attributes:
        frames: good frames that were selected.
        unknown_frames: of the whole log: intact frames of unknown messages.
        bad_bytes: of the whole log: bytes that belong to no record.
        bad_ranges: of the whole log: (offset, length) of each stretch of them.
        repaired_stamps: of the whole log: good frames whose own stamp was lost.
        first_stamp_us: the earliest stamp of the whole log, Unix us; all times count from there.
        duration_s: from there to its latest stamp.
        backward_stamps: frames that were selected and whose stamp is before that of the one before.
        senders: by their ids.
    """

    frames: int
    unknown_frames: int
    bad_bytes: int
    bad_ranges: tuple[tuple[int, int], ...]
    repaired_stamps: int
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

    def flights(self) -> tuple[Flight, ...]:
        """All armed spans."""
        spans = [(span.from_s, sender.sender, span) for sender in self.senders for span in sender.armed_spans]
        ordered = sorted(spans, key=lambda item: item[:2])
        return tuple(Flight(number, sender, span) for number, (_, sender, span) in enumerate(ordered, 1))

    def messages(self) -> dict[str, int]:
        """How often each message is there, from whomever, the most frequent first."""
        counts = Counter[str]()
        for sender in self.senders:
            counts.update({message.name: message.count for message in sender.messages})
        return dict(counts.most_common())

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`."""
        return {
            "frames": self.frames,
            "unknown_frames": self.unknown_frames,
            "bad_bytes": self.bad_bytes,
            "repaired_stamps": self.repaired_stamps,
            "first_stamp_us": self.first_stamp_us,
            "duration_s": self.duration_s,
            "backward_stamps": self.backward_stamps,
            "messages": self.messages(),
            "armed_spans": [_flight_json(flight) for flight in self.flights()],
            "senders": [_sender_json(survey) for survey in self.senders],
            "bad_ranges": [list(bad_range) for bad_range in self.bad_ranges],
        }


def survey(contents: TlogContents) -> Survey:
    """Go once through a log in memory."""
    tallies = Tallies()
    tallies.add(contents.frames)
    stamps_us = contents.frames.stamps_us
    first_us, last_us = (int(stamps_us.min()), int(stamps_us.max())) if len(stamps_us) else (0, 0)
    damage = (contents.unknown_frames, contents.bad_ranges, contents.repaired_stamps)
    return _survey(tallies, first_us, last_us, *damage)


def survey_file(path: Path | str, selection: Selection | None = None) -> Survey:
    """Go once through a log's file, in bounded memory.

    Raises:
        LogError: as of `tlog.read`.
    """
    tallies = Tallies()
    reading = Reading(Path(path))
    for frames in reading:
        tallies.add(selection.among(frames) if selection else frames)
    scanner = reading.scanner
    damage = (scanner.unknown_frames, scanner.bad_ranges, scanner.repaired_stamps)
    return _survey(tallies, reading.first_us, reading.last_us, *damage)


def _survey(
    tallies: Tallies, first_us: int, last_us: int, unknown: int, bad_ranges: Sequence[tuple[int, int]], repaired: int
) -> Survey:
    return Survey(
        frames=tallies.frames,
        unknown_frames=unknown,
        bad_bytes=sum(length for _, length in bad_ranges),
        bad_ranges=tuple(bad_ranges),
        repaired_stamps=repaired,
        first_stamp_us=first_us,
        duration_s=(last_us - first_us) / 1e6,
        backward_stamps=tallies.backward_stamps,
        senders=tuple(_survey_sender(sender, tally, first_us) for sender, tally in sorted(tallies.senders.items())),
    )


def _survey_sender(sender: Sender, tally: Tally, log_start_us: int) -> SenderSurvey:
    believed = _believed_claim(tally)
    honest = [beat for beat in tally.heartbeats if (beat.type, beat.autopilot) == believed]
    is_vehicle = believed is not None and believed[1] != mavlink.MAV_AUTOPILOT_INVALID
    return SenderSurvey(
        sender=sender,
        vehicle_type=_enum_name("MAV_TYPE", believed[0]) if believed else "",
        autopilot=_enum_name("MAV_AUTOPILOT", believed[1]) if believed else "",
        contradicting_heartbeats=len(tally.heartbeats) - len(honest),
        frames=tally.counts.total(),
        messages=tuple(_message_count(tally, number) for number, _ in tally.counts.most_common()),
        armed_spans=tuple(_armed_spans(honest, log_start_us)),
        modes=tuple(_mode_spans(honest, log_start_us)) if is_vehicle else (),
        gaps=tuple(Gap(_log_s(a, log_start_us), _log_s(b, log_start_us)) for a, b in tally.gaps_us),
    )


def _log_s(stamp_us: int, log_start_us: int) -> float:
    return (stamp_us - log_start_us) / 1e6


def _believed_claim(tally: Tally) -> tuple[int, int] | None:
    """The (type, autopilot) that most HEARTBEATs claim; one that names an autopilot goes before one that does not."""
    claims = Counter((heartbeat.type, heartbeat.autopilot) for heartbeat in tally.heartbeats)
    return max(claims, key=lambda claim: (claim[1] != mavlink.MAV_AUTOPILOT_INVALID, claims[claim]), default=None)


def _message_count(tally: Tally, number: int) -> MessageCount:
    count = tally.counts[number]
    span_s = (tally.last_us[number] - tally.first_us[number]) * 1e-6
    rate_hz = (count - 1) / span_s if count > 1 and span_s > 0.0 else None
    return MessageCount(mavlink.mavlink_map[number].msgname, count, rate_hz)


def _armed_spans(heartbeats: Sequence[Heartbeat], log_start_us: int) -> Iterable[ArmedSpan]:
    for armed, from_us, to_us in _stretches((beat.stamp_us, beat.is_armed) for beat in heartbeats):
        if armed:
            yield ArmedSpan(_log_s(from_us, log_start_us), _log_s(to_us, log_start_us))


def _mode_spans(heartbeats: Sequence[Heartbeat], log_start_us: int) -> Iterable[ModeSpan]:
    named = ((beat.stamp_us, mode_name(beat.autopilot, beat.type, beat.custom_mode)) for beat in heartbeats)
    for mode, from_us, to_us in _stretches(named):
        yield ModeSpan(_log_s(from_us, log_start_us), _log_s(to_us, log_start_us), mode)


def _stretches(values: Iterable[tuple[int, Any]]) -> Iterable[tuple[Any, int, int]]:
    """(value, from, to) of each stretch of equal values: from its first stamp to the next one's first, or the last."""
    value, from_us, stamp_us = None, None, 0
    for stamp_us, found in values:
        if from_us is not None and found != value:
            yield value, from_us, stamp_us
        if from_us is None or found != value:
            value, from_us = found, stamp_us
    if from_us is not None:
        yield value, from_us, stamp_us


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
        "armed_spans": [asdict(span) for span in survey.armed_spans],
        "modes": [asdict(span) for span in survey.modes],
        "gaps": [asdict(gap) for gap in survey.gaps],
    }


def _flight_json(flight: Flight) -> dict[str, Any]:
    system, component = flight.sender
    return {"flight": flight.number, "system": system, "component": component, **asdict(flight.span)}
