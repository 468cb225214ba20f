"""One of the autopilot's links: what kind it is, who is heard on it, and what waits to be sent there."""

from __future__ import annotations

from typing import Literal

from mavquad.protocol.codec import Encoder, Message

PortKind = Literal["onboard", "gcs", "serial"]
"""PX4's link for companion computers, PX4's for ground stations, ArduPilot's serial ports."""

AUTOPILOT_COMPONENT = 1


class Port:
    """A link of the autopilot.

    Attributes:
        kind: what the autopilot takes it for.
        frames: what is ready to be sent.
        ground_station_us: when a ground station's HEARTBEAT was last heard here, since boot.
    """

    def __init__(self, kind: PortKind, system_id: int) -> None:
        self.kind = kind
        self.frames: list[bytes] = []
        self.ground_station_us: int | None = None
        self._encoder = Encoder(system_id, AUTOPILOT_COMPONENT)

    def send(self, message: Message) -> None:
        """Pack a message, to be sent next."""
        self.frames.append(self._encoder.encode(message))

    def take(self) -> list[bytes]:
        """What is ready to be sent; handed out once."""
        frames, self.frames = self.frames, []
        return frames
