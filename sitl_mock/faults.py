"""A link that delays, reorders and loses frames, wrapped around an endpoint; itself an endpoint.

Every frame of each direction is lost with probability `loss`, or arrives `latency_ms` plus a uniform random part of
`jitter_ms` later. Each direction draws from its own seeded generator, a fixed number of times a frame.
"""

from __future__ import annotations

import heapq
import random
from typing import Protocol

from mavquad.endpoint import GRID_US, NEVER_US, floor_to_grid_us
from sitl_mock.config.link import LinkConfig

_US_PER_MS = 1000.0
_PORT_SEEDS = 1_000_003


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


class PortedEndpoint(Protocol):
    """An `Endpoint` with several ports."""

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """Take in one whole frame on a port."""

    def next_deadline_us(self) -> int:
        """When `on_deadline` wants to be called."""

    def on_deadline(self, now_us: int) -> None:
        """Act on the passing of time."""

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """What is ready to be sent on a port; handed out once."""


class ImpairedLink:
    """`inner` as it appears through its links: `receive` sends into it, `datagrams_to_send` is what came out of it."""

    def __init__(self, inner: PortedEndpoint, link: LinkConfig, seed: int, ports: int = 1) -> None:
        self._inner = inner
        self._inbound = [_Direction(link, 2 * (seed + _PORT_SEEDS * port)) for port in range(ports)]
        self._outbound = [_Direction(link, 2 * (seed + _PORT_SEEDS * port) + 1) for port in range(ports)]
        self._last_input_us = -GRID_US
        self._arrived: list[list[bytes]] = [[] for _ in range(ports)]

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """The far side sends a frame."""
        self._inbound[port].send(data, now_us)
        self._run(now_us)

    def next_deadline_us(self) -> int:
        """The next arrival on either side, or the inner endpoint's own deadline."""
        return min(
            self._inner.next_deadline_us(),
            *(direction.next_us for direction in self._inbound),
            *(direction.next_us for direction in self._outbound),
        )

    def on_deadline(self, now_us: int) -> None:
        """Let everything happen that is due."""
        self._run(now_us)

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """What reaches the far side of a port now."""
        arrived, self._arrived[port] = self._arrived[port], []
        return arrived

    def _run(self, now_us: int) -> None:
        inner = self._inner
        while (due_us := self.next_deadline_us()) <= now_us:
            if inner.next_deadline_us() <= due_us:
                inner.on_deadline(due_us)
                self._collect(due_us)
            for port, direction in enumerate(self._inbound):
                if direction.next_us <= due_us:
                    self._deliver_next(port, due_us)
            for port, direction in enumerate(self._outbound):
                while direction.next_us <= due_us:
                    self._arrived[port].append(direction.take())

    def _deliver_next(self, port: int, due_us: int) -> None:
        """Hand the next frame to the inner endpoint; its inputs have strictly increasing stamps."""
        if due_us <= self._last_input_us:
            self._inbound[port].put_off(self._last_input_us + GRID_US)
            return
        self._last_input_us = due_us
        self._inner.receive(self._inbound[port].take(), due_us, port)
        self._collect(due_us)

    def _collect(self, stamp_us: int) -> None:
        for port, direction in enumerate(self._outbound):
            for datagram in self._inner.datagrams_to_send(port):
                direction.send(datagram, stamp_us)
