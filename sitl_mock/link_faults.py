"""What the link's faults do to one frame.

Every fault draws twice for each frame that it looks at, from a random stream of its own for each direction of each
port, whatever the other faults do: one fault more or less leaves the fate that the others deal out as it was.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mavquad.protocol.codec import message_id
from sitl_mock.config.fault_base import MESSAGE_IDS, Direction
from sitl_mock.config.link_faults import Corrupt, Delay, Drop, Duplicate, Jitter, LinkFault, Reorder
from sitl_mock.script import Entry

_US_PER_MS = 1000


@dataclass(slots=True)
class Fate:
    """What becomes of a frame.

    Attributes:
        data: the frame as it arrives.
        is_lost: it does not.
        is_damaged: `data` is not what was sent.
        delay_us: how much longer it takes.
        holds_up: later frames wait behind it.
        copies: how often it arrives in addition, each `later_us` after the one before.
        behind: it arrives after so many later frames.
    """

    data: bytes
    is_lost: bool = False
    is_damaged: bool = False
    delay_us: int = 0
    holds_up: bool = False
    copies: int = 0
    later_us: int = 0
    behind: int = 0


class LinkFaults:
    """The link's faults in one direction of one port.

    Attributes:
        entries: all link faults of the script; the list may grow.
        direction: "to_vehicle" or "from_vehicle".
    """

    def __init__(self, entries: list[Entry], direction: Direction, seed: str) -> None:
        self.entries = entries
        self.direction = direction
        self._seed = seed
        self._randoms: dict[int, random.Random] = {}

    def fate(self, data: bytes, now_us: int) -> Fate:
        """What becomes of a frame that sets out now."""
        fate = Fate(data)
        for entry in self.entries:
            fault = entry.fault
            assert isinstance(fault, LinkFault)
            if fault.direction in (self.direction, "both") and entry.acts(now_us) and _is_meant(fault, data):
                draws = self._random(entry)
                is_hit, share = draws.random() < fault.probability, draws.random()
                if is_hit:
                    _EFFECTS[type(fault)](fault, fate, share)
        return fate

    def _random(self, entry: Entry) -> random.Random:
        if entry.number not in self._randoms:
            self._randoms[entry.number] = random.Random(f"{self._seed} {self.direction} {entry.number}")
        return self._randoms[entry.number]


def _is_meant(fault: LinkFault, data: bytes) -> bool:
    return not fault.message or message_id(data) == MESSAGE_IDS[fault.message]


def _drop(fault: Drop, fate: Fate, share: float) -> None:
    fate.is_lost = True


def _delay(fault: Delay, fate: Fate, share: float) -> None:
    fate.delay_us += round(fault.delay_ms * _US_PER_MS)
    fate.holds_up = True


def _jitter(fault: Jitter, fate: Fate, share: float) -> None:
    fate.delay_us += round(fault.jitter_ms * share * _US_PER_MS)


def _duplicate(fault: Duplicate, fate: Fate, share: float) -> None:
    fate.copies += fault.copies
    fate.later_us = round(fault.later_ms * _US_PER_MS)


def _reorder(fault: Reorder, fate: Fate, share: float) -> None:
    fate.behind = max(fate.behind, fault.behind)


def _corrupt(fault: Corrupt, fate: Fate, share: float) -> None:
    damaged, draws = bytearray(fate.data), random.Random(int(share * 2**53))
    for place in draws.sample(range(8 * len(damaged)), min(fault.bits, 8 * len(damaged))):
        damaged[place // 8] ^= 1 << place % 8
    fate.data, fate.is_damaged = bytes(damaged), True


_EFFECTS: Mapping[type, Callable[[Any, Fate, float], None]] = {
    Drop: _drop,
    Delay: _delay,
    Jitter: _jitter,
    Duplicate: _duplicate,
    Reorder: _reorder,
    Corrupt: _corrupt,
}
