"""Faults of the link, frame by frame; each draws from its own seeded stream, one for each direction."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sitl_mock.config.fault_base import Direction, MessageName, Milliseconds, Probability, Window


class LinkFault(Window):
    """Something happens to frames on their way."""

    direction: Direction = "both"
    """Which frames: "to_vehicle", "from_vehicle" or "both"."""
    message: MessageName = ""
    """Only frames of the message of this name; "" for all."""
    probability: Probability = 1.0
    """Probability that it happens to a frame."""


class Drop(LinkFault):
    """The frame is lost."""

    kind: Literal["drop"]
    """Discriminates the fault."""


class Delay(LinkFault):
    """The frame takes longer, and what was sent after it waits behind it: the order is kept."""

    kind: Literal["delay"]
    """Discriminates the fault."""
    delay_ms: Milliseconds
    """How much longer in ms."""


class Jitter(LinkFault):
    """The frame takes longer by a random time; frames may overtake each other."""

    kind: Literal["jitter"]
    """Discriminates the fault."""
    jitter_ms: Milliseconds
    """Largest additional time in ms, uniform from 0."""


class Duplicate(LinkFault):
    """The frame arrives more than once."""

    kind: Literal["duplicate"]
    """Discriminates the fault."""
    copies: Annotated[int, Field(ge=1, le=100)] = 1
    """How many more times."""
    later_ms: Milliseconds = 0.0
    """How long after the frame, or after the copy before, each copy arrives, in ms."""


class Reorder(LinkFault):
    """The frame arrives after frames that were sent later, or 1 s late if there are none."""

    kind: Literal["reorder"]
    """Discriminates the fault."""
    behind: Annotated[int, Field(ge=1, le=1000)] = 1
    """After how many later frames of its direction."""


class Corrupt(LinkFault):
    """Bits of the frame are flipped. The vehicle discards what its CRC shows; the far side gets the bytes."""

    kind: Literal["corrupt"]
    """Discriminates the fault."""
    bits: Annotated[int, Field(ge=1, le=2000)] = 1
    """How many bits, each at a random place."""
