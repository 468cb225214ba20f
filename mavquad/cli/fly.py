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
from mavquad.cli.mock_options import refuse_without_mock
from mavquad.cli.mock_process import start_mock
from mavquad.cli.outcome import show
from mavquad.config import Config, Override
from mavquad.drivers.collector import without_collector
from mavquad.drivers.key_file import key_of
from mavquad.drivers.live import Clock, LiveDriver, open_live
from mavquad.errors import Abandoned, EndpointError
from mavquad.url import MOCK, parse_url

REFRESH_S = 0.25
"""Between two looks at the flight: what is shown and kept then delays the loop by some milliseconds."""


def fly(path: Path | None, overrides: list[Override], run_dir: Path | None, as_json: bool) -> int:
    """Fly; returns the exit code."""
    config, _ = load_config(path, overrides)
    refuse_without_mock(config, overrides)
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
    agent = Agent(config, start_us, key_of(config.link))
    address = parse_url(config.link.url)
    with Flight(config, run_dir) as flight:
        try:
            driver = await open_live(
                agent, address, clock, start_us, flight.folder, locked=lambda: agent.link.vehicle is not None
            )
        except EndpointError:
            flight.folder.discard()
            raise
        with without_collector():
            await _drive(agent, driver, flight, as_json)
        wall_s = time.perf_counter() - started
        return flight.finish(agent, driver.runner, start_us, wall_s, driver.lateness_us, {}, as_json)


async def _drive(agent: Agent, driver: LiveDriver, flight: Flight, as_json: bool) -> None:
    limit_us = flight.config.guards.lateness.limit_ms * 1e3
    with _stops_on_signals(driver):
        try:
            with Display(quiet=as_json) as display:
                while not agent.done:
                    looked_at = len(driver.lateness_us)
                    await driver.wait(REFRESH_S)
                    worst_us = max(driver.lateness_us[looked_at:], default=0)
                    if worst_us > limit_us > 0.0:
                        driver.command("late", worst_us)
                    display.update(agent, flight.collect(agent, driver.take_notes()))
                    if agent.awaits_record:
                        flight.keep_parameters(agent)
                        driver.command("kept")
        except BaseException as error:
            # Our own failure in flight, or the operator's: the firmware would keep our last torque, so ask it to hold.
            driver.abandon(agent.last_resort())
            if not isinstance(error, Abandoned):
                raise
            show(error)
        finally:
            driver.close()


@contextlib.contextmanager
def _stops_on_signals(driver: LiveDriver) -> Iterator[None]:
    """Ctrl-C, SIGTERM or a closed terminal lands; a second Ctrl-C leaves at once, after one request to hold.

    A closed terminal may send SIGHUP twice (the kernel, then the shell), so SIGHUP never leaves. Ctrl-Z would freeze
    the law in flight, so it does nothing.
    """
    loop = asyncio.get_running_loop()
    presses = 0

    def stop(leaves: bool) -> None:
        nonlocal presses
        presses += 1
        if presses == 1:
            driver.command("stop")
        elif leaves:
            words = "left before the landing: the vehicle was asked to hold, once, and is on its own now"
            driver.fail(Abandoned(words, "take it over, or land it with your ground station"))

    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as under nohup
        numbers.append(signal.SIGHUP)
    for number in numbers:
        loop.add_signal_handler(number, stop, number != signal.SIGHUP)
    suspend = signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, suspend)
        for number in numbers:
            loop.remove_signal_handler(number)
