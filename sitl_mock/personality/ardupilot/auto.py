"""AUTO: the items of the mission, one after the other."""

from __future__ import annotations

import math

from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.personality.ardupilot.demand import Demand
from sitl_mock.personality.ardupilot.homeward import Homeward
from sitl_mock.personality.ardupilot.leg import Route
from sitl_mock.personality.ardupilot.missions import (
    CHANGE_SPEED,
    LAND,
    LOITER_UNLIMITED,
    RTL,
    SPLINE,
    TAKEOFF,
    WAYPOINT,
    Mission,
    place_of,
)
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.mission import MissionItem
from sitl_mock.sensors import Estimate

_REACHED_M = 0.3
_FLOWN_THROUGH = (WAYPOINT, SPLINE)
_CM = 0.01


class Auto:
    """Flies the mission; after its last item the vehicle stays."""

    def __init__(self, navigator: Navigator, params: Parameters, mission: Mission, homeward: Homeward) -> None:
        self._navigator = navigator
        self._params = params
        self._mission = mission
        self._homeward = homeward
        self._goal_ned_m: Vec3 = ZERO3
        self._route: Route | None = None
        self._there_us = 0

    @property
    def is_taking_off(self) -> bool:
        """Whether the item in force is a takeoff."""
        item = self._mission.item
        return item is not None and item.command == TAKEOFF

    def begin(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int) -> None:
        """Take up the mission at its current item, or at its first."""
        self._goal_ned_m, self._route = estimate.position_ned_m, None
        self._mission.begin()
        self._next_item(estimate, home_ned_m, boot_us)

    def demand(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        """What the item asks for now."""
        if self._mission.has_jumped:
            self._route = None
            self._mission.begin()
            self._next_item(estimate, home_ned_m, boot_us)
        if self._homeward.stage != "none":
            return self._homeward.demand(estimate, home_ned_m, boot_us, dt_s)
        navigator, item, route = self._navigator, self._mission.item, self._route
        if route is None:
            navigator.fly_to(self._goal_ned_m, dt_s)
        else:
            route.is_paused = self._mission.is_paused
            navigator.fly_leg(route, dt_s)
        navigator.look_ahead(dt_s)
        if item is None or not self._is_there(item, estimate):
            self._there_us = boot_us
        elif item.command == LAND:
            self._homeward.begin("land", self._goal_ned_m, boot_us)
        elif item.command != LOITER_UNLIMITED and boot_us - self._there_us >= 1e6 * max(0.0, item.params[0]):
            self._mission.reach(is_told=item.command != TAKEOFF)
            self._next_item(estimate, home_ned_m, boot_us)
        return Demand(*navigator.control(estimate, dt_s))

    def _is_there(self, item: MissionItem, estimate: Estimate) -> bool:
        """At the leg's end and near its place; one flown through is left when so much of the way is left."""
        n, e, d = (there - here for there, here in zip(self._goal_ned_m, estimate.position_ned_m, strict=True))
        if item.command == TAKEOFF or self._route is None:
            return d > -_REACHED_M
        radius_m = _CM * self._params["WPNAV_RADIUS"]
        if item.command in _FLOWN_THROUGH and not item.params[0] and self._mission.goes_on:
            return self._route.remaining_m < radius_m
        return self._route.is_over and math.hypot(n, e, d) < radius_m

    def _next_item(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int) -> None:
        item = self._mission.go_on()
        while item is not None and item.command == CHANGE_SPEED:
            if item.params[1] > 0:
                self._navigator.speed_m_s = item.params[1]
            self._mission.reach(is_told=False)
            item = self._mission.go_on()
        self._there_us = boot_us
        self._homeward.begin("none", self._goal_ned_m, boot_us)
        if item is not None and item.command == RTL:
            self._homeward.begin("climb", estimate.position_ned_m, boot_us)
        elif item is not None:
            before, start = self._route, self._goal_ned_m if self._route is not None else self._navigator.target_ned_m
            self._goal_ned_m = self._goal_of(item, estimate.position_ned_m, home_ned_m)
            leg = self._navigator.leg_to(start, self._goal_ned_m)
            self._route = None if item.command == TAKEOFF else Route(leg, before)

    def _goal_of(self, item: MissionItem, here_ned_m: Vec3, home_ned_m: Vec3) -> Vec3:
        """A takeoff goes straight up, a landing flies level to its place first; one without a place stays above its last."""
        n, e, d = place_of(item, (*self._goal_ned_m[:2], here_ned_m[2]), home_ned_m)
        if item.command == TAKEOFF:
            return (*here_ned_m[:2], d)
        return (n, e, here_ned_m[2] if item.command == LAND else d)
