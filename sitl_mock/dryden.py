"""Gusts after Dryden, as MIL-F-8785C has them for low altitude (10 to 1000 ft).

With h the height in ft, V the airspeed, s_w the standard deviation of the vertical gusts (0.1 of the wind at 20 ft) and
u, v, w the gusts along the mean wind, across it and down:

    L_w = h,  L_u = L_v = h / (0.177 + 0.000823 h)^1.2        s_u = s_v = s_w / (0.177 + 0.000823 h)^0.4
    H_u = s_u sqrt(2 L_u / pi V) / (1 + T s)                                    T = L / V, of each its own
    H_v = s_v sqrt(L_v / pi V) (1 + sqrt(3) T s) / (1 + T s)^2                  and H_w likewise

So u is an Ornstein-Uhlenbeck process x of memory T. With x' the rate of such a process of standard deviation 1 and
y' = (x - y) / T its low-passed self, v is s_v / sqrt(2) (sqrt(3) x + (1 - sqrt(3)) y), of standard deviation s_v.

A vehicle that hovers in calm air would never leave its gust; V is 1 m/s at least.
"""

from __future__ import annotations

import math

from sitl_mock.geometry import Vec3
from sitl_mock.noise import BLOCK_STEPS, stream
from sitl_mock.plant import TICK_S, VehicleState

_FT_M = 0.3048
_LOWEST_FT, _HIGHEST_FT = 10.0, 1000.0
_LEAST_AIRSPEED_M_S = 1.0
_REFRESH_TICKS = 25
"""How often height and airspeed are looked at."""
_X, _Y = math.sqrt(1.5), (1.0 - math.sqrt(3.0)) / math.sqrt(2.0)


class Dryden:
    """Steady wind, and gusts after Dryden; `vertical_sd_m_s` is s_w."""

    def __init__(self, steady_ned_m_s: Vec3, vertical_sd_m_s: float, seed: int, dt_s: float = TICK_S) -> None:
        self._steady_ned_m_s = steady_ned_m_s
        north, east, _ = steady_ned_m_s
        speed = math.hypot(north, east)
        self._along = (north / speed, east / speed) if speed > 0 else (1.0, 0.0)
        self._sd_m_s = vertical_sd_m_s
        self._dt_s = dt_s
        self._random = stream("dryden", seed)
        u, v, w, v_rest, w_rest = self._random.standard_normal(5).tolist()
        self._u, self._v, self._w = u, (v, 0.5 * v + 0.5 * v_rest), (w, 0.5 * w + 0.5 * w_rest)
        self._rows: list[list[float]] = []
        self._ticks_left = 0

    def step(self, vehicle: VehicleState) -> Vec3:
        """The wind of the next tick, NED in m/s."""
        if self._ticks_left == 0:
            self._look_at(vehicle)
            self._ticks_left = _REFRESH_TICKS
        self._ticks_left -= 1
        if not self._rows:
            self._rows = self._random.standard_normal((BLOCK_STEPS, 3)).tolist()
        nu, nv, nw = self._rows.pop()
        (keep, fresh), (keep_w, fresh_w) = self._keep_uv, self._keep_w
        self._u = keep * self._u + fresh * nu
        self._v = _pair(self._v, keep, fresh * nv)
        self._w = _pair(self._w, keep_w, fresh_w * nw)
        return self._in_ned()

    def _look_at(self, vehicle: VehicleState) -> None:
        """The scales at this height and airspeed."""
        height_ft = max(_LOWEST_FT, min(_HIGHEST_FT, -vehicle.position_ned_m[2] / _FT_M))
        airspeed_m_s = max(_LEAST_AIRSPEED_M_S, math.dist(vehicle.velocity_ned_m_s, self._steady_ned_m_s))
        ground = 0.177 + 0.000823 * height_ft
        self._sd_uv_m_s = self._sd_m_s / ground**0.4
        self._keep_uv = _memory(self._dt_s * airspeed_m_s / (height_ft * _FT_M / ground**1.2))
        self._keep_w = _memory(self._dt_s * airspeed_m_s / (height_ft * _FT_M))

    def _in_ned(self) -> Vec3:
        u = self._sd_uv_m_s * self._u
        v = self._sd_uv_m_s * (_X * self._v[0] + _Y * self._v[1])
        w = self._sd_m_s * (_X * self._w[0] + _Y * self._w[1])
        (north, east, down), (cos, sin) = self._steady_ned_m_s, self._along
        return (north + cos * u - sin * v, east + sin * u + cos * v, down + w)


def _memory(step: float) -> tuple[float, float]:
    """What a process keeps over a step of that part of its memory, and how much comes anew."""
    keep = math.exp(-step)
    return keep, math.sqrt(1.0 - keep * keep)


def _pair(pair: tuple[float, float], keep: float, fresh: float) -> tuple[float, float]:
    """x and its low-passed self after a step; y sees the mean of x before and after."""
    x, y = pair
    after = keep * x + fresh
    return after, keep * y + (1.0 - keep) * 0.5 * (x + after)
