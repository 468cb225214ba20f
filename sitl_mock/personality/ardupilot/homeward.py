"""RTL and LAND: climb to RTL_ALT, go home, wait RTL_LOIT_TIME, come down."""

from __future__ import annotations

import math
from typing import Literal

from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.personality.ardupilot.demand import Demand
from sitl_mock.personality.ardupilot.leg import Leg, Route
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

Stage = Literal["none", "climb", "home", "wait", "land"]

_LEAST_HEIGHT_M, _LEAST_SLOPE = 2.0, 0.5
_AHEAD_ALWAYS = 1
"""WP_YAW_BEHAVIOR; with 2, the default, the nose stays in a return."""
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
        self._route: Route | None = None

    def begin(self, stage: Stage, start_ned_m: Vec3, boot_us: int) -> None:
        """Begin with a stage; a climb goes straight up from `start_ned_m`."""
        self.stage, self._stage_us, self._start_ned_m = stage, boot_us, start_ned_m
        self._route = None

    def demand(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        """What the stage asks for now."""
        if self.stage == "land":
            return self.land(estimate, home_ned_m, dt_s)
        navigator = self._navigator
        if self._route is None:
            self._route = Route(self._leg(home_ned_m))
        navigator.fly_leg(self._route, dt_s)
        if self.stage == "home" and self._params["WP_YAW_BEHAVIOR"] == _AHEAD_ALWAYS:
            navigator.look_ahead(dt_s)
        else:
            navigator.keep_heading()
        demand = Demand(*navigator.control(estimate, dt_s))
        if self.stage == "climb":
            self._go_on(self._route.is_over, "home", boot_us)
        elif self.stage == "home":
            n, e, _ = estimate.position_ned_m
            is_near = math.hypot(n - home_ned_m[0], e - home_ned_m[1]) < _CM * self._params["WPNAV_RADIUS"]
            self._go_on(self._route.is_over and is_near, "wait", boot_us)
        else:
            self._go_on(boot_us - self._stage_us >= 1e3 * self._params["RTL_LOIT_TIME"], "land", boot_us)
        return demand

    def _leg(self, home_ned_m: Vec3) -> Leg:
        """Straight up, or home at the height that was climbed to."""
        if self.stage == "climb":
            goal = (*self._start_ned_m[:2], self._return_down_m(home_ned_m))
        else:
            goal = (*home_ned_m[:2], self._navigator.target_ned_m[2])
        return self._navigator.leg_to(self._navigator.target_ned_m, goal)

    def _return_down_m(self, home_ned_m: Vec3) -> float:
        """RTL_ALT, near home no more than RTL_CONE_SLOPE times the distance; never less than 2 m nor than now.

        The order is that of ArduCopter's source.
        """
        n, e, d = self._start_ned_m
        least = max(_LEAST_HEIGHT_M, home_ned_m[2] - d + _CM * max(0.0, self._params["RTL_CLIMB_MIN"]))
        height, slope = max(_CM * self._params["RTL_ALT"], least), self._params["RTL_CONE_SLOPE"]
        if slope >= _LEAST_SLOPE:
            height = min(height, max(slope * math.hypot(n - home_ned_m[0], e - home_ned_m[1]), least))
        return home_ned_m[2] - height

    def _go_on(self, is_over: bool, stage: Stage, boot_us: int) -> None:
        if is_over:
            self.stage, self._stage_us = stage, boot_us
            self._route = None if stage == "home" else self._route

    def land(self, estimate: Estimate, home_ned_m: Vec3, dt_s: float) -> Demand:
        """WPNAV_SPEED_DN (or LAND_SPEED_HIGH) down to LAND_ALT_LOW above home, then LAND_SPEED."""
        params, height_m = self._params, home_ned_m[2] - estimate.position_ned_m[2]
        fast = params["LAND_SPEED_HIGH"] or params["WPNAV_SPEED_DN"]
        is_high = height_m > _CM * params["LAND_ALT_LOW"]
        self._navigator.keep_heading()
        self._navigator.descend(_CM * (fast if is_high else params["LAND_SPEED"]), dt_s)
        return Demand(*self._navigator.control(estimate, dt_s))
