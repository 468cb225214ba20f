"""AUTO.MISSION: flies the items of the mission one after the other.

TAKEOFF, WAYPOINT (hold, acceptance radius, yaw), LOITER_UNLIM, LOITER_TIME, LOITER_TO_ALT, LAND, RETURN_TO_LAUNCH,
DELAY, DO_JUMP, DO_CHANGE_SPEED and DO_SET_HOME act; everything else (cameras, gimbals, servos, conditions, ROI) is
passed over. A VTOL's takeoff and landing are a plain takeoff and landing.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import mavlink
from sitl_mock.geodesy import Origin
from sitl_mock.geometry import Vec3, wrap_pi
from sitl_mock.inner_loops import Setpoint
from sitl_mock.personality.mission import MissionItem
from sitl_mock.personality.px4 import mission_plan as plan
from sitl_mock.personality.px4.hold import pace_of
from sitl_mock.personality.px4.landing import Landing
from sitl_mock.personality.px4.mission_plan import MissionPlan
from sitl_mock.personality.px4.route import Route
from sitl_mock.personality.px4.takeoff import Takeoff
from sitl_mock.personality.px4.view import IDLE, View

_INFO: int = mavlink.MAV_SEVERITY_INFO
_CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
_TAKEOFFS = (plan.TAKEOFF, plan.VTOL_TAKEOFF)
_LANDINGS = (plan.LAND, plan.VTOL_LAND)
_YAW_ERROR_RAD = math.radians(12.0)
_MOST_JUMPS = 10


class MissionFlight:
    """Flies `mission`; `origin` is where NED is zero.

    Attributes:
        is_over: the last item is done; it stays where it is.
        asks_return: an item says to return to the launch.
        home_ned_m: set by DO_SET_HOME, until it is taken.
        reached: items that are done and not yet told.
    """

    def __init__(
        self, mission: MissionPlan, origin: Origin, hover_thrust_norm: float, say: Callable[[int, str], None]
    ) -> None:
        self._mission = mission
        self._origin = origin
        self._say = say
        self._route = Route()
        self._takeoff = Takeoff(hover_thrust_norm)
        self._landing = Landing()
        self._changes = -1
        self._held_since_us: int | None = None
        self._is_landing = False
        self._lifts_off = False
        self._jumps: dict[int, int] = {}
        self.cruise_m_s: float | None = None
        self.is_over = False
        self.asks_return = False
        self.home_ned_m: Vec3 | None = None
        self.reached: list[int] = []

    def enter(self, view: View) -> None:
        """Begin, or go on, with the current item."""
        self._hold_here(view)
        self.asks_return = False
        if not self._mission.is_valid:
            text = "refusing takeoff" if view.landed else "loitering"
            self._say(_CRITICAL, f"No valid mission available, {text}")
            self.is_over = True
            return
        self._say(_INFO, "Executing Mission")
        self._start(view)

    def setpoint(self, view: View) -> Setpoint:
        """The way that the current item goes."""
        if self._changes != self._mission.changes:
            self._hold_here(view)
            self._start(view)
        if self.is_over or not self._mission.is_valid:
            return IDLE if view.landed else self._route.step(pace_of(view.settings, self.cruise_m_s), view.dt_s)
        item = self._mission.items[self._mission.current]
        if self._lifts_off:
            setpoint: Setpoint = self._takeoff.setpoint(view)
            self._finish_if(self._takeoff.done, item, view)
            return setpoint
        if self._is_landing:
            self._finish_if(view.landed, item, view)
            return self._landing.setpoint(view)
        if view.landed:
            return IDLE
        self._finish_if(self._is_reached(item, view), item, view)
        return self._route.step(pace_of(view.settings, self.cruise_m_s), view.dt_s)

    # --- items -----------------------------------------------------------------------------------------------------

    def _start(self, view: View) -> None:
        """Set up the current item, passing over all that is done at once."""
        self._changes = self._mission.changes
        self.is_over = not self._mission.is_valid
        self._jumps.clear()
        self._set_up(view)

    def _set_up(self, view: View) -> None:
        self._held_since_us, self._is_landing, self._lifts_off = None, False, False
        items = self._mission.items
        for _ in range(len(items) * (_MOST_JUMPS + 1)):
            index = self._mission.current
            if self.is_over or index >= len(items):
                break
            item = items[index]
            if item.command in plan.PLACES or item.command == plan.DELAY:
                self._head_for(item, view)
                return
            if item.command == plan.RETURN:
                self.asks_return = True
                return
            self._do(item, view)
            if item.command != plan.JUMP:
                self._advance(index, view)

    def _do(self, item: MissionItem, view: View) -> None:
        if item.command == plan.CHANGE_SPEED:
            self.cruise_m_s = item.params[1] if item.params[1] > 0 else None
        elif item.command == plan.SET_HOME:
            use_current = item.params[0] > 0.5
            self.home_ned_m = view.estimate.position_ned_m if use_current else self._place(item, view)
        elif item.command == plan.JUMP:
            self._jump(item, view)

    def _jump(self, item: MissionItem, view: View) -> None:
        index = self._mission.current
        done = self._jumps.get(index, 0)
        times = item.params[1]
        if done < times or times < 0:
            self._jumps[index] = done + 1
            self._mission.current = int(item.params[0])
            return
        self._say(_INFO, "DO JUMP repetitions completed.")
        self._jumps[index] = 0
        self._advance(index, view)

    def _head_for(self, item: MissionItem, view: View) -> None:
        if item.command == plan.DELAY:
            return
        estimate = view.estimate
        to = self._place(item, view)
        if item.command in _TAKEOFFS or view.landed:
            self._lift_off(item, to, view)
            return
        n, e, d = estimate.position_ned_m
        self._route.target_ned_m = (to[0], to[1], self._route.target_ned_m[2] if item.command in _LANDINGS else to[2])
        if math.isfinite(item.params[3]) and item.command == plan.WAYPOINT:
            self._route.target_yaw_rad = wrap_pi(math.radians(item.params[3]))
        else:
            self._route.face((n, e, d), view.settings.nav_acc_rad)

    def _lift_off(self, item: MissionItem, to: Vec3, view: View) -> None:
        n, e, _ = view.estimate.position_ned_m
        is_takeoff = item.command in _TAKEOFFS
        height_m = view.home_ned_m[2] - to[2]
        if not is_takeoff:  # a waypoint on the ground: PX4 takes off first
            height_m = max(height_m, view.settings.mis_takeoff_alt)
        if view.landed:
            self._say(_INFO, f"Takeoff to {height_m:.1f} meters above home")
        self._takeoff.aim((n, e, view.home_ned_m[2] - height_m), math.nan)
        self._takeoff.enter(view)
        self._lifts_off = True

    def _is_reached(self, item: MissionItem, view: View) -> bool:
        """Whether the place is there, the heading too, and the item's time is over."""
        if item.command == plan.DELAY:
            return self._has_held(item.params[0], view)
        n, e, d = view.estimate.position_ned_m
        tn, te, td = self._route.target_ned_m
        settings = view.settings
        radius = item.params[1] if item.command == plan.WAYPOINT and item.params[1] > 0.05 else settings.nav_acc_rad
        if math.hypot(n - tn, e - te) > radius or abs(d - td) > settings.nav_mc_alt_rad:
            return False
        if item.command in _LANDINGS:
            self._is_landing = True
            self._landing.begin_at((tn, te, td), view.estimate.euler_rad[2])
            return False
        turn = wrap_pi(self._route.target_yaw_rad - view.estimate.euler_rad[2])
        wants_yaw = item.command == plan.WAYPOINT and math.isfinite(item.params[3])
        if wants_yaw and abs(turn) > _YAW_ERROR_RAD and self._held_since_us is None:
            return False
        if item.command == plan.LOITER_UNLIMITED:
            return False
        timed = item.command in (plan.WAYPOINT, plan.LOITER_TIME)
        return self._has_held(item.params[0] if timed else 0.0, view)

    def _has_held(self, seconds: float, view: View) -> bool:
        if self._held_since_us is None:
            self._held_since_us = view.boot_us
        return not view.boot_us - self._held_since_us < seconds * 1e6

    def _finish_if(self, is_done: bool, item: MissionItem, view: View) -> None:
        if not is_done:
            return
        was_lifting, index = self._lifts_off, self._mission.current
        if was_lifting:
            self._resume_route(view)
        if was_lifting and item.command not in _TAKEOFFS:
            self._lifts_off = False
            self._head_for(item, view)
            return
        self._advance(index, view)
        self._set_up(view)

    def _advance(self, index: int, view: View) -> None:
        self.reached.append(index)
        if index + 1 < len(self._mission.items):
            self._mission.current = index + 1
            return
        self.is_over = True
        self._say(_INFO, f"Mission finished, {'landed' if view.landed else 'loitering'}")

    # --- places ----------------------------------------------------------------------------------------------------

    def _hold_here(self, view: View) -> None:
        estimate = view.estimate
        self._route.hold(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])

    def _resume_route(self, view: View) -> None:
        estimate, to = view.estimate, self._takeoff.target_ned_m
        self._route.start(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        self._route.target_ned_m = to

    def _place(self, item: MissionItem, view: View) -> Vec3:
        """The item's place; 0, 0 in a landing or takeoff is where it is, as PX4 takes it."""
        n, e, d = self._origin.local(item.x * 1e-7, item.y * 1e-7, item.z)
        if item.frame in plan.RELATIVE_FRAMES:
            d = view.home_ned_m[2] - item.z
        if item.x == 0 and item.y == 0:
            n, e, _ = view.estimate.position_ned_m
        return (n, e, d)
