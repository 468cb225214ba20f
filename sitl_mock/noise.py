"""Random series with a memory, drawn in blocks: pure Python takes a number from them, numpy makes them.

An Ornstein-Uhlenbeck process of standard deviation 1 and correlation time T, discretised exactly for steps of h:

    x[k+1] = a x[k] + sqrt(1 - a^2) n[k],   a = exp(-h / T),   x[0] from its stationary distribution

Low-passed once more by the same T, as a Kalman filter does with what it measures, it is smooth: y' = (x - y) / T has
variance 1/2 and correlation exp(-t/T) (1 + t/T), so sqrt(2) y is a process of standard deviation 1 whose slope,
sqrt(2) (x - y) / T, has standard deviation 1 / T.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Block = NDArray[np.float64]
"""Series side by side: (series, steps)."""
BLOCK_STEPS = 250


def stream(name: str, seed: int) -> np.random.Generator:
    """A generator of its own for each use, so that one use more or less changes nothing in the others."""
    return np.random.default_rng(list(f"{name} of {seed}".encode()))


class Memory:
    """Ornstein-Uhlenbeck processes of standard deviation 1, some side by side; a correlation time of 0 is white noise."""

    def __init__(self, time_s: float, start: Block, dt_s: float) -> None:
        self._keep = math.exp(-dt_s / time_s) if time_s > 0 else 0.0
        self._last = start

    def block(self, white: Block) -> Block:
        """The next steps of each, from standard normal numbers (series, steps)."""
        if self._keep == 0.0:
            return white
        walked = _followed(self._keep, self._last, math.sqrt(1.0 - self._keep * self._keep) * white)
        self._last = walked[:, -1]
        return walked


class Smooth:
    """Smooth processes of standard deviation 1 with their slopes in 1/s: sqrt(2) y and sqrt(2) (x - y) / T, see above."""

    def __init__(self, time_s: float, start: Block, dt_s: float) -> None:
        first, second = start[: len(start) // 2], start[len(start) // 2 :]
        self._time_s = time_s
        self._keep = math.exp(-dt_s / time_s)
        self._rough = Memory(time_s, first, dt_s)
        self._last = 0.5 * first + 0.5 * second

    def block(self, white: Block) -> tuple[Block, Block]:
        """The next steps of each and of its slope, from standard normal numbers (series, steps)."""
        rough = self._rough.block(white)
        smooth = _followed(self._keep, self._last, (1.0 - self._keep) * rough)
        self._last = smooth[:, -1]
        root = math.sqrt(2.0)
        return root * smooth, root / self._time_s * (rough - smooth)


def _followed(keep: float, last: Block, inputs: Block) -> Block:
    """y[k] = keep y[k-1] + input[k], with y[-1] = last, of all series at once.

    By doubling: y[k] = sum over j of keep^j input[k-j] has its first 2, 4, 8 ... terms after each round.
    """
    y = inputs.copy()
    y[:, 0] += keep * last
    shift, factor = 1, keep
    while shift < y.shape[1]:
        y[:, shift:] += factor * y[:, :-shift]
        shift, factor = 2 * shift, factor * factor
    return y
