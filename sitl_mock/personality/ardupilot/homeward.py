"""RTL and LAND: climb to RTL_ALT, go home, wait RTL_LOIT_TIME, come down."""

from __future__ import annotations

import math
from typing import Literal

from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.personality.ardupilot.demand import Demand
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

Stage = Literal["none", "climb", "home", "wait", "land"]

_REACHED_M = 0.3
_CM = 0.01


class Homeward:
    """Brings the vehicle home and down.

    Attributes:
        stage: how far a return has come; "none" while there is none.
    """

    def __init__(self, navigator: Navigator, params: Parameters) -> None:
        self._navigator = navigator
        self._params = params
        self.stage: Stage = "none"
        self._stage_us = 0
        self._start_ned_m: Vec3 = ZERO3

    def begin(self, stage: Stage, start_ned_m: Vec3, boot_us: int) -> None:
        """Begin with a stage; a climb goes straight up from `start_ned_m`."""
        self.stage, self._stage_us, self._start_ned_m = stage, boot_us, start_ned_m

    def demand(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        """What the stage asks for now."""
        if self.stage == "land":
            return self.land(estimate, home_ned_m, dt_s)
        navigator, (n, e, d) = self._navigator, estimate.position_ned_m
        height_m = min(self._start_ned_m[2], home_ned_m[2] - _CM * self._params["RTL_ALT"])
        if self.stage == "climb":
            navigator.fly_to((*self._start_ned_m[:2], height_m), dt_s)
            self._go_on(d - height_m < _REACHED_M, "home", boot_us)
            return Demand(*navigator.control(estimate, dt_s))
        navigator.fly_to((*home_ned_m[:2], height_m), dt_s)
        if self.stage == "home":
            navigator.look_ahead(dt_s)
            self._go_on(math.hypot(n - home_ned_m[0], e - home_ned_m[1]) < _REACHED_M, "wait", boot_us)
        else:
            navigator.keep_heading()
            self._go_on(boot_us - self._stage_us >= 1e3 * self._params["RTL_LOIT_TIME"], "land", boot_us)
        return Demand(*navigator.control(estimate, dt_s))

    def _go_on(self, is_over: bool, stage: Stage, boot_us: int) -> None:
        if is_over:
            self.stage, self._stage_us = stage, boot_us

    def land(self, estimate: Estimate, home_ned_m: Vec3, dt_s: float) -> Demand:
        """WPNAV_SPEED_DN (or LAND_SPEED_HIGH) down to LAND_ALT_LOW above home, then LAND_SPEED."""
        params, height_m = self._params, home_ned_m[2] - estimate.position_ned_m[2]
        fast = params["LAND_SPEED_HIGH"] or params["WPNAV_SPEED_DN"]
        is_high = height_m > _CM * params["LAND_ALT_LOW"]
        self._navigator.keep_heading()
        self._navigator.descend(_CM * (fast if is_high else params["LAND_SPEED"]), dt_s)
        return Demand(*self._navigator.control(estimate, dt_s))
