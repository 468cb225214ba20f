"""mavquad in a program of one's own:

    async with mavquad.connect("udpin:127.0.0.1:14540") as vehicle:
        await vehicle.takeoff(3.0)
        await vehicle.fly(mavquad.Mission(name="figure_eight"))
        await vehicle.goto(2.0, 0.0, -1.0)
        await vehicle.land()

It is the same agent that `mavquad fly` flies, waiting for its operator: this program. What goes wrong is raised where it is
waited for, as one of `mavquad.errors`. Whatever happens in between, the vehicle is landed when the block ends.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from mavquad.agent import Agent
from mavquad.cli.flight import default_run_dir
from mavquad.cli.mock_process import start_mock
from mavquad.config import Config, Override, default_path, dump, load
from mavquad.drivers.collector import without_collector
from mavquad.drivers.key_file import key_of
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.drivers.parameters_file import write_parameters
from mavquad.drivers.run_folder import RunFolder
from mavquad.errors import FlightEnded, InputError
from mavquad.flight.machine import Phase
from mavquad.flight.mission import MissionParams
from mavquad.flight_record import Status
from mavquad.frames import ned_from_nwu
from mavquad.types import Vec3
from mavquad.url import MOCK, parse_url

Mission = MissionParams
"""What is flown; its keys are those of [mission]."""

LOOK_S = 0.05
"""Between two looks at how far it is."""


class Vehicle:
    """A vehicle that waits for orders. Use `connect`."""

    def __init__(self, agent: Agent, driver: LiveDriver, folder: RunFolder) -> None:
        self._agent = agent
        self._driver = driver
        self._folder = folder

    @property
    def status(self) -> Status:
        """A snapshot: phase, mode, errors, rates."""
        return self._agent.status()

    @property
    def run_dir(self) -> Path:
        """The run folder, as `mavquad fly` leaves one: `mavquad replay` and `mavquad report` take it."""
        return self._folder.path

    @property
    def position_ned_m(self) -> Vec3 | None:
        """North, east, down from where the law took over; None before."""
        row = self._agent.status().row
        if row is None:
            return None
        z, _, x, y = row.measured
        x0, y0, z0 = self._agent.law.origin_nwu_m
        return ned_from_nwu((x - x0, y - y0, z - z0))

    # ------------------------------------------------------------------ orders

    async def takeoff(self, height_m: float = 0.0) -> None:
        """Arm, take off and let the law take over; returns when it hovers.

        Args:
            height_m: above the ground; 0 is the autopilot's own (or `flight.takeoff_m`).

        Raises:
            InputError: it flies already.
            MavquadError: the vehicle refused, or the flight ended.
        """
        if self._agent.phase is not Phase.IDENTIFYING:
            raise InputError(
                f"takeoff: the vehicle is {self._agent.phase.value}", "take off once, before anything else"
            )
        if not 0.0 <= height_m <= 100.0:
            raise InputError(f"takeoff: {height_m:g} m is not between 0 and 100")
        self._driver.command("takeoff", height_m)
        await self._until(lambda: self._agent.phase is Phase.FLYING)

    async def fly(self, mission: Mission) -> None:
        """Fly a mission from where the vehicle is; returns at its end, where the law holds.

        Raises:
            InputError: it would lead out of the guards' volume, or ask for more than the law may; nothing is flown.
            MavquadError: the flight ended.
        """
        await self._order("fly", mission.model_dump_json(exclude_defaults=True))

    async def goto(self, north_m: float, east_m: float, down_m: float, heading_deg: float | None = None) -> None:
        """Fly to a place and hold there; returns when the reference has arrived.

        Args:
            north_m: from where the law took over.
            east_m: likewise.
            down_m: likewise; negative is higher.
            heading_deg: to look to, clockwise from north; None keeps it.

        Raises:
            InputError: the place is outside the guards' volume; nothing is flown.
            MavquadError: the flight ended.
        """
        place = (north_m, east_m, down_m)
        await self._order("goto", *(place if heading_deg is None else (*place, heading_deg)))

    async def hold(self, duration_s: float) -> None:
        """Let the law hold where it is for so long.

        Raises:
            MavquadError: the flight ended.
        """
        loop = asyncio.get_running_loop()
        end_s = loop.time() + duration_s
        await self._until(lambda: loop.time() >= end_s)

    async def land(self) -> None:
        """Hand back and land; returns when it has disarmed and its parameters are as they were.

        Raises:
            MavquadError: the flight ended otherwise.
        """
        if not self._agent.done:
            self._driver.command("land")
        await self._until(lambda: self._agent.done)

    async def _order(self, name: str, *args: float | str) -> None:
        self._driver.command(name, *args)
        if self._agent.order_fault:
            raise InputError(f"{name}: {self._agent.order_fault}", "nothing was flown; it holds where it was")
        await self._until(self._mission_over)

    def _mission_over(self) -> bool:
        status = self._agent.status()
        return status.mission_s >= status.mission_duration_s

    async def _until(self, reached: Callable[[], bool]) -> None:
        while not reached():
            await self._look()
            if self._agent.error is not None:
                raise self._agent.error
            if self._agent.done and not reached():
                raise FlightEnded("the flight has ended", "connect again for another one")

    async def _look(self) -> None:
        agent, folder = self._agent, self._folder
        await self._driver.wait(LOOK_S)
        rows, notes = agent.take_trace(), [*agent.take_notes(), *self._driver.take_notes()]
        folder.add(rows, notes)
        if agent.awaits_record and agent.changed_parameters is not None:
            write_parameters(folder, agent.changed_parameters)
            self._driver.command("kept")

    async def _leave(self) -> None:
        """The block is over, come what may: bring the vehicle down if it flies, and wait for it."""
        if not self._agent.done:
            self._driver.command("stop" if self._agent.phase is Phase.IDENTIFYING else "land")
        while not self._agent.done and self._driver.failure is None:
            await self._look()
        await self._look()
        if self._agent.changed_parameters is not None:
            write_parameters(self._folder, self._agent.changed_parameters)


@contextlib.asynccontextmanager
async def connect(
    url: str, *, config: Path | str | None = None, run_dir: Path | str | None = None, **settings: object
) -> AsyncIterator[Vehicle]:
    """Connect to a vehicle and get to know it. Nothing is changed on it or armed before `Vehicle.takeoff`.

    Args:
        url: of the vehicle, e.g. "udpin:127.0.0.1:14540" or "tcp:127.0.0.1:5760"; "mock" starts the bundled mock.
        config: a configuration file; the one of the package where none is given.
        run_dir: the run folder; a new one under runs/ where none is given.
        settings: keys of the configuration with two underscores for each dot, e.g. `law__omega0_rad_s=2.0`.

    Raises:
        MavquadError: the configuration, the address or the run folder is wrong, or no vehicle that can be flown is there.
    """
    mock = url == MOCK
    overrides = [Override(key.replace("__", "."), _text(value), key) for key, value in settings.items()]
    given = load(Path(config) if config is not None else default_path(), overrides)
    with start_mock(given) if mock else contextlib.nullcontext(url) as reached:
        found = _waiting(given, reached)
        async with _flown(found, Path(run_dir) if run_dir is not None else default_run_dir("api")) as vehicle:
            yield vehicle


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _waiting(config: Config, url: str) -> Config:
    """The configuration of a flight that its operator leads."""
    parse_url(url)  # a wrong one is told before anything is started
    flight = config.flight.model_copy(update={"waits_for_takeoff": True, "at_end": "hold"})
    mission = Mission(name="hover", hover_s=0.0, reference=config.mission.reference)
    link = config.link.model_copy(update={"url": url})
    return config.model_copy(update={"flight": flight, "mission": mission, "link": link})


@contextlib.asynccontextmanager
async def _flown(config: Config, run_dir: Path) -> AsyncIterator[Vehicle]:
    clock = Clock()
    start_us = clock.now_us()
    agent = Agent(config, start_us, key_of(config.link))
    folder = RunFolder(run_dir, dump(config))
    with contextlib.closing(folder), without_collector():
        driver = await open_live(
            agent, parse_url(config.link.url), clock, start_us, folder, locked=lambda: agent.link.vehicle is not None
        )
        vehicle = Vehicle(agent, driver, folder)
        with contextlib.closing(driver):
            try:
                await vehicle._until(lambda: agent.awaits_takeoff)
                yield vehicle
            finally:
                await vehicle._leave()
