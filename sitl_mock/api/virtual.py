"""A mock vehicle in virtual time: no socket, no waiting; time passes when a test asks for it, or when a client waits."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from mavquad.drivers.lockstep import START_US
from mavquad.endpoint import GRID_US, NEVER_US, floor_to_grid_us
from mavquad.protocol.codec import Framer, is_known
from sitl_mock.api.setup import WHOSE, FaultTables, vehicle_config
from sitl_mock.api.story import Story
from sitl_mock.autopilot import MockAutopilot, Truth
from sitl_mock.config import Autopilot
from sitl_mock.config.faults import faults_of
from sitl_mock.faults import ImpairedLink
from sitl_mock.port import PortKind

if TYPE_CHECKING:
    from sitl_mock.api.connection import VirtualConnection

_US_PER_S = 1_000_000
_INBOX_MAX = 100_000
"""Frames kept for a client that does not read; the oldest go first."""


class Outlet:
    """A client's end of a link: bytes go to the vehicle, frames come from it.

    Attributes:
        inbox: what came and was not read: (stamp in us, frame).
    """

    def __init__(self, vehicle: VirtualVehicle, link: int) -> None:
        self.vehicle = vehicle
        self.inbox: deque[tuple[int, bytes]] = deque(maxlen=_INBOX_MAX)
        self._link = link
        self._framer = Framer()

    def write(self, data: bytes) -> None:
        """Send bytes to the vehicle, now."""
        self.vehicle._take(self._framer.push(data), self._link)


class VirtualVehicle:
    """A mock vehicle that lives in virtual time. It boots when it is made; the same calls and seed give the same bytes.

        vehicle = VirtualVehicle(autopilot="px4", firmware="1.16", wind=(3, 0, 0), seed=1)
        connection = vehicle.connect()
        connection.wait_heartbeat()
        vehicle.run(5.0)
        assert not vehicle.truth.armed

    Attributes:
        config: its configuration, complete.
        now_us: virtual time, Unix microseconds; it starts on 2020-01-01.
        texts: the STATUSTEXTs that reached clients; PX4 sends none before it hears a ground station's HEARTBEAT.
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
        links: Sequence[PortKind] = (),
        limit_s: float = 3600.0,
        **keys: Any,
    ) -> None:
        """Switch it on.

        Args:
            autopilot, firmware, faults, wind, vehicle, keys: see `sitl_mock.api.setup.vehicle_config`.
            seed: of everything random.
            links: what the autopilot takes each of its links for: PX4 "onboard" (the default) or "gcs", ArduPilot "serial".
            limit_s: virtual time after which any waiting ends with a TimeoutError: a test never hangs.

        Raises:
            ConfigError: a value is not allowed; says which, and what is.
        """
        self.config = vehicle_config(autopilot, firmware, faults=faults, wind=wind, vehicle=vehicle, **keys)
        kinds = tuple(links) or (("serial",) if autopilot == "ardupilot" else ("onboard",))
        self._mock = MockAutopilot(self.config, seed, START_US, kinds)
        self._endpoint = ImpairedLink(self._mock, self.config.link, seed, len(kinds))
        self.now_us = START_US
        self._limit_us = START_US + round(limit_s * _US_PER_S)
        self._last_input_us = START_US
        self._outlets: list[list[Outlet]] = [[] for _ in kinds]
        self._errands: list[tuple[int, int, int, Callable[[], object]]] = []
        self._errand_count = 0
        self._story = Story()

    # --- time ----------------------------------------------------------------------------------------------------

    @property
    def now_s(self) -> float:
        """Virtual time since the vehicle was switched on, in s."""
        return (self.now_us - START_US) / _US_PER_S

    def run(self, seconds: float) -> None:
        """Let virtual time pass.

        Raises:
            TimeoutError: the limit of the vehicle's virtual time is reached.
        """
        self.wait(lambda: False, self.now_us + round(seconds * _US_PER_S))

    def run_until(self, condition: Callable[[Truth], bool], limit_s: float) -> None:
        """Let virtual time pass until a condition on the truth holds, e.g. `lambda truth: truth.landed`.

        Raises:
            TimeoutError: it does not hold within `limit_s`.
        """
        if not self.wait(lambda: condition(self.truth), self.now_us + round(limit_s * _US_PER_S)):
            raise TimeoutError(f"not within {limit_s:g} s of virtual time:\n{self.report()}")

    def every(self, period_s: float, action: Callable[[], object]) -> Callable[[], None]:
        """Do something now, and again every so often while virtual time passes, e.g. send a setpoint.

        Returns:
            what ends it.
        """
        self._errand_count += 1
        number = self._errand_count
        period_us = max(GRID_US, round(period_s * _US_PER_S))
        heapq.heappush(self._errands, (self.now_us + period_us, number, period_us, action))
        action()

        def stop() -> None:
            self._errands = [errand for errand in self._errands if errand[1] != number]
            heapq.heapify(self._errands)

        return stop

    @contextmanager
    def clock(self) -> Iterator[None]:
        """Inside this block `time.time()`, `time.monotonic()` and `time.sleep(s)` are virtual, for scripts that use them.

        What a script has imported by `from time import sleep` stays as it is.
        """
        with patch.multiple("time", time=lambda: self.now_us / _US_PER_S, monotonic=lambda: self.now_s, sleep=self.run):
            yield

    def wait(self, condition: Callable[[], bool], until_us: int) -> bool:
        """Let virtual time pass until the condition holds, at most until then; says whether it does."""
        while not condition():
            due_us = min(self._endpoint.next_deadline_us(), self._errands[0][0] if self._errands else NEVER_US)
            if min(due_us, until_us) > self._limit_us:
                raise TimeoutError(f"the limit of {self.now_s:.0f} s of virtual time is reached:\n{self.report()}")
            if due_us > until_us:
                self.now_us = max(self.now_us, floor_to_grid_us(until_us))
                return condition()
            self.now_us = max(self.now_us, due_us)
            if self._endpoint.next_deadline_us() <= due_us:
                self._endpoint.on_deadline(due_us)
                self._hand_out(due_us)
            else:
                self._run_errand()
        return True

    def _run_errand(self) -> None:
        due_us, number, period_us, action = self._errands[0]
        heapq.heapreplace(self._errands, (due_us + period_us, number, period_us, action))
        action()

    # --- clients -------------------------------------------------------------------------------------------------

    def connect(self, link: int = 0, source_system: int = 255, source_component: int = 0) -> VirtualConnection:
        """A pymavlink connection to the vehicle, as `mavutil.mavlink_connection(...)` makes them.

        Where it would wait, virtual time passes; timeouts count in virtual time. Several may share a link: each gets all
        that is sent there, as behind a router.
        """
        from sitl_mock.api.connection import VirtualConnection

        return VirtualConnection(self.outlet(link), source_system, source_component)

    def outlet(self, link: int = 0) -> Outlet:
        """A client's end of a link, for clients without pymavlink: bytes in, frames out."""
        outlet = Outlet(self, link)
        self._outlets[link].append(outlet)
        return outlet

    def disconnect(self, outlet: Outlet) -> None:
        """Nothing more comes there."""
        for outlets in self._outlets:
            if outlet in outlets:
                outlets.remove(outlet)

    def _take(self, frames: list[bytes], link: int) -> None:
        """Hand frames to the vehicle, each with a stamp of its own."""
        for frame in frames:
            if is_known(frame):
                stamp_us = self._last_input_us = max(self.now_us, self._last_input_us + GRID_US)
                while self._endpoint.next_deadline_us() <= stamp_us:
                    due_us = self._endpoint.next_deadline_us()
                    self._endpoint.on_deadline(due_us)
                    self._hand_out(due_us)
                self.now_us = stamp_us
                self._endpoint.receive(frame, stamp_us, link)
                self._hand_out(stamp_us)

    def _hand_out(self, stamp_us: int) -> None:
        for link, outlets in enumerate(self._outlets):
            frames = self._endpoint.datagrams_to_send(link)
            if frames:
                self._story.hear(self.now_s, frames)
                for outlet in outlets:
                    outlet.inbox.extend((stamp_us, frame) for frame in frames)
        self._story.see(self.now_s, self._mock)

    # --- what happens --------------------------------------------------------------------------------------------

    @property
    def truth(self) -> Truth:
        """What really is, now: position, velocity, attitude, rates, armed, mode, landed, crashed, battery."""
        return self._mock.truth()

    @property
    def texts(self) -> list[str]:
        """The STATUSTEXTs that were sent; PX4 sends none before it hears a ground station's HEARTBEAT."""
        return self._story.texts

    def fail(self, kind: str, **keys: Any) -> None:
        """Let something go wrong from now on: a fault as in a fault file, whose times count from now unless `since` is given.

        vehicle.fail("silent", for_s=2.0)

        Raises:
            ConfigError: a value is not allowed; says which, and what is.
        """
        (fault,) = faults_of([{"kind": kind, **keys}], WHOSE, self.config.autopilot)
        self._mock.fail(fault, from_now="since" not in keys)
        self._story.tell(self.now_s, f"fault: {kind}")

    def report(self) -> str:
        """What happened so far, line by line, and the state now."""
        return self._story.report(self.truth)
