"""The errors of the estimator's output, tick by tick: noise of each quantity, and a slow wander of the position.

"own" wander is an Ornstein-Uhlenbeck process in the position alone. "sih" is what PX4's EKF2 makes of the GPS of its own
simulator. Its size and memory are those of PX4 1.16.2, logged at 250 Hz beside the simulator's truth in a hover of 53 s:
smooth, sd 0.10 m north, 0.25 m east, 0.20 m down; and a velocity whose error is not the slope of the position's, but goes
with the position's error itself. By regression, with e that of the position and the rest an Ornstein-Uhlenbeck process,

    velocity error = a e + b e' + rest        a = 1.20, 1.28, 0.42 1/s,  b = 0.51, 0.87, 0.62,  sd of the rest 0.06 m/s

which is an sd of 0.15, 0.34, 0.11 m/s. (Recorded hovers of 1.13.3 and 1.16.2 without the truth beside them had 0.06 to 0.13 m,
0.16 to 0.33 m and 0.04 to 0.10 m, 1/e after 1.5 to 4.4 s.)
"""

from __future__ import annotations

import math

import numpy as np

from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.noise import BLOCK_STEPS, Block, Memory, Smooth, stream

_SIH_SD_M = np.array([[0.10], [0.25], [0.20]])
_SIH_TIME_S = 1.9
"""The memory of the smooth process is 1/e after 2.15 times this."""
_SIH_BY_PLACE_1_S = np.array([[1.20], [1.28], [0.42]])
_SIH_BY_SLOPE = np.array([[0.51], [0.87], [0.62]])
_SIH_REST_SD_M_S, _SIH_REST_TIME_S = 0.06, 1.0
_NOISES = 15


class EstimateErrors:
    """Fifteen numbers a tick: errors of position, velocity, attitude (rad), body rates, accelerometer; NED and FRD.

    As many numbers are drawn whatever the configuration, so that one error more or less leaves the others as they are.
    """

    def __init__(self, config: SensorsConfig, seed: int, dt_s: float) -> None:
        self._random = stream("estimator", seed)
        start = self._random.standard_normal(_NOISES + 6)
        sds = (
            config.position_noise_m,
            config.velocity_noise_m_s,
            math.radians(config.attitude_noise_deg),
            config.rates_noise_rad_s,
            config.accelerometer_noise_m_s2,
        )
        self._sds = np.repeat(sds, 3)[:, np.newaxis]
        self._noise = Memory(config.noise_time_s, start[:_NOISES], dt_s)
        self._walk = Memory(config.position_wander_time_s, start[_NOISES : _NOISES + 3], dt_s)
        self._walk_sd_m = config.position_wander_m
        self._smooth = Smooth(_SIH_TIME_S, start[_NOISES:], dt_s) if config.wander == "sih" else None
        self._rest_random = stream("estimator's velocity", seed)
        self._rest = Memory(_SIH_REST_TIME_S, self._rest_random.standard_normal(3), dt_s)
        self._rows: list[list[float]] = []

    def step(self) -> list[float]:
        """The errors of the next tick."""
        if not self._rows:
            self._rows = self._block().T.tolist()
            self._rows.reverse()
        return self._rows.pop()

    def _block(self) -> Block:
        white = self._random.standard_normal((_NOISES + 3, BLOCK_STEPS))
        errors = self._sds * self._noise.block(white[:_NOISES])
        if self._smooth is None:
            errors[:3] += self._walk_sd_m * self._walk.block(white[_NOISES:])
        else:
            place, slope = self._smooth.block(white[_NOISES:])
            rest = self._rest.block(self._rest_random.standard_normal((3, BLOCK_STEPS)))
            errors[:3] += _SIH_SD_M * place
            errors[3:6] += _SIH_SD_M * (_SIH_BY_PLACE_1_S * place + _SIH_BY_SLOPE * slope) + _SIH_REST_SD_M_S * rest
        return errors
