"""`mavquad sim`: agent and mock in lockstep."""

from __future__ import annotations

import bisect
import contextlib
import math
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from mavquad.agent import Agent
from mavquad.analysis.metrics import LEFT_OUT_S
from mavquad.cli.display import Display
from mavquad.cli.flight import Flight, default_run_dir, load_config
from mavquad.config import Override
from mavquad.drivers.collector import without_collector
from mavquad.drivers.key_file import key_of
from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.flight.machine import Phase
from mavquad.frames import ned_from_nwu
from mavquad.types import Vec3
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.faults import ImpairedLink

LIMIT_S = 4 * 3600.0
STEPS_BETWEEN_LOOKS = 100
"""Some 0.2 s of flight, after which rows are written, the story is told, and Ctrl-C is noticed."""


def sim(path: Path | None, overrides: list[Override], run_dir: Path | None, as_json: bool) -> int:
    """Fly in lockstep; returns the exit code."""
    config, mock_config = load_config(path, overrides)
    agent = Agent(config, START_US, key_of(config.link))
    mock = MockAutopilot(mock_config, config.seed, START_US)
    far = ImpairedLink(mock, mock_config.link, config.seed)
    with Flight(config, run_dir or default_run_dir("sim")) as flight:
        started = time.perf_counter()
        lockstep = Lockstep(agent, far, flight.folder)
        truth = _Truth(mock)
        with Display(quiet=as_json) as display, _notices_ctrl_c() as interrupted, without_collector():
            while not agent.done and lockstep.now_us < START_US + LIMIT_S * 1e6:
                if interrupted and not agent.interrupted:
                    lockstep.command("stop", agent.stop)
                if agent.awaits_record:
                    flight.keep_parameters(agent)
                    lockstep.command("kept", agent.kept)
                for _ in range(STEPS_BETWEEN_LOOKS):
                    lockstep.step()
                    truth.keep(agent)
                    if agent.done:
                        break
                notes = flight.collect(agent)
                if notes:
                    display.update(agent, notes)
        lockstep.end()
        wall_s = time.perf_counter() - started
        extra = {"true_position_rms_m": truth.position_rms_m(flight)}
        return flight.finish(agent, lockstep.near, START_US, wall_s, [], extra, as_json)


@contextlib.contextmanager
def _notices_ctrl_c() -> Iterator[list[int]]:
    """Ctrl-C lands, as it does in a live flight, between two steps so that it replays; yields what came in."""
    noticed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: noticed.append(number))
    try:
        yield noticed
    finally:
        signal.signal(signal.SIGINT, before)


class _Truth:
    """The mock's true position over time, to hold against the reference of the same moment."""

    def __init__(self, mock: MockAutopilot) -> None:
        self._mock = mock
        self._stamps_us: list[int] = []
        self._positions_ned_m: list[Vec3] = []

    def keep(self, agent: Agent) -> None:
        """Remember the present truth while the law flies."""
        if agent.phase is not Phase.FLYING:
            return
        stamp_us = self._mock.time_us
        if not self._stamps_us or self._stamps_us[-1] != stamp_us:
            self._stamps_us.append(stamp_us)
            self._positions_ned_m.append(self._mock.position_ned_m)

    def position_rms_m(self, flight: Flight) -> float | None:
        """RMS of the true position minus the reference, first 5 s left out; None for too short a flight."""
        rows = [row for row in flight.rows if row.phase == Phase.FLYING.value]
        squares = []
        for row in rows:
            if row.vehicle_stamp_us - rows[0].vehicle_stamp_us >= LEFT_OUT_S * 1e6:
                z, _, x, y = row.reference
                squares.append(math.dist(self._at(row.vehicle_stamp_us), ned_from_nwu((x, y, z))) ** 2)
        return math.sqrt(sum(squares) / len(squares)) if squares else None

    def _at(self, stamp_us: int) -> Vec3:
        """The truth between the two ticks around a moment."""
        after = min(max(bisect.bisect_left(self._stamps_us, stamp_us), 1), len(self._stamps_us) - 1)
        start_us, end_us = self._stamps_us[after - 1], self._stamps_us[after]
        share = (stamp_us - start_us) / (end_us - start_us)
        start, end = self._positions_ned_m[after - 1], self._positions_ned_m[after]
        north, east, down = (a + share * (b - a) for a, b in zip(start, end, strict=True))
        return (north, east, down)
