"""The errors of the estimator's output, tick by tick: noise of each quantity, and a slow wander of the position.

"own" wander is an Ornstein-Uhlenbeck process in the position alone. "sih" is what a filter makes of a GPS: smooth, and
the velocity errs by its slope. Its size and memory are those of PX4 1.13.3 and 1.16.2 in recorded hovers of 25 s: sd
0.06 to 0.13 m north, 0.16 to 0.33 m east, 0.04 to 0.10 m down, 1/e after 1.5 to 4.4 s, 1 mm from sample to sample at
100 Hz, and 0.05 to 0.11 m/s in the velocity.
"""

from __future__ import annotations

import math

import numpy as np

from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.noise import BLOCK_STEPS, Block, Memory, Smooth, stream

_SIH_SD_M = np.array([[0.2], [0.2], [0.1]])
_SIH_TIME_S = 1.9
"""The memory of the smooth process is 1/e after 2.15 times this."""
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
            errors[:3] += _SIH_SD_M * place
            errors[3:6] += _SIH_SD_M * slope
        return errors
