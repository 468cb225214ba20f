"""When a takeoff is over: the autopilot holds its position in the air and has done so for a while.

The hover thrust is learned in that while, from the autopilot's own command.
"""

from __future__ import annotations

import math

from mavquad.endpoint import NEVER_US
from mavquad.flight.airframe import HoverThrust
from mavquad.types import Attitude, Position

HOVER_SPEED_M_S = 0.4
LIFTED_M = 0.5


class TakeoffWatch:
    """Watches a takeoff; `hover` learns while the vehicle is steady."""

    def __init__(self, hover: HoverThrust, settle_s: float, floor_m: float) -> None:
        self._hover = hover
        self._settle_us = settle_s * 1e6
        self._least_height_m = max(floor_m, LIFTED_M)
        self._steady_since_us = NEVER_US

    def learn(self, thrust_norm: float, attitude: Attitude | None) -> None:
        """The autopilot's own thrust command (ATTITUDE_TARGET)."""
        if self._steady_since_us != NEVER_US and attitude is not None:
            self._hover.learn(thrust_norm, attitude)

    def is_over(self, position: Position, ground_m: float, holds: bool, now_us: int) -> bool:
        """Take in a position.

        Args:
            position: measured.
            ground_m: z (up) of the arming point. HEARTBEAT may still show the hold mode of before the takeoff there.
            holds: whether the autopilot is in its hold mode and the whole pose is fresh.
            now_us: when.
        """
        lifted = position.position_nwu_m[2] - ground_m > self._least_height_m
        if not holds or not lifted or math.hypot(*position.velocity_nwu_m_s) > HOVER_SPEED_M_S:
            self._steady_since_us = NEVER_US
            self._hover.restart()
            return False
        self._steady_since_us = min(self._steady_since_us, now_us)
        return now_us - self._steady_since_us >= self._settle_us
