"""Which frames of a log are wanted."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mavquad.errors import InputError
from mavquad.tlog.columns import kinds_by_name
from mavquad.tlog.frames import Frames

Sender = tuple[int, int]
"""(system id, component id)."""


@dataclass(frozen=True, slots=True)
class Selection:
    """Which frames are wanted, each None for all of them: message ids, the sender's ids, earliest and latest stamp."""

    numbers: tuple[int, ...] | None = None
    system: int | None = None
    component: int | None = None
    from_us: int | None = None
    to_us: int | None = None

    @classmethod
    def of(
        cls,
        types: Iterable[str] | None = None,
        system: int | None = None,
        component: int | None = None,
        from_us: int | None = None,
        to_us: int | None = None,
    ) -> Selection:
        """With messages by their names; "ATTITUDE" alone is one.

        Raises:
            InputError: MAVLink has no message of that name.
        """
        names = (types,) if isinstance(types, str) else types
        numbers = None if names is None else tuple(map(message_number, names))
        return cls(numbers, system, component, from_us, to_us)

    def among(self, frames: Frames) -> Frames:
        """Those of these frames that are wanted."""
        if self.numbers is not None:
            frames = frames.only(np.isin(frames.numbers, self.numbers))
        if self.system is not None:
            frames = frames.only(frames.systems == self.system)
        if self.component is not None:
            frames = frames.only(frames.components == self.component)
        if self.from_us is not None:
            frames = frames.only(frames.stamps_us >= self.from_us)
        if self.to_us is not None:
            frames = frames.only(frames.stamps_us <= self.to_us)
        return frames


def message_number(name: str) -> int:
    """The id of a message.

    Raises:
        InputError: MAVLink has no message of that name.
    """
    known = kinds_by_name()
    if name not in known:
        close = difflib.get_close_matches(name.upper(), known, 1)
        raise InputError(f"no message is called {name!r}", f"did you mean {close[0]}?" if close else "")
    return int(known[name].id)
