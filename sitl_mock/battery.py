"""The battery of the simulated vehicle."""

from __future__ import annotations

from typing import NamedTuple


class Battery(NamedTuple):
    """What the autopilot measures of its battery: voltage in V, current in A, and the share of the charge left, 0 to 1."""

    voltage_v: float
    current_a: float
    remaining: float


FULL = Battery(16.2, 0.0, 1.0)
"""What PX4's SIH shows: four full cells."""
