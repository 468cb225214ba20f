"""The mock live: any number of vehicles on one clock, each with any number of links, in one event loop.

The rule of time is that of `mavquad.endpoint`: a deadline fires at its own time, however late the loop wakes; before a
frame is handed over, every deadline up to its stamp fires. One timer serves all vehicles. A loop that is late catches up
in slices, so that sockets are served between them and no client gets seconds of telemetry at a time; what is further
behind than that can bear is given up: simulated time slips.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mavquad.endpoint import GRID_US, NEVER_US
from mavquad.errors import InternalError
from mavquad.protocol.codec import is_known
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.clock import SimClock
from sitl_mock.config import MockConfig
from sitl_mock.endpoints import LinkSpec
from sitl_mock.faults import ImpairedLink
from sitl_mock.lateness import Lateness
from sitl_mock.transports import Counts, Transport, open_transport

BEHIND_MAX_S = 0.1
"""Real time by which a vehicle may be behind; beyond it, simulated time slips."""
SLICE_US = 20_000
"""Simulated time that passes at most before sockets are served again."""
_LOOK_US = 200_000
"""Simulated time between two looks at whether a vehicle flies."""


@dataclass(frozen=True, slots=True)
class VehicleSpec:
    """A vehicle to be run."""

    config: MockConfig
    seed: int
    links: tuple[LinkSpec, ...]


class Vehicle:
    """One mock autopilot behind its links, under the rule of time. It exists from its boot on.

    Attributes:
        autopilot: the mock, for those who want to know the truth; None before the boot.
        links: its sockets, in the order of the autopilot's ports.
        due_us: when it wants to act next.
        flights: how many times it was seen in the air after it had been on the ground.
    """

    def __init__(self, spec: VehicleSpec) -> None:
        self.spec = spec
        self.autopilot: MockAutopilot | None = None
        self.links: list[Transport] = []
        self.due_us = NEVER_US
        self.flights = 0
        self._endpoint: ImpairedLink | None = None
        self._last_input_us = 0
        self._look_us = 0
        self._flew = False

    def boot(self, now_us: int) -> None:
        """Switch it on; once is enough."""
        if self._endpoint is not None:
            return
        config, seed, kinds = self.spec.config, self.spec.seed, [link.kind for link in self.spec.links]
        self.autopilot = MockAutopilot(config, seed, now_us, kinds)
        self._endpoint = ImpairedLink(self.autopilot, config.link, seed, len(kinds))
        self._last_input_us = self._look_us = now_us
        self.due_us = self._endpoint.next_deadline_us()

    def advance(self, now_us: int) -> None:
        """Let everything happen that is due.

        Raises:
            InternalError: the mock's deadline does not move on.
        """
        endpoint = self._endpoint
        while self.due_us <= now_us and endpoint is not None:
            fired_us = self.due_us
            endpoint.on_deadline(fired_us)
            self._drain(endpoint)
            self.due_us = endpoint.next_deadline_us()
            if self.due_us <= fired_us:
                raise InternalError(f"the mock's deadline at {fired_us} us does not move on")
        if now_us >= self._look_us:
            self._look(now_us)

    def take(self, frames: Sequence[bytes], port: int, now_us: int) -> None:
        """Take in frames on a port; before the boot nobody hears them."""
        endpoint = self._endpoint
        if endpoint is None:
            return
        for frame in frames:
            if is_known(frame):
                self._last_input_us = max(now_us, self._last_input_us + GRID_US)
                self.advance(self._last_input_us)
                endpoint.receive(frame, self._last_input_us, port)
                self._drain(endpoint)
                self.due_us = endpoint.next_deadline_us()

    def counts(self) -> Counts:
        """What passed through all its links."""
        return sum((link.counts for link in self.links), Counts())

    def _drain(self, endpoint: ImpairedLink) -> None:
        for port, link in enumerate(self.links):
            frames = endpoint.datagrams_to_send(port)
            if frames:
                link.send(frames)

    def _look(self, now_us: int) -> None:
        self._look_us = now_us + _LOOK_US
        if self.autopilot is not None:
            flies = not self.autopilot.truth().landed
            self.flights += flies and not self._flew
            self._flew = flies


class Server:
    """Runs vehicles. Use it as a context; `run` until something ends it.

    Attributes:
        vehicles: in the order given.
        lateness: how long after their time deadlines fired.
    """

    def __init__(self, specs: Sequence[VehicleSpec], clock: SimClock, answers_all: bool = False) -> None:
        self.vehicles = [Vehicle(spec) for spec in specs]
        self.lateness = Lateness()
        self._clock = clock
        self._answers_all = answers_all
        self._behind_max_us = round(BEHIND_MAX_S * 1e6 * clock.speed)
        self._timer: asyncio.TimerHandle | None = None
        self._timer_us = NEVER_US
        self._over: asyncio.Future[None] | None = None

    async def __aenter__(self) -> Server:
        """Open all links, and boot who need not wait for a client.

        Raises:
            EndpointError: a port cannot be opened; none stays open.
        """
        loop = asyncio.get_running_loop()
        self._over = loop.create_future()
        try:
            for vehicle in self.vehicles:
                self._open(loop, vehicle)
        except BaseException:
            self.close()
            raise
        now_us = self._clock.now_us()
        for vehicle in self.vehicles:
            if not any(link.waits for link in vehicle.spec.links):
                vehicle.boot(now_us)
        self._schedule()
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def _open(self, loop: asyncio.AbstractEventLoop, vehicle: Vehicle) -> None:
        for port, spec in enumerate(vehicle.spec.links):

            def received(frames: list[bytes], port: int = port) -> None:
                self._guarded(lambda: vehicle.take(frames, port, min(self._now_us(), vehicle.due_us + SLICE_US)))

            def connected(waits: bool = spec.waits) -> None:
                if waits:
                    self._guarded(lambda: vehicle.boot(self._now_us()))

            vehicle.links.append(open_transport(loop, spec, received, connected, self._answers_all))

    def close(self) -> None:
        """Close all links."""
        if self._timer is not None:
            self._timer.cancel()
        for vehicle in self.vehicles:
            for link in vehicle.links:
                link.close()

    async def run(self) -> None:
        """Run until `stop`.

        Raises:
            Exception: what a vehicle raised, at once.
        """
        assert self._over is not None
        await self._over

    def stop(self) -> None:
        """End `run`."""
        if self._over is not None and not self._over.done():
            self._over.set_result(None)

    def _now_us(self) -> int:
        """Simulated time now; it slips where vehicles are too far behind."""
        now_us = self._clock.now_us()
        too_late_us = (
            now_us - min((vehicle.due_us for vehicle in self.vehicles), default=NEVER_US) - self._behind_max_us
        )
        if too_late_us > 0:
            self._clock.slip(too_late_us)
            return now_us - too_late_us
        return now_us

    def _wake(self) -> None:
        self._timer = None
        self._timer_us = NEVER_US
        self._guarded(self._advance)

    def _advance(self) -> None:
        """One slice for all vehicles, or less if less is due."""
        now_us = self._now_us()
        upto_us = min(now_us, self._due_us() + SLICE_US)
        for vehicle in self.vehicles:
            if vehicle.due_us <= upto_us:
                self.lateness.add(self._clock.real_s(now_us - vehicle.due_us))
                vehicle.advance(upto_us)

    def _due_us(self) -> int:
        """When the first vehicle wants to act."""
        return min((vehicle.due_us for vehicle in self.vehicles), default=NEVER_US)

    def _guarded(self, action: Callable[[], None]) -> None:
        """Run an action; what it raises ends `run`, since asyncio would only log it."""
        assert self._over is not None
        if self._over.done():
            return
        try:
            action()
        except Exception as error:  # noqa: BLE001 - handed on, not swallowed
            self._over.set_exception(error)
            return
        self._schedule()

    def _schedule(self) -> None:
        """One timer, for the vehicle that is due next."""
        due_us = self._due_us()
        if due_us >= self._timer_us or due_us >= NEVER_US:
            return
        if self._timer is not None:
            self._timer.cancel()
        wait_s = self._clock.real_s(max(0, due_us - self._clock.now_us()))
        self._timer = asyncio.get_running_loop().call_later(wait_s, self._wake)
        self._timer_us = due_us
