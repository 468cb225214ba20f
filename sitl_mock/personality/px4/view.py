"""What a mode sees in one tick, and what a mode is."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.inner_loops import Setpoint, TorqueSetpoint
from sitl_mock.personality.px4.settings import Settings
from sitl_mock.sensors import Estimate

IDLE = TorqueSetpoint(ZERO3, 0.0)
"""Motors turn without thrust."""


class View(NamedTuple):
    """Estimate, ground and settings of this tick.

    Attributes:
        on_ground: held by the ground.
        landed: the landing detector's word.
        height_m: above the ground, as a distance sensor has it.
        home_ned_m: where it was armed last, or where home was set.
        armed_us: when it was armed last.
    """

    estimate: Estimate
    on_ground: bool
    landed: bool
    height_m: float
    home_ned_m: Vec3
    settings: Settings
    armed_us: int
    boot_us: int
    dt_s: float


class FlightMode(Protocol):
    """One of the autopilot's own ways to fly."""

    def enter(self, view: View) -> None:
        """Begin it, here and now."""

    def setpoint(self, view: View) -> Setpoint:
        """What the inner loops are to follow until the next tick."""
