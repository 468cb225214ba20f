"""`mavquad fly`: over UDP, on a vehicle or on a mock of its own."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from mavquad.agent import Agent
from mavquad.cli.display import Display
from mavquad.cli.flight import Flight, default_run_dir, load_config
from mavquad.cli.mock_process import start_mock
from mavquad.cli.outcome import show
from mavquad.config import Config, Override
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.errors import Abandoned, EndpointError
from mavquad.url import MOCK, parse_url

REFRESH_S = 0.25
"""Between two looks at the flight: what is shown and kept then delays the loop by some milliseconds."""


def fly(path: Path | None, overrides: list[Override], run_dir: Path | None, as_json: bool) -> int:
    """Fly; returns the exit code."""
    config, _ = load_config(path, overrides)
    run_dir = run_dir or default_run_dir("fly")
    if config.link.url != MOCK:
        return asyncio.run(_fly(config, run_dir, as_json))
    with start_mock(config) as url:
        config = config.model_copy(update={"link": config.link.model_copy(update={"url": url})})
        return asyncio.run(_fly(config, run_dir, as_json))


async def _fly(config: Config, run_dir: Path, as_json: bool) -> int:
    clock = Clock()
    start_us = clock.now_us()
    started = time.perf_counter()
    agent = Agent(config, start_us)
    address = parse_url(config.link.url)
    with Flight(config, run_dir) as flight:
        try:
            driver = await open_live(agent, address, clock, start_us, flight.folder)
        except EndpointError:
            flight.folder.discard()
            raise
        await _drive(agent, driver, flight, as_json)
        wall_s = time.perf_counter() - started
        return flight.finish(agent, driver.runner, start_us, wall_s, driver.lateness_us, {}, as_json)


async def _drive(agent: Agent, driver: LiveDriver, flight: Flight, as_json: bool) -> None:
    try:
        with Display(quiet=as_json) as display, _stops_on_signals(driver):
            while not agent.done:
                await driver.wait(REFRESH_S)
                display.update(agent, flight.collect(agent))
    except BaseException as error:
        # Our own failure in flight, or the operator's: the firmware would keep our last torque, so ask it to hold.
        for datagram in agent.last_resort():
            driver.send_raw(datagram)
        if not isinstance(error, Abandoned):
            raise
        show(error)
    finally:
        driver.close()


@contextlib.contextmanager
def _stops_on_signals(driver: LiveDriver) -> Iterator[None]:
    """Ctrl-C (or SIGTERM) lands; a second one leaves at once, after one request to hold."""
    loop = asyncio.get_running_loop()
    presses = 0

    def stop() -> None:
        nonlocal presses
        presses += 1
        if presses == 1:
            driver.command("stop")
        else:
            words = "left before the landing: the vehicle was asked to hold, once, and is on its own now"
            driver.fail(Abandoned(words, "take it over, or land it with your ground station"))

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop)
    try:
        yield
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
