"""What every guard shares: what it says when it trips, what is then done, and how long a limit must be exceeded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mavquad.schema import Section

Reaction = Literal["hold", "land", "return", "pilot"]
"""What follows when a guard trips: the autopilot holds and is left so; it holds, then lands; it comes back and lands; or it
is left in the mode of the pilot's sticks."""

HOLD: Reaction = "hold"
LAND: Reaction = "land"
RETURN: Reaction = "return"
PILOT: Reaction = "pilot"


class GuardSection(Section):
    """A guard's table: its limits, and its reaction."""

    reaction: Reaction = LAND
    """hold: stay there; land; return: come back and land; pilot: the mode of the pilot's sticks."""


@dataclass(frozen=True, slots=True)
class Tripped:
    """Which guard tripped, the words for it, and what it asks for."""

    name: str
    words: str
    reaction: Reaction = LAND


class Lasting:
    """A condition that must hold without a break for a while before it counts."""

    def __init__(self, for_us: int) -> None:
        self._for_us = for_us
        self._since_us: int | None = None

    def holds(self, condition: bool, now_us: int) -> bool:
        """Whether it has held long enough by now; at once, where no time is asked for."""
        if not condition:
            self._since_us = None
        elif self._since_us is None:
            self._since_us = now_us
        return self._since_us is not None and now_us - self._since_us >= self._for_us
