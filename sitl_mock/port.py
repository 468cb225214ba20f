"""One of the autopilot's links: what kind it is, who is heard on it, and what waits to be sent there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from mavquad.protocol.codec import Encoder, Message, frame_version, mavlink, message_id
from sitl_mock.signatures import Signatures

PortKind = Literal["onboard", "gcs", "serial"]
"""PX4's link for companion computers, PX4's for ground stations, ArduPilot's serial ports."""

AUTOPILOT_COMPONENT = 1
_RADIO_STATUS = mavlink.MAVLINK_MSG_ID_RADIO_STATUS


class Port:
    """A link of the autopilot. It begins with MAVLink 2, or with 1 (`first_version`, seen on PX4 1.13).

    With `in_kind` it answers in the version that it was last spoken to; without, as the real ones: what was begun with
    1 goes on with 2 once 2 is heard, and nobody ever goes back to 1.

    Attributes:
        kind: what the autopilot takes it for.
        frames: what is ready to be sent.
        heard: whether anybody has said anything here since boot.
        ground_station_us: when a ground station's HEARTBEAT was last heard here, since boot.
        spoil: what faults make of a message that is to be sent: itself, another one, or None for not now.
        signatures: None: they are not looked at.
        now_us: Unix time, for the signatures' timestamps.
        first_version: of MAVLink, after boot.
    """

    def __init__(
        self,
        kind: PortKind,
        system_id: int,
        signatures: Signatures | None = None,
        now_us: int = 0,
        in_kind: bool = True,
    ) -> None:
        self.kind = kind
        self.frames: list[bytes] = []
        self.heard = False
        self.ground_station_us: int | None = None
        self.spoil: Callable[[Message], Message | None] | None = None
        self.signatures = signatures
        self.now_us = now_us
        self.first_version = 2
        self._in_kind = in_kind
        self._encoder = Encoder(system_id, AUTOPILOT_COMPONENT)

    def lets_in(self, frame: bytes, now_us: int) -> bool:
        """Whether the autopilot takes this frame in."""
        self.now_us = now_us
        if self.signatures is not None and not self.signatures.lets_in(frame, now_us):
            return False
        self.heard = True
        heard = frame_version(frame)
        # A radio's own report says nothing of who is behind it.
        if heard != self._encoder.version and message_id(frame) != _RADIO_STATUS:
            self._encoder.version = heard if self._in_kind else max(self._encoder.version, heard)
        return True

    def send(self, message: Message) -> None:
        """Send a message next, unless a fault makes something else of it."""
        if self.spoil is None and self.signatures is None and self._encoder.version != 1:
            self.frames.append(self._encoder.encode(message))  # nothing is in its way
            return
        spoiled = message if self.spoil is None else self.spoil(message)
        if spoiled is not None:
            self.send_as_is(spoiled)

    def send_as_is(self, message: Message) -> None:
        """Pack a message, to be sent next. MAVLink 1 has no ids above 255: there, such a message is not sent."""
        encoder, signatures = self._encoder, self.signatures
        if encoder.version == 1:
            if encoder.can_say(message):
                self.frames.append(encoder.encode(message))
        elif signatures is not None and signatures.signs:
            self.frames.append(signatures.sign(encoder.encode(message, signed=True), self.now_us))
        else:
            self.frames.append(encoder.encode(message))

    def begin_with(self, version: int) -> None:
        """Speak this version of MAVLink until another one is heard; where signatures matter, 2 in any case."""
        if self.signatures is not None:
            return
        self.first_version = self._encoder.version = version

    def restart(self) -> None:
        """The autopilot boots again: nobody has been heard yet, sequence numbers start anew."""
        self.frames = []
        self.heard = False
        self.ground_station_us = None
        self._encoder.version, self._encoder.sequence = self.first_version, 0

    def take(self) -> list[bytes]:
        """What is ready to be sent; handed out once."""
        frames, self.frames = self.frames, []
        return frames
