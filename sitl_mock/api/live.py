"""A mock vehicle on the loopback interface, for clients of any kind: it runs in a thread of the test's own process."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any, Self, TypeVar

from mavquad.errors import InternalError
from mavquad.url import Address
from sitl_mock.api.setup import WHOSE, FaultTables, vehicle_config
from sitl_mock.api.story import Story
from sitl_mock.autopilot import MockAutopilot, Truth
from sitl_mock.clock import SimClock
from sitl_mock.config import Autopilot
from sitl_mock.config.faults import faults_of
from sitl_mock.endpoints import parse_endpoint
from sitl_mock.server import Server, Vehicle, VehicleSpec
from sitl_mock.transports import Counts, Transport
from sitl_mock.words import client_url

R = TypeVar("R")

_ANSWER_LIMIT_S = 10.0
_LOOK_S = 0.01
"""Real time between two looks at the truth while a test waits for something."""


class LiveVehicle:
    """A mock vehicle that runs in real time, or `speed` times as fast, on free ports of the loopback interface.

        with LiveVehicle(autopilot="ardupilot", speed=5.0) as vehicle:
            connection = mavutil.mavlink_connection(vehicle.url)

    It boots at the start of the block, and is gone at its end.

    Attributes:
        config: its configuration, complete.
        urls: how a client reaches each of its links, in the words of pymavlink and MAVProxy; MAVSDK calls tcp "tcpout".
    """

    def __init__(
        self,
        autopilot: Autopilot = "px4",
        firmware: str = "auto",
        *,
        faults: FaultTables = (),
        wind: Sequence[float] = (0.0, 0.0, 0.0),
        seed: int = 1,
        vehicle: str | Path | dict[str, Any] | None = None,
        speed: float = 1.0,
        endpoints: Sequence[str] = ("tcpin:127.0.0.1:0",),
        **keys: Any,
    ) -> None:
        """Prepare it.

        Args:
            autopilot, firmware, faults, wind, vehicle, keys: see `sitl_mock.api.setup.vehicle_config`.
            seed: of everything random.
            speed: simulated seconds a second.
            endpoints: its links, as `sitl-mock --endpoint` takes them; port 0 is any free one. A client of a UDP port must
                speak first, one of a TCP port need not.

        Raises:
            ConfigError, EndpointError: a value is not allowed; says which, and what is.
        """
        self.config = vehicle_config(autopilot, firmware, faults=faults, wind=wind, vehicle=vehicle, **keys)
        self.urls: list[str] = []
        links = tuple(parse_endpoint(url, autopilot) for url in endpoints)
        self._spec = VehicleSpec(self.config, seed, links)
        self._speed = speed
        self._story = Story()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="mock vehicle", daemon=True)
        self._started: Future[tuple[asyncio.AbstractEventLoop, Server]] = Future()
        self._failure: Exception | None = None
        self._last: Truth | None = None

    # --- its thread ----------------------------------------------------------------------------------------------

    def __enter__(self) -> Self:
        """Switch it on.

        Raises:
            EndpointError: a port cannot be opened.
        """
        self._thread.start()
        self._started.result(_ANSWER_LIMIT_S)
        return self

    def __exit__(self, *_: object) -> None:
        """Switch it off.

        Raises:
            InternalError: the mock failed while it ran.
        """
        loop, server = self._started.result()
        with contextlib.suppress(RuntimeError):  # it failed, and its loop is closed
            loop.call_soon_threadsafe(server.stop)
        self._thread.join(_ANSWER_LIMIT_S)
        if self._failure is not None:
            raise InternalError(f"the mock vehicle failed: {self._failure}") from self._failure

    async def _serve(self) -> None:
        try:
            async with Server([self._spec], SimClock(time.time_ns() // 1000, self._speed)) as server:
                vehicle = server.vehicles[0]
                overheard: list[Transport] = [_Overheard(link, self._story, vehicle) for link in vehicle.links]
                vehicle.links[:] = overheard
                self.urls = [client_url(link) for link in overheard]
                self._started.set_result((asyncio.get_running_loop(), server))
                watch = asyncio.create_task(self._watch(vehicle))
                await server.run()
                watch.cancel()
                if vehicle.autopilot is not None:
                    self._last = vehicle.autopilot.truth()
        except Exception as error:  # noqa: BLE001 - handed on to the thread that asks
            self._failure = error
            if not self._started.done():
                self._started.set_exception(error)

    async def _watch(self, vehicle: Vehicle) -> None:
        """Keep the story."""
        while True:
            if vehicle.autopilot is not None:
                self._story.see(vehicle.autopilot.truth().time_s, vehicle.autopilot)
            await asyncio.sleep(_LOOK_S)

    def _ask(self, question: Callable[[MockAutopilot], R]) -> R:
        """What the vehicle's thread answers."""
        if self._failure is not None:
            raise InternalError(f"the mock vehicle failed: {self._failure}") from self._failure
        loop, server = self._started.result(_ANSWER_LIMIT_S)

        async def answer() -> R:
            mock = server.vehicles[0].autopilot
            if mock is None:
                raise TimeoutError("the vehicle has not booted: no client has connected")
            return question(mock)

        asked = answer()
        try:
            return asyncio.run_coroutine_threadsafe(asked, loop).result(_ANSWER_LIMIT_S)
        except (RuntimeError, CancelledError):  # its loop has just ended
            asked.close()
            raise InternalError(f"the mock vehicle is gone: {self._failure or 'switched off'}") from self._failure

    # --- as a virtual one ----------------------------------------------------------------------------------------

    @property
    def url(self) -> str:
        """How a client reaches its first link, e.g. tcp:127.0.0.1:40123."""
        return self.urls[0]

    def connect(self, link: int = 0, source_system: int = 255, source_component: int = 0) -> Any:
        """A pymavlink connection to one of its links."""
        from sitl_mock.api.connection import live_connection

        return live_connection(self.urls[link], source_system, source_component)

    @property
    def truth(self) -> Truth:
        """What really is, now; after the end of the block, what was at last. Safe from any thread."""
        return self._last if self._last is not None else self._ask(MockAutopilot.truth)

    @property
    def texts(self) -> list[str]:
        """The STATUSTEXTs that were sent; PX4 sends none before it hears a ground station's HEARTBEAT."""
        return self._story.texts

    @property
    def now_s(self) -> float:
        """Simulated time since it was switched on, in s."""
        return self.truth.time_s

    def run(self, seconds: float) -> None:
        """Wait until so much simulated time has passed."""
        until_s = self.now_s + seconds
        while self.now_s < until_s:
            threading.Event().wait(min(_LOOK_S, seconds / self._speed))

    def run_until(self, condition: Callable[[Truth], bool], limit_s: float) -> None:
        """Wait until a condition on the truth holds, e.g. `lambda truth: truth.landed`.

        Raises:
            TimeoutError: it does not hold within `limit_s` of simulated time.
        """
        until_s = self.now_s + limit_s
        while not condition(truth := self.truth):
            if truth.time_s >= until_s:
                raise TimeoutError(f"not within {limit_s:g} s of simulated time:\n{self.report()}")
            threading.Event().wait(_LOOK_S)

    def fail(self, kind: str, **keys: Any) -> None:
        """Let something go wrong from now on: a fault as in a fault file, whose times count from now unless `since` is given.

        Raises:
            ConfigError: a value is not allowed; says which, and what is.
        """
        (fault,) = faults_of([{"kind": kind, **keys}], WHOSE, self.config.autopilot)
        self._ask(lambda mock: mock.fail(fault, from_now="since" not in keys))
        self._story.tell(self.now_s, f"fault: {kind}")

    def report(self) -> str:
        """What happened so far, line by line, and the state now."""
        return self._story.report(self.truth)


class _Overheard:
    """A link whose frames go into the story as well."""

    def __init__(self, link: Transport, story: Story, vehicle: Vehicle) -> None:
        self.spec = link.spec
        self._link = link
        self._story = story
        self._vehicle = vehicle

    @property
    def address(self) -> Address:
        """The local address."""
        return self._link.address

    @property
    def counts(self) -> Counts:
        """What passed so far."""
        return self._link.counts

    def send(self, frames: Sequence[bytes]) -> None:
        """Send frames to who is served, if anybody is."""
        if self._vehicle.autopilot is not None:
            self._story.hear(self._vehicle.autopilot.truth().time_s, frames)
        self._link.send(frames)

    def close(self) -> None:
        """Close the socket."""
        self._link.close()
