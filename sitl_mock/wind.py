"""The wind: steady, with gusts along north and east.

Each gust component is an Ornstein-Uhlenbeck process of standard deviation s and correlation time T, discretised
exactly: g[k+1] = a g[k] + s sqrt(1 - a^2) n[k], a = exp(-dt / T); it starts from its stationary distribution. The
gusts have their own random stream, so a flight without gusts is the same as if there were no such thing.
"""

from __future__ import annotations

import math
import random

from sitl_mock.geometry import Vec3


class Wind:
    """The wind of each tick, NED in m/s; the same seed gives the same gusts."""

    def __init__(self, steady_ned_m_s: Vec3, gusts_m_s: float, gusts_time_s: float, seed: int) -> None:
        self._steady_ned_m_s = steady_ned_m_s
        self._sd_m_s = gusts_m_s
        self._time_s = gusts_time_s
        self._random = random.Random(f"gusts of {seed}")
        self._north_m_s = self._random.gauss(0.0, gusts_m_s)
        self._east_m_s = self._random.gauss(0.0, gusts_m_s)

    def step(self, dt_s: float) -> Vec3:
        """Let `dt_s` pass; the wind of that interval."""
        if self._sd_m_s == 0.0:
            return self._steady_ned_m_s
        keep = math.exp(-dt_s / self._time_s)
        fresh_m_s = self._sd_m_s * math.sqrt(1.0 - keep * keep)
        self._north_m_s = keep * self._north_m_s + self._random.gauss(0.0, fresh_m_s)
        self._east_m_s = keep * self._east_m_s + self._random.gauss(0.0, fresh_m_s)
        north, east, down = self._steady_ned_m_s
        return (north + self._north_m_s, east + self._east_m_s, down)
