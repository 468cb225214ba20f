"""Which telemetry is due: default rates, SET_MESSAGE_INTERVAL, and how often there is something new to tell.

A message is due in the first tick of each of its periods counted from boot, so that two streams of the same rate fall
into the same tick whenever they were asked for; and only when what it tells has been worked out anew since.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from heapq import heapify, heapreplace
from typing import NamedTuple

from mavquad.endpoint import NEVER_US

OFF_HZ = 0.0
UNLIMITED_HZ = math.inf


class StreamKind(NamedTuple):
    """A stream that a link has.

    Attributes:
        message_id: of its message.
        default_hz: its rate at boot; `OFF_HZ`: not sent unless asked for, `UNLIMITED_HZ`: whatever is new.
        update_us: how often what it tells is worked out anew.
    """

    message_id: int
    default_hz: float
    update_us: int

    @property
    def default_us(self) -> int:
        """Its interval at boot; 0: not sent, -1: unlimited."""
        if self.default_hz == UNLIMITED_HZ:
            return -1
        return round(1e6 / self.default_hz) if self.default_hz > 0 else 0


class Streams:
    """The intervals in force on one link, and the messages due now.

    Args:
        kinds: every stream, in the order in which one tick sends them.
        unsent: ids of streams that the real autopilot has and the mock does not send; asking for them is accepted.

    Attributes:
        next_us: nothing is due before.
    """

    def __init__(self, kinds: Iterable[StreamKind], unsent: frozenset[int] = frozenset()) -> None:
        self._kinds = {kind.message_id: kind for kind in kinds}
        self._unsent = unsent
        self._ids = list(self._kinds)
        self._updates_us = [kind.update_us for kind in self._kinds.values()]
        self._places = {message_id: place for place, message_id in enumerate(self._ids)}
        self._interval_us = {message_id: kind.default_us for message_id, kind in self._kinds.items()}
        # When each stream is due, and its place among those of the same tick: a heap.
        self._queue = [(0, self._places[message_id]) for message_id, us in self._interval_us.items() if us != 0]
        self.next_us = 0

    def set_interval(self, message_id: int, interval_us: float, boot_us: int) -> bool:
        """Obey SET_MESSAGE_INTERVAL: 0 restores the default, below 0 stops. False for a message without a stream."""
        if message_id in self._unsent:
            return True
        kind = self._kinds.get(message_id)
        if kind is None:
            return False
        if interval_us < 0:
            self._interval_us[message_id] = 0
        else:
            self._interval_us[message_id] = max(1, round(interval_us)) if interval_us > 0 else kind.default_us
        place = self._places[message_id]
        self._queue = [entry for entry in self._queue if entry[1] != place]
        if self._interval_us[message_id] != 0:
            self._queue.append((_after(self._interval_us[message_id], kind.update_us, boot_us), place))
        heapify(self._queue)
        self.next_us = self._queue[0][0] if self._queue else NEVER_US
        return True

    def sends(self, message_id: int) -> bool:
        """Whether this is one of the streams, on or off."""
        return message_id in self._kinds

    def interval_us(self, message_id: int) -> int:
        """What PX4 answers to GET_MESSAGE_INTERVAL: the interval asked for; -1 unlimited; 0 stopped, or no such stream."""
        return self._interval_us.get(message_id, 0)

    def due(self, boot_us: int) -> list[int]:
        """Ids of the messages to send in this tick."""
        if boot_us < self.next_us:
            return []
        queue, ids, updates_us, intervals_us = self._queue, self._ids, self._updates_us, self._interval_us
        places = []
        while queue and queue[0][0] <= boot_us:
            place = queue[0][1]
            places.append(place)
            after_us = _after(intervals_us[ids[place]], updates_us[place], boot_us)
            heapreplace(queue, (after_us, place))
        self.next_us = queue[0][0] if queue else NEVER_US
        if len(places) == 1:
            return [ids[places[0]]]
        places.sort()
        return [ids[place] for place in places]


def _after(interval_us: int, update_us: int, boot_us: int) -> int:
    """When a stream that is on is due next: its next period has begun, and there is something new."""
    news_us = boot_us - boot_us % update_us + update_us
    if interval_us < 0:
        return news_us
    due_us = boot_us - boot_us % interval_us + interval_us
    return due_us if due_us > news_us else news_us
