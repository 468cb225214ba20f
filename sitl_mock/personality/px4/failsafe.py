"""What PX4 looks at when it decides whether to fly something else than the pilot chose, common to all releases.

The releases decide differently: `failsafe_1_13` looks at the modes one by one, `failsafe_1_14` (1.14 and later) weighs
the actions of all that is wrong. Both are asked in every tick while armed.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from sitl_mock.battery import Battery
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.settings import Settings

NO_WARNING, LOW, CRITICAL_LEVEL, EMERGENCY_LEVEL = range(4)


class Situation(NamedTuple):
    """What is known now. `intended` is what the pilot chose, `flown` the mode in force up to now."""

    intended: Mode
    flown: Mode
    armed: bool
    landed: bool
    has_stream: bool
    has_sticks: bool
    had_sticks: bool
    has_ground_station: bool
    battery_level: int
    is_fence_breached: bool
    mission_is_over: bool
    settings: Settings
    boot_us: int


class Decision(NamedTuple):
    """What is flown. `terminate` and `disarm` stop the motors."""

    mode: Mode
    intended: Mode
    is_failsafe: bool = False
    terminate: bool = False
    disarm: bool = False


class Failsafe(Protocol):
    """A release's way to decide. What it has to say goes out as STATUSTEXT."""

    def step(self, now: Situation) -> Decision:
        """What is flown from now on."""

    def pilot_chose(self) -> None:
        """The pilot has selected a mode: what was done for him is over."""


def battery_level(battery: Battery, settings: Settings) -> int:
    """NO_WARNING to EMERGENCY_LEVEL by BAT_LOW_THR, BAT_CRIT_THR and BAT_EMERGEN_THR."""
    remaining = battery.remaining
    if remaining >= settings.bat_low_thr:
        return NO_WARNING
    if remaining >= settings.bat_crit_thr:
        return LOW
    return CRITICAL_LEVEL if remaining >= settings.bat_emergen_thr else EMERGENCY_LEVEL
