"""When a takeoff is over: the autopilot holds its position in the air and has done so for a while.

The hover thrust is learned in that while, from the autopilot's own command.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from mavquad.endpoint import NEVER_US
from mavquad.flight.airframe import HoverThrust, within_hover
from mavquad.protocol.firmware import Firmware
from mavquad.types import Attitude, Position

HOVER_SPEED_M_S = 0.8
LIFTED_M = 0.5
PATIENCE = 3


class TakeoffWatch:
    """Watches a takeoff; `hover` learns while the vehicle is steady.

    Attributes:
        altitude_m: height that the autopilot climbs to; 0 while unknown.
        high_share: the share of it above which a steady hover is the takeoff's end.
    """

    def __init__(self, hover: HoverThrust, settle_s: float, floor_m: float) -> None:
        self._hover = hover
        self._settle_us = settle_s * 1e6
        self._least_height_m = max(floor_m, LIFTED_M)
        self._steady_since_us = NEVER_US
        self.altitude_m = 0.0
        self.high_share = 0.5

    def expect(self, firmware: Firmware, told: Mapping[str, float], ordered_m: float) -> None:
        """What is known beforehand: from the parameters that the vehicle told, by name, unless a height is ordered."""
        self.altitude_m = ordered_m or told.get(firmware.takeoff_parameter, firmware.takeoff_m)
        self.high_share = firmware.high_share
        self._hover.parameter_norm = within_hover(told.get(firmware.hover_parameter, 0.0))

    def is_high(self, height_m: float) -> bool:
        """Whether a hold at this height can be the takeoff's end; the estimate of a real vehicle drifts by a metre."""
        return height_m > max(self._least_height_m, self.high_share * self.altitude_m)

    @property
    def hovers(self) -> bool:
        """Whether it holds steadily, with a thrust that is known."""
        return self._steady_since_us != NEVER_US and self._hover.known

    @property
    def lacks_thrust(self) -> bool:
        """Whether it holds steadily and only the hover thrust is still unknown."""
        return self._steady_since_us != NEVER_US and not self._hover.known

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
        lifted = self.is_high(position.position_nwu_m[2] - ground_m)
        if not holds or not lifted or math.hypot(*position.velocity_nwu_m_s) > HOVER_SPEED_M_S:
            self._steady_since_us = NEVER_US
            self._hover.restart()
            return False
        self._steady_since_us = min(self._steady_since_us, now_us)
        steady_us = now_us - self._steady_since_us
        # A vehicle that does not tell its thrust is believed its parameter, but not at once.
        told = self._hover.parameter_norm > 0.0 and steady_us >= PATIENCE * self._settle_us
        return steady_us >= self._settle_us and (self._hover.known or told)
