"""The simulated vehicle's clock against the wall's.

PX4's simulator in lockstep (1.14 and later) cannot quite keep up: its clock loses 10 to 25 ms a second, and whoever takes
its offset once is wrong soon. With the drift d, vehicle = start + (1 - d) (wall - start).
"""

from __future__ import annotations

import math

from mavquad.endpoint import GRID_US, floor_to_grid_us


class VehicleClock:
    """Both clocks show `start_us` at the start; `drift` is the share by which the vehicle's is slow."""

    def __init__(self, start_us: int, drift: float) -> None:
        self._start_us = start_us
        self._pace = 1.0 - drift

    def vehicle_us(self, wall_us: int) -> int:
        """What the vehicle's clock shows at a time of the wall's."""
        if self._pace == 1.0:
            return wall_us
        return floor_to_grid_us(self._start_us + int((wall_us - self._start_us) * self._pace))

    def wall_us(self, vehicle_us: int) -> int:
        """When on the wall's, on the grid, the vehicle's clock has come to this."""
        if self._pace == 1.0:
            return vehicle_us
        passed_us = (vehicle_us - self._start_us) / self._pace
        return self._start_us + math.ceil(passed_us / GRID_US) * GRID_US
