"""ArduCopter's failsafes: the ground station's heartbeat, the battery, the fence; what each makes the vehicle do.

That of the ground station is as recorded; battery and fence follow ArduCopter's source and parameters.
"""

from __future__ import annotations

import math

from sitl_mock.personality import Sender
from sitl_mock.personality.ardupilot.copter import Copter
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.news import CRITICAL, WARNING
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

_CHECK_EVERY_US = 100_000
_CAPACITY_MAH = "BATT_CAPACITY"
_ALT_MAX, _CIRCLE = 1, 2
_GCS_ACTIONS = {1: Mode.RTL, 3: Mode.RTL, 4: Mode.LAND, 5: Mode.LAND, 6: Mode.RTL, 7: Mode.BRAKE}
"""FS_GCS_ENABLE; the smart return of 3 and 4 has no path here and falls back, as on the real one without a path."""
_BATTERY_ACTIONS = {1: Mode.LAND, 2: Mode.RTL, 3: Mode.RTL, 4: Mode.LAND, 6: Mode.RTL, 7: Mode.BRAKE}
_FENCE_ACTIONS = {1: Mode.RTL, 2: Mode.LAND, 3: Mode.RTL, 4: Mode.BRAKE, 5: Mode.LAND}


class Failsafes:
    """Watches, ten times a second.

    Attributes:
        breaches: how many times the fence was left.
        is_outside: whether it is left now.
    """

    def __init__(self, copter: Copter, params: Parameters) -> None:
        self._copter = copter
        self._params = params
        self._heard_us: int | None = None
        self._check_us = 0
        self._low_since_us: dict[str, int] = {}
        self.breaches = 0
        self.is_outside = False

    def heard(self, sender: Sender, boot_us: int) -> None:
        """A HEARTBEAT came in; only that of MAV_GCS_SYSID counts."""
        if sender[0] == int(self._params["MAV_GCS_SYSID"]):
            self._heard_us = boot_us

    def step(self, estimate: Estimate, boot_us: int) -> None:
        """Look at everything that can fail."""
        if boot_us < self._check_us:
            return
        self._check_us = boot_us + _CHECK_EVERY_US
        self._watch_ground_station(boot_us)
        self._watch_battery("low", "LOW", estimate, boot_us)
        self._watch_battery("critical", "CRT", estimate, boot_us)
        self._watch_fence(estimate, boot_us)

    # --- ground station ----------------------------------------------------------------------------------------

    def _watch_ground_station(self, boot_us: int) -> None:
        copter, params = self._copter, self._params
        if self._heard_us is None or not params["FS_GCS_ENABLE"]:
            self._clear_ground_station("GCS Failsafe Cleared")
            return
        if boot_us - self._heard_us < 1e6 * params["FS_GCS_TIMEOUT"] - 2 * _CHECK_EVERY_US:
            self._clear_ground_station("GCS Failsafe Cleared")
        elif "gcs" not in copter.in_failsafe:
            copter.in_failsafe.add("gcs")
            copter.news.say(WARNING, "GCS Failsafe")
            self._act(_GCS_ACTIONS.get(int(params["FS_GCS_ENABLE"]), Mode.RTL), boot_us)

    def _clear_ground_station(self, text: str) -> None:
        if "gcs" in self._copter.in_failsafe:
            self._copter.in_failsafe.discard("gcs")
            self._copter.news.say(WARNING, text)

    # --- battery -----------------------------------------------------------------------------------------------

    def _watch_battery(self, word: str, name: str, estimate: Estimate, boot_us: int) -> None:
        """Below BATT_x_VOLT for BATT_LOW_TIMER, or below BATT_x_MAH at once; 0 does not look."""
        copter, params, battery = self._copter, self._params, estimate.battery
        is_empty = battery.remaining * params[_CAPACITY_MAH] < params[f"BATT_{name}_MAH"]
        if not (is_empty or battery.voltage_v < params[f"BATT_{name}_VOLT"]):
            self._low_since_us.pop(word, None)
            return
        since_us = self._low_since_us.setdefault(word, boot_us)
        is_over = is_empty or boot_us - since_us >= 1e6 * params["BATT_LOW_TIMER"]
        if not is_over or f"battery {word}" in copter.in_failsafe:
            return
        copter.in_failsafe.add(f"battery {word}")
        used_mah = (1.0 - battery.remaining) * params[_CAPACITY_MAH]
        copter.news.say(WARNING, f"Battery 1 is {word} {battery.voltage_v:.2f}V used {used_mah:.0f} mAh")
        action = _BATTERY_ACTIONS.get(int(params[f"BATT_FS_{name}_ACT"]))
        if action is not None and copter.armed:
            copter.news.say(WARNING, "Battery Failsafe")
            self._act(action, boot_us)

    # --- fence -------------------------------------------------------------------------------------------------

    def _watch_fence(self, estimate: Estimate, boot_us: int) -> None:
        """FENCE_ENABLE: the height (bit 0 of FENCE_TYPE) and the circle around home (bit 1)."""
        params = self._params
        if not params["FENCE_ENABLE"] or not self._copter.armed:
            self.is_outside = False
            return
        kinds, home = int(params["FENCE_TYPE"]), self._copter.home_ned_m
        n, e, d = estimate.position_ned_m
        names = []
        if kinds & _ALT_MAX and home[2] - d > params["FENCE_ALT_MAX"]:
            names.append("Max Alt")
        if kinds & _CIRCLE and math.hypot(n - home[0], e - home[1]) > params["FENCE_RADIUS"]:
            names.append("Circle")
        if names and not self.is_outside:
            self.breach(boot_us, " and ".join(names))
        self.is_outside = bool(names)

    def breach(self, boot_us: int, names: str = "Circle") -> None:
        """The fence is left: FENCE_ACTION."""
        self.breaches += 1
        self.is_outside = True
        self._copter.news.say(CRITICAL, f"{names} fence breached")
        action = _FENCE_ACTIONS.get(int(self._params["FENCE_ACTION"]))
        if action is not None and self._copter.armed:
            self._act(action, boot_us)

    def _act(self, mode: Mode, boot_us: int) -> None:
        """A vehicle on the ground is disarmed; a failsafe does not call back from a landing."""
        if self._copter.landed or not self._copter.armed:
            self._copter.stop_motors()
        elif self._copter.mode is not Mode.LAND:
            self._copter.select(mode, boot_us)
