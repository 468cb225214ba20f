"""The ground: whether the vehicle stands on it, has landed, has flown, has come down hard."""

from __future__ import annotations

import math

from sitl_mock.plant import Impact

LANDED_AFTER_US = 1_580_000
"""On the ground with little thrust until it counts as landed, as recorded."""
_HIT_AFTER_US = 1_000_000
_CRASH_SPEED_M_S = 3.0
_CRASH_TILT_RAD = math.radians(60.0)
_TOUCH_DOWN_S = 0.8
"""While it lands, thrust fades away in this time after touch-down, as recorded."""


class Ground:
    """Watches the ground.

    Attributes:
        landed: what the autopilot believes.
        landed_us: when it came to believe so.
        flipped_us: when the vehicle came to lie on its side or back.
        crashed: whether it came down hard or so.
    """

    def __init__(self) -> None:
        self.landed = True
        self.landed_us = 0
        self.flipped_us: int | None = None
        self.crashed = False
        self._contact_us: int | None = None
        self._air_us: int | None = None
        self._flown_us = 0

    def hit(self, impact: Impact, boot_us: int) -> str:
        """The vehicle comes down; what SITL says about it, or nothing."""
        if impact.tilt_rad > _CRASH_TILT_RAD:
            self.flipped_us = boot_us
        self.crashed |= impact.speed_m_s > _CRASH_SPEED_M_S or self.flipped_us is not None
        has_flown = self._air_us is not None and boot_us - self._air_us >= _HIT_AFTER_US
        return f"SIM Hit ground at {impact.speed_m_s:.6f} m/s" if has_flown else ""

    def step(self, on_ground: bool, is_light: bool, boot_us: int) -> bool:
        """One tick; `is_light` with little thrust. True when it has just landed."""
        if not on_ground:
            self.landed, self._contact_us = False, None
            self._air_us = boot_us if self._air_us is None else self._air_us
            return False
        self._flown_us, self._air_us = self.flown_us(boot_us), None
        if self.landed or not is_light:
            self._contact_us = None
            return False
        self._contact_us = boot_us if self._contact_us is None else self._contact_us
        if boot_us - self._contact_us < LANDED_AFTER_US:
            return False
        self.landed, self.landed_us = True, boot_us
        return True

    def leave(self) -> None:
        """Thrust is given: it no longer counts as landed, whether it has left the ground or not."""
        self.landed = False

    def flown_us(self, boot_us: int) -> int:
        """How long it has been in the air since boot, all flights together."""
        return self._flown_us + (0 if self._air_us is None else boot_us - self._air_us)

    def thrust_share(self, boot_us: int) -> float:
        """The share of its thrust that a landing vehicle still gives."""
        if self._contact_us is None:
            return 1.0
        return max(0.0, 1.0 - (boot_us - self._contact_us) / 1e6 / _TOUCH_DOWN_S)
