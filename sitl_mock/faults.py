"""A link that delays, reorders and loses frames, wrapped around an endpoint; itself an endpoint.

Every frame of each direction is lost with probability `loss`, or arrives `latency_ms` plus a uniform random part of
`jitter_ms` later. Each direction draws from its own seeded generator, a fixed number of times a frame.
"""

from __future__ import annotations

import heapq
import random

from mavquad.endpoint import GRID_US, NEVER_US, Endpoint, advance, deliver, floor_to_grid_us
from sitl_mock.config import LinkConfig

_US_PER_MS = 1000.0


class _Direction:
    """Frames on their way one way, in order of arrival."""

    def __init__(self, link: LinkConfig, seed: int) -> None:
        self._link = link
        self._random = random.Random(seed)
        self._arrivals: list[tuple[int, int, bytes]] = []
        self._sent = 0

    @property
    def next_us(self) -> int:
        """When the next frame arrives."""
        return self._arrivals[0][0] if self._arrivals else NEVER_US

    def send(self, data: bytes, now_us: int) -> None:
        is_lost = self._random.random() < self._link.loss
        delay_ms = self._link.latency_ms + self._link.jitter_ms * self._random.random()
        self._sent += 1
        if not is_lost:
            arrival_us = floor_to_grid_us(now_us + round(delay_ms * _US_PER_MS))
            heapq.heappush(self._arrivals, (arrival_us, self._sent, data))

    def take(self) -> bytes:
        """The frame that arrives next."""
        return heapq.heappop(self._arrivals)[2]

    def put_off(self, until_us: int) -> None:
        """Let the next frame arrive later."""
        _, order, data = self._arrivals[0]
        heapq.heapreplace(self._arrivals, (until_us, order, data))


class ImpairedLink:
    """`inner` as it appears through the link: `receive` sends into it, `datagrams_to_send` is what came out of it."""

    def __init__(self, inner: Endpoint, link: LinkConfig, seed: int) -> None:
        self._inner = inner
        self._inbound = _Direction(link, 2 * seed)
        self._outbound = _Direction(link, 2 * seed + 1)
        self._last_input_us = -GRID_US
        self._arrived: list[bytes] = []

    def receive(self, data: bytes, now_us: int) -> None:
        """The far side sends a frame."""
        self._inbound.send(data, now_us)
        self._run(now_us)

    def next_deadline_us(self) -> int:
        """The next arrival on either side, or the inner endpoint's own deadline."""
        return min(self._inner.next_deadline_us(), self._inbound.next_us, self._outbound.next_us)

    def on_deadline(self, now_us: int) -> None:
        """Let everything happen that is due."""
        self._run(now_us)

    def datagrams_to_send(self) -> list[bytes]:
        """What reaches the far side now."""
        arrived, self._arrived = self._arrived, []
        return arrived

    def _run(self, now_us: int) -> None:
        while (due_us := self.next_deadline_us()) <= now_us:
            for stamp_us, datagram in advance(self._inner, due_us):
                self._outbound.send(datagram, stamp_us)
            if self._inbound.next_us <= due_us:
                self._deliver_next(due_us)
            while self._outbound.next_us <= due_us:
                self._arrived.append(self._outbound.take())

    def _deliver_next(self, due_us: int) -> None:
        """Hand the next frame to the inner endpoint; its inputs have strictly increasing stamps."""
        if due_us <= self._last_input_us:
            self._inbound.put_off(self._last_input_us + GRID_US)
            return
        self._last_input_us = due_us
        for stamp_us, datagram in deliver(self._inner, self._inbound.take(), due_us):
            self._outbound.send(datagram, stamp_us)
