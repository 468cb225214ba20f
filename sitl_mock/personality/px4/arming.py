"""Whether the motors may turn: what keeps PX4 from arming and from disarming, and when it disarms by itself."""

from __future__ import annotations

from sitl_mock.personality.px4.landing_detector import LandingDetector
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.settings import Settings

RESOLVE = "Arming denied: Resolve system health failures first"
UNSUITABLE = "Mode not suitable for takeoff"
_US_PER_S = 1e6
_UNSUITABLE_113 = frozenset({Mode.RTL, Mode.FOLLOW, Mode.PRECLAND, Mode.ORBIT})


class Arming:
    """Attributes: `armed`, and `armed_us`, since when."""

    def __init__(self, is_113: bool, ground: LandingDetector, ready_us: int) -> None:
        self._is_113 = is_113
        self._ground = ground
        self._ready_us = ready_us
        self.armed = False
        self.armed_us = 0

    def is_ready(self, mode: Mode, can_run: bool, boot_us: int) -> bool:
        """Whether the preflight checks pass (SYS_STATUS PREARM_CHECK); they run while disarmed."""
        if boot_us < self._ready_us or self._ground.crashed:
            return False
        return self.armed or not self._denied_by_mode(mode, can_run)

    def denied(self, mode: Mode, can_run: bool, boot_us: int) -> str:
        """Why it cannot be armed now, in PX4's words; empty: it can. `can_run`: the mode has what it needs."""
        if self._ground.crashed:
            what = "Roll failure detected" if self._ground.is_flipped else "crash detected"
            return f"Preflight Fail: {what}"
        if boot_us < self._ready_us:
            return "Preflight Fail: ekf2 missing data" if self._is_113 else RESOLVE
        return self._denied_by_mode(mode, can_run)

    def _denied_by_mode(self, mode: Mode, can_run: bool) -> str:
        if self._is_113:
            return UNSUITABLE if mode in _UNSUITABLE_113 else ""
        return "" if can_run and not mode.prevents_arming else RESOLVE

    def arm(self, boot_us: int) -> None:
        """The motors may turn."""
        self.armed, self.armed_us = True, boot_us
        self._ground.has_flown = False

    def disarms_itself(self, settings: Settings, boot_us: int) -> str:
        """By what it is disarmed on the ground now; empty: by nothing. A time of zero or less is never."""
        if self._ground.has_flown:
            after_s, since_us, reason = settings.com_disarm_land, self._ground.landed_us, "landing"
        else:
            after_s, since_us, reason = settings.com_disarm_prflt, self.armed_us, "auto preflight disarming"
        return reason if after_s > 0 and boot_us - since_us >= after_s * _US_PER_S else ""
