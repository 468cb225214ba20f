"""The wind: steady, with gusts. Each kind of gusts has its own random stream, so that a flight without them is the same
as if there were no such thing.
"""

from __future__ import annotations

from typing import Protocol

from sitl_mock.config import MockConfig
from sitl_mock.dryden import Dryden
from sitl_mock.geometry import Vec3
from sitl_mock.noise import BLOCK_STEPS, Memory, stream
from sitl_mock.plant import TICK_S, VehicleState


class Wind(Protocol):
    """The wind where the vehicle is."""

    def step(self, vehicle: VehicleState) -> Vec3:
        """The wind of the next tick, NED in m/s."""


def wind_of(config: MockConfig, seed: int) -> Wind:
    """The wind of a configuration."""
    if config.gusts_m_s == 0.0:
        return SteadyWind(config.wind_ned_m_s)
    if config.gusts_model == "dryden":
        return Dryden(config.wind_ned_m_s, config.gusts_m_s, seed)
    return Gusts(config.wind_ned_m_s, config.gusts_m_s, config.gusts_time_s, seed)


class SteadyWind:
    """The same wind always."""

    def __init__(self, wind_ned_m_s: Vec3) -> None:
        self._wind_ned_m_s = wind_ned_m_s

    def step(self, vehicle: VehicleState) -> Vec3:
        """The wind of the next tick, NED in m/s."""
        return self._wind_ned_m_s


class ChangedWind:
    """A wind, and so much more of it."""

    def __init__(self, wind: Wind, change_ned_m_s: Vec3) -> None:
        self._wind = wind
        self._change_ned_m_s = change_ned_m_s

    def step(self, vehicle: VehicleState) -> Vec3:
        """The wind of the next tick, NED in m/s."""
        (north, east, down), (n, e, d) = self._wind.step(vehicle), self._change_ned_m_s
        return (north + n, east + e, down + d)


class Gusts:
    """Steady wind, and gusts along north and east: each an Ornstein-Uhlenbeck process of the given size and memory."""

    def __init__(self, steady_ned_m_s: Vec3, sd_m_s: float, time_s: float, seed: int, dt_s: float = TICK_S) -> None:
        self._steady_ned_m_s = steady_ned_m_s
        self._sd_m_s = sd_m_s
        self._random = stream("gusts", seed)
        self._memory = Memory(time_s, self._random.standard_normal(2), dt_s)
        self._rows: list[list[float]] = []

    def step(self, vehicle: VehicleState) -> Vec3:
        """The wind of the next tick, NED in m/s."""
        if not self._rows:
            block = self._sd_m_s * self._memory.block(self._random.standard_normal((2, BLOCK_STEPS)))
            self._rows = block.T.tolist()
            self._rows.reverse()
        gust_n, gust_e = self._rows.pop()
        north, east, down = self._steady_ned_m_s
        return (north + gust_n, east + gust_e, down)
