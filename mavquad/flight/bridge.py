"""What the parts of a flight know of the captain, and what they may ask of him."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from mavquad.errors import MavquadError
from mavquad.flight.machine import Event, Phase
from mavquad.protocol.codec import Message
from mavquad.protocol.command import Command

Address = tuple[int, int]
"""(system id, component id)."""


class Bridge(Protocol):
    """Where the flight is, and the ways out: to the vehicle, to the next phase, into the story.

    Attributes:
        phase: where the flight is.
        phase_us: since when.
        limit_us: until when at most.
        refusal_us: when a refusal is acted upon.
        now_us: the time of what is happening.
        target: the vehicle.
        ground_m: z (up) of the arming point.
    """

    phase: Phase
    phase_us: int
    limit_us: int
    refusal_us: int
    now_us: int
    target: Address
    ground_m: float

    @property
    def is_ending(self) -> bool:
        """Whether the flight goes on only to end: something went wrong, or the operator stopped it."""

    def fire(self, event: Event, error: MavquadError | None = None) -> None:
        """Something happened: on to the phase that the table names, if any; then the error, if any, is why."""

    def request(self, command: Command) -> None:
        """Send a command, again and again until it is answered or the phase is over."""

    def send_all(self, messages: Iterable[Message]) -> None:
        """Send these, once."""

    def stay_safe(self) -> None:
        """Send the safe setpoint, when it is due."""

    def note(self, kind: str, text: str) -> None:
        """A line of the story."""

    def blame(self, error: MavquadError) -> None:
        """Something went wrong that does not end the phase."""

    def height_m(self) -> float:
        """Above the arming point; 0 without a position."""

    def said(self) -> str:
        """The vehicle's own texts that may explain what happens now."""
