"""AUTO.RTL: climb, fly home, land there; heights and texts as PX4 1.13.3 was seen to have them.

Far from home it climbs to RTL_RETURN_ALT above it. Within RTL_MIN_DIST a cone (RTL_CONE_ANG) makes that lower.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum, auto

from mavquad.protocol.codec import mavlink
from sitl_mock.geometry import Vec3
from sitl_mock.inner_loops import Setpoint
from sitl_mock.personality.px4.hold import pace_of
from sitl_mock.personality.px4.landing import Landing
from sitl_mock.personality.px4.route import Route
from sitl_mock.personality.px4.view import IDLE, View

_INFO: int = mavlink.MAV_SEVERITY_INFO


class _Phase(Enum):
    CLIMB = auto()
    RETURN = auto()
    WAIT = auto()
    LAND = auto()


class Homeward:
    """Returns to the launch. `altitude_m` is that of NED's origin, for the texts."""

    def __init__(self, say: Callable[[int, str], None], altitude_m: float) -> None:
        self._say = say
        self._altitude_m = altitude_m
        self._route = Route()
        self._landing = Landing()
        self._phase = _Phase.CLIMB
        self._wait_until_us = 0

    def enter(self, view: View) -> None:
        """Begin the return."""
        self._say(_INFO, "RTL HOME activated")
        estimate = view.estimate
        self._route.start(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        if view.landed:
            return
        self._say(_INFO, "RTL: landing at home position.")
        n, e, _ = self._route.target_ned_m
        self._phase = _Phase.CLIMB
        self._route.target_ned_m = (n, e, _return_down_m(view))
        self._tell("climb to", view)

    def setpoint(self, view: View) -> Setpoint:
        """The way home, then the landing."""
        if view.landed:
            return IDLE
        if self._phase is _Phase.LAND:
            return self._landing.setpoint(view)
        self._next_phase(view)
        return self._route.step(pace_of(view.settings), view.dt_s)

    def _next_phase(self, view: View) -> None:
        home, settings = view.home_ned_m, view.settings
        n, e, d = view.estimate.position_ned_m
        tn, te, td = self._route.target_ned_m
        is_there = math.hypot(n - tn, e - te) < settings.nav_acc_rad and abs(d - td) < settings.nav_mc_alt_rad
        if self._phase is _Phase.CLIMB and abs(d - td) < settings.nav_mc_alt_rad:
            self._phase = _Phase.RETURN
            self._route.target_ned_m = (home[0], home[1], td)
            self._route.face(view.estimate.position_ned_m, settings.nav_acc_rad)
            self._tell("return at", view)
        elif self._phase is _Phase.RETURN and is_there:
            self._phase = _Phase.WAIT
            down_m = max(td, home[2] - settings.rtl_descend_alt) if settings.rtl_land_delay else td
            self._route.target_ned_m = (home[0], home[1], down_m)
            self._wait_until_us = view.boot_us + round(settings.rtl_land_delay * 1e6)
        elif self._phase is _Phase.WAIT and is_there and 0 <= self._wait_until_us <= view.boot_us:
            self._begin_landing(home, view)

    def _begin_landing(self, home: Vec3, view: View) -> None:
        if view.settings.rtl_land_delay < 0:
            return  # it stays above home
        self._phase = _Phase.LAND
        self._landing.begin_at(home, view.estimate.euler_rad[2])
        self._say(_INFO, "RTL: land at destination")

    def _tell(self, what: str, view: View) -> None:
        down_m = self._route.target_ned_m[2]
        altitude_m, above_m = self._altitude_m - down_m, view.home_ned_m[2] - down_m
        self._say(_INFO, f"RTL: {what} {round(altitude_m)} m ({round(above_m)} m above destination)")


def _return_down_m(view: View) -> float:
    """z of the way home."""
    settings, (n, e, d), home = view.settings, view.estimate.position_ned_m, view.home_ned_m
    away_m = math.hypot(n - home[0], e - home[1])
    height_m = settings.rtl_return_alt
    if away_m <= settings.nav_acc_rad:
        height_m = 2 * away_m
    elif away_m <= settings.rtl_min_dist:
        half_angle = math.radians(max(1.0, min(89.0, settings.rtl_cone_ang)))
        height_m = min(height_m, max(2 * settings.nav_acc_rad, away_m / math.tan(half_angle)))
    return min(d, home[2] - height_m)
