"""Simulated time over the monotonic clock: faster or slower than real time, and never further behind than it can bear."""

from __future__ import annotations

import time
from collections.abc import Callable

from mavquad.endpoint import floor_to_grid_us


class SimClock:
    """Microseconds since the Unix epoch at `start_us`, from then on `speed` times as fast as real time.

    A machine that cannot keep up lets simulated time slip, as the real simulators in lockstep do: their stamps stay
    evenly spaced, and the vehicle's time falls behind the wall's.

    Attributes:
        speed: simulated seconds a second.
        slipped_us: how much simulated time was given up.
    """

    def __init__(self, start_us: int, speed: float = 1.0, monotonic_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.start_us = floor_to_grid_us(start_us)
        self.speed = speed
        self.slipped_us = 0
        self._monotonic_ns = monotonic_ns
        self._start_ns = monotonic_ns()

    def now_us(self) -> int:
        """Now, on the grid of time."""
        passed_us = (self._monotonic_ns() - self._start_ns) * self.speed / 1000.0
        return floor_to_grid_us(self.start_us + int(passed_us) - self.slipped_us)

    def slip(self, duration_us: int) -> None:
        """Set simulated time back."""
        self.slipped_us += duration_us

    def real_s(self, simulated_us: int) -> float:
        """Real seconds in which that much simulated time passes."""
        return simulated_us * 1e-6 / self.speed
