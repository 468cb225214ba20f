"""A link that delays, reorders and loses frames, wrapped around an endpoint; itself an endpoint.

Every frame of each direction is lost with probability `loss`, or arrives `latency_ms` plus a uniform random part of
`jitter_ms` later. Each direction draws from its own seeded generator, a fixed number of times a frame. The script's
link faults come on top. A link without any of it hands everything straight through.
"""

from __future__ import annotations

import heapq
import random
from typing import Protocol

from mavquad.endpoint import GRID_US, NEVER_US, floor_to_grid_us
from mavquad.protocol.codec import frame_length, is_valid
from sitl_mock.config.fault_base import Direction
from sitl_mock.config.link import LinkConfig
from sitl_mock.link_faults import Fate, LinkFaults
from sitl_mock.script import Script

_US_PER_MS = 1000.0
_PORT_SEEDS = 1_000_003
_HELD_AT_MOST_US = 1_000_000
"""How long a frame waits for later ones to overtake it."""


class PortedEndpoint(Protocol):
    """An `Endpoint` with several ports, whose script says what goes wrong on its links."""

    @property
    def script(self) -> Script:
        """The script of its faults."""

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """Take in one whole frame on a port."""

    def next_deadline_us(self) -> int:
        """When `on_deadline` wants to be called."""

    def on_deadline(self, now_us: int) -> None:
        """Act on the passing of time."""

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """What is ready to be sent on a port; handed out once."""


class _Road:
    """Frames on their way, both ways, in order of arrival.

    Attributes:
        next_us: when the next ones arrive.
    """

    def __init__(self) -> None:
        self._arrivals: list[tuple[int, int, _Direction, list[bytes] | None]] = []
        self._count = 0
        self.next_us = NEVER_US

    def put(self, arrival_us: int, direction: _Direction, frames: list[bytes] | None) -> int:
        """Set frames on their way together; their number. None: the direction knows whether one still comes."""
        self._count += 1
        heapq.heappush(self._arrivals, (arrival_us, self._count, direction, frames))
        self.next_us = self._arrivals[0][0]
        return self._count

    def take(self) -> tuple[_Direction, list[bytes]]:
        """What arrives next."""
        _, number, direction, frames = heapq.heappop(self._arrivals)
        self.next_us = self._arrivals[0][0] if self._arrivals else NEVER_US
        return direction, direction.held(number) if frames is None else frames

    def next_is_inbound(self) -> bool:
        """Whether what arrives next arrives at the vehicle."""
        return self._arrivals[0][2].is_inbound

    def put_off(self, until_us: int) -> None:
        """Let the next frame arrive later."""
        heapq.heapreplace(self._arrivals, (until_us, *self._arrivals[0][1:]))
        self.next_us = self._arrivals[0][0]


class _Direction:
    """One direction of one port."""

    def __init__(self, link: LinkConfig, seed: int, faults: LinkFaults, road: _Road, port: int) -> None:
        self.port = port
        self.is_inbound = faults.direction == "to_vehicle"
        self._link = link
        self._latency_us = round(link.latency_ms * _US_PER_MS)
        self._is_random = bool(link.jitter_ms or link.loss)
        self._random = random.Random(seed)
        self._faults = faults
        self._road = road
        self._not_before_us = 0
        self._held: dict[int, tuple[int, bytes]] = {}

    def send(self, frames: list[bytes], now_us: int) -> None:
        """Frames set out: together, if nothing can happen to them."""
        if self._is_random or self._faults.entries:
            for frame in frames:
                self._send_one(frame, now_us)
        else:
            self._road.put((now_us + self._latency_us) & -GRID_US, self, frames)

    def _send_one(self, data: bytes, now_us: int) -> None:
        delay_us = self._latency_us
        is_lost = False
        if self._is_random:
            is_lost = self._random.random() < self._link.loss
            delay_us = round((self._link.latency_ms + self._link.jitter_ms * self._random.random()) * _US_PER_MS)
        if self._faults.entries:
            fate = self._faults.fate(data, now_us)
            if not (is_lost or fate.is_lost or self._is_noticed(fate)):
                self._send_spoiled(fate, now_us + delay_us)
        elif not is_lost:
            self._road.put(floor_to_grid_us(now_us + delay_us), self, [data])

    def held(self, number: int) -> list[bytes]:
        """The frame that waited in vain for others to overtake it; none if they did."""
        return [self._held.pop(number)[1]] if number in self._held else []

    def _is_noticed(self, fate: Fate) -> bool:
        """Whether the vehicle discards the frame, since it is damaged."""
        data = fate.data
        return fate.is_damaged and self.is_inbound and not (frame_length(data, 0) == len(data) and is_valid(data))

    def _send_spoiled(self, fate: Fate, arrival_us: int) -> None:
        arrival_us = max(floor_to_grid_us(arrival_us + fate.delay_us), self._not_before_us)
        if fate.holds_up:
            self._not_before_us = arrival_us
        if fate.behind:
            number = self._road.put(arrival_us + _HELD_AT_MOST_US, self, None)
            self._held[number] = (fate.behind, fate.data)
            return
        for copy in range(fate.copies + 1):
            self._road.put(floor_to_grid_us(arrival_us + copy * fate.later_us), self, [fate.data])
        self._overtake(arrival_us)

    def _overtake(self, arrival_us: int) -> None:
        """A frame arrives then: one that waited for it follows."""
        for number, (behind, data) in list(self._held.items()):
            if behind > 1:
                self._held[number] = (behind - 1, data)
            else:
                del self._held[number]
                self._road.put(arrival_us, self, [data])


class ImpairedLink:
    """`inner` as it appears through its links: `receive` sends into it, `datagrams_to_send` is what came out of it."""

    def __init__(self, inner: PortedEndpoint, link: LinkConfig, seed: int, ports: int = 1) -> None:
        self._inner = inner
        self._inner_us = inner.next_deadline_us()  # asked for again when it has acted, and not before
        self._is_ideal = not (link.latency_ms or link.jitter_ms or link.loss)
        self._faults = inner.script.link_faults
        self._road = _Road()
        self._inbound = [self._direction(link, seed, "to_vehicle", port) for port in range(ports)]
        self._outbound = [self._direction(link, seed, "from_vehicle", port) for port in range(ports)]
        self._last_input_us = -GRID_US
        self._arrived: list[list[bytes]] = [[] for _ in range(ports)]

    def _direction(self, link: LinkConfig, seed: int, name: Direction, port: int) -> _Direction:
        faults = LinkFaults(self._faults, name, f"{seed} {port}")
        own_seed = 2 * (seed + _PORT_SEEDS * port) + (name == "from_vehicle")
        return _Direction(link, own_seed, faults, self._road, port)

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """The far side sends a frame."""
        if self._is_ideal and not self._faults:
            self._inner.receive(data, now_us, port)
            self._inner_us = self._inner.next_deadline_us()
            return
        self._inbound[port].send([data], now_us)
        self._run(now_us)

    def next_deadline_us(self) -> int:
        """The next arrival on either side, or the inner endpoint's own deadline."""
        inner_us, road_us = self._inner_us, self._road.next_us
        return inner_us if inner_us <= road_us else road_us

    def on_deadline(self, now_us: int) -> None:
        """Let everything happen that is due."""
        if self._is_ideal and not self._faults:
            self._inner.on_deadline(now_us)
            self._inner_us = self._inner.next_deadline_us()
        else:
            self._run(now_us)

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """What reaches the far side of a port now."""
        if self._is_ideal and not self._faults:
            return self._inner.datagrams_to_send(port)
        arrived = self._arrived[port]
        if arrived:
            self._arrived[port] = []
        return arrived

    def _run(self, now_us: int) -> None:
        inner, road = self._inner, self._road
        while (inner_us := self._inner_us) <= now_us or road.next_us <= now_us:
            road_us = road.next_us
            if inner_us <= road_us:
                inner.on_deadline(inner_us)
                self._collect(inner_us)
            elif road_us <= self._last_input_us and road.next_is_inbound():
                # The inner endpoint's inputs have strictly increasing stamps.
                road.put_off(self._last_input_us + GRID_US)
            else:
                self._arrive(road_us)

    def _arrive(self, due_us: int) -> None:
        direction, frames = self._road.take()
        if not direction.is_inbound:
            self._arrived[direction.port] = self._arrived[direction.port] + frames
            return
        for frame in frames:
            self._last_input_us = due_us
            self._inner.receive(frame, due_us, direction.port)
            self._collect(due_us)

    def _collect(self, stamp_us: int) -> None:
        """The inner endpoint has acted: what it sends sets out."""
        inner = self._inner
        self._inner_us = inner.next_deadline_us()
        for direction in self._outbound:
            frames = inner.datagrams_to_send(direction.port)
            if frames:
                direction.send(frames, stamp_us)
