"""Everybody who speaks on the link: each system and component, and what it says it is."""

from __future__ import annotations

from dataclasses import dataclass, field

from mavquad.check.words import enum_name
from mavquad.protocol.codec import decode, frame_sequence, frame_source, frame_version, mavlink, message_id
from mavquad.protocol.sequence import SequenceCount

SENDERS_MAX = 1000


@dataclass(slots=True)
class Participant:
    """One component.

    Attributes:
        system_id, component_id: who.
        frames: how many came.
        versions: of MAVLink, that it speaks.
        kind: MAV_TYPE of its HEARTBEAT; "" without one.
        autopilot: MAV_AUTOPILOT of it; "" for one that is none.
        lost: frames missing in its sequence numbers.
    """

    system_id: int
    component_id: int
    frames: int = 0
    versions: set[int] = field(default_factory=set)
    kind: str = ""
    autopilot: str = ""
    _sequence: SequenceCount = field(default_factory=SequenceCount)

    @property
    def component(self) -> str:
        """The name that MAVLink has for its component id."""
        return enum_name("MAV_COMPONENT", self.component_id, "MAV_COMP_ID_")

    @property
    def lost(self) -> int:
        """Frames that did not come."""
        return self._sequence.lost

    def take(self, frame: bytes) -> None:
        """Take in a frame of it."""
        self.frames += 1
        self.versions.add(frame_version(frame))
        self._sequence.take(frame_sequence(frame))
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_HEARTBEAT and not self.kind:
            heartbeat = decode(frame)
            self.kind = enum_name("MAV_TYPE", heartbeat.type)
            if heartbeat.autopilot != mavlink.MAV_AUTOPILOT_INVALID:
                self.autopilot = enum_name("MAV_AUTOPILOT", heartbeat.autopilot)


class Roster:
    """All of them; of a flood of invented names, the first ones."""

    def __init__(self) -> None:
        self._everybody: dict[tuple[int, int], Participant] = {}

    def take(self, frame: bytes) -> None:
        """Take in a frame, whoever sent it."""
        source = frame_source(frame)
        participant = self._everybody.get(source)
        if participant is None:
            if len(self._everybody) >= SENDERS_MAX:
                return
            participant = self._everybody[source] = Participant(*source)
        participant.take(frame)

    def everybody(self) -> list[Participant]:
        """By system and component."""
        return [self._everybody[source] for source in sorted(self._everybody)]
