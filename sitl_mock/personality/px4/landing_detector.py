"""Whether the vehicle stands on the ground, flies, or has crashed; after PX4's land detector."""

from __future__ import annotations

import math

from sitl_mock.plant import VehicleState

_LANDED_AFTER_US = 1_500_000
_CRASH_SPEED_M_S = 3.0
_CRASH_TILT_RAD = math.radians(60.0)
_LOW_THRUST = 0.3
"""Part of the hover thrust below which a vehicle on the ground counts as landed, and above which it takes off."""


class LandingDetector:
    """Follows the vehicle to and from the ground.

    Attributes:
        landed: it stands on the ground with little thrust.
        has_flown: it has left the ground since it was armed.
        landed_us: when it came down last.
        crashed: it came down hard or on its back, for ever.
        is_flipped: it lies on its back.
    """

    def __init__(self, hover_thrust_norm: float) -> None:
        self._low_thrust_norm = _LOW_THRUST * hover_thrust_norm
        self._contact_us: int | None = None
        self.landed = True
        self.has_flown = False
        self.landed_us = 0
        self.crashed = False
        self.is_flipped = False

    def step(self, truth: VehicleState, armed: bool, thrust_norm: float, boot_us: int) -> str:
        """One tick; the STATUSTEXT of what has changed, or empty. `thrust_norm` is the thrust in force."""
        if truth.impact is not None:
            self.is_flipped = truth.impact.tilt_rad > _CRASH_TILT_RAD
            if truth.impact.speed_m_s > _CRASH_SPEED_M_S or self.is_flipped:
                self.crashed = True
        has_thrust = armed and thrust_norm > self._low_thrust_norm
        if self.landed:
            if not truth.on_ground or has_thrust:
                self.landed, self.has_flown, self._contact_us = False, True, None
                return "Takeoff detected"
            return ""
        if not truth.on_ground or has_thrust:
            self._contact_us = None
        elif not armed:
            self.landed, self.landed_us = True, boot_us  # nothing is said of it
        elif self._contact_us is None:
            self._contact_us = boot_us
        elif boot_us - self._contact_us >= _LANDED_AFTER_US:
            self.landed, self.landed_us = True, boot_us
            return "Landing detected"
        return ""
