"""Failsafes of PX4 1.13: each mode has its own conditions, and the mode selected is what changes.

Texts and times are PX4's (state_machine_helper.cpp), seen on 1.13.3 for the loss of setpoints, sticks and links.
"""

from __future__ import annotations

from collections.abc import Callable

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.failsafe import (
    CRITICAL_LEVEL,
    EMERGENCY_LEVEL,
    LOW,
    NO_WARNING,
    Decision,
    Situation,
)
from sitl_mock.personality.px4.modes import Mode

_INFO: int = mavlink.MAV_SEVERITY_INFO
_CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
_EMERGENCY: int = mavlink.MAV_SEVERITY_EMERGENCY
_EXCEPT_MISSION, _EXCEPT_HOLD, _EXCEPT_OFFBOARD = 1, 2, 4
_FORGET_US = 30_000_000
_NO_RC = "No manual control stick input"
_TERMINATE, _LOCK = 5, 6

_LINK_LOSS = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
_OFFBOARD_LOSS = {0: Mode.LAND, 1: Mode.LOITER, 2: Mode.RTL}
_OFFBOARD_LOSS_WITH_RC = {
    0: Mode.POSCTL,
    1: Mode.ALTCTL,
    2: Mode.MANUAL,
    3: Mode.RTL,
    4: Mode.LAND,
    5: Mode.LOITER,
}
_FENCE = {2: Mode.LOITER, 3: Mode.RTL, 5: Mode.LAND}
_STATE_NAMES = {Mode.RTL: "AUTO_RTL", Mode.LAND: "AUTO_LAND"}
_LINK_LOSS_COUNTS = frozenset({Mode.MISSION, Mode.LOITER, Mode.TAKEOFF, Mode.ORBIT})


class Failsafe113:
    """`say` sends a STATUSTEXT of some severity."""

    def __init__(self, say: Callable[[int, str], None]) -> None:
        self._say = say
        self._is_active = False
        self._since_us: int | None = None
        self._level = NO_WARNING
        self._battery_us: int | None = None
        self._was_breached = False

    def pilot_chose(self) -> None:
        """Nothing is kept: the next tick decides by the mode that he chose."""

    def step(self, now: Situation) -> Decision:
        """What is flown now."""
        if not now.armed and now.intended is not Mode.OFFBOARD:
            self._battery_us = None
            self._level = now.battery_level
            return self._decided(Decision(now.intended, now.intended))
        terminate = self._fence_terminates(now)
        intended = self._by_battery(now, self._by_fence(now))
        reason, action, delay_s = _loss(now, intended)
        if not reason:
            return self._decided(Decision(intended, intended, terminate=terminate))
        self._announce(reason, now)
        return self._decided(self._act(action, delay_s, intended, now, terminate))

    def _announce(self, reason: str, now: Situation) -> None:
        if self._is_active or not now.armed:
            return
        if self._since_us is None or now.boot_us - self._since_us > _FORGET_US:
            self._since_us = now.boot_us
        self._say(_CRITICAL, f"Failsafe enabled: {reason}")

    def _act(self, action: Mode | int, delay_s: float, intended: Mode, now: Situation, terminate: bool) -> Decision:
        if isinstance(action, Mode):
            return Decision(action, intended, True, terminate)
        if action == 0:  # disabled: what is flown is flown on
            return Decision(now.flown, intended, True, terminate)
        since_us = now.boot_us if self._since_us is None else self._since_us
        if now.boot_us - since_us < delay_s * 1e6:
            return Decision(Mode.LOITER, intended, True, terminate)
        if action in (_TERMINATE, _LOCK):
            return Decision(now.flown, intended, True, terminate=True)
        mode = _LINK_LOSS.get(action, Mode.LOITER)
        return Decision(mode, intended if mode is Mode.LOITER else mode, True, terminate)

    def _decided(self, decision: Decision) -> Decision:
        if decision.is_failsafe is not self._is_active:
            self._is_active = decision.is_failsafe
            self._say(_INFO, f"Failsafe mode {'activated' if self._is_active else 'deactivated'}")
        return decision

    # --- geofence and battery change the mode itself ---------------------------------------------------------------

    def _by_fence(self, now: Situation) -> Mode:
        was, self._was_breached = self._was_breached, now.is_fence_breached
        if now.is_fence_breached and not was and now.armed and self._battery_us is None:
            return _FENCE.get(now.settings.gf_action, now.intended)
        return now.intended

    def _fence_terminates(self, now: Situation) -> bool:
        if not (now.is_fence_breached and now.armed and now.settings.gf_action == 4):
            return False
        if not self._was_breached:
            self._say(_CRITICAL, "Geofence violation! Flight terminated")
        return True

    def _by_battery(self, now: Situation, intended: Mode) -> Mode:
        if now.battery_level > self._level and now.armed:
            self._level = now.battery_level
            self._battery_us = now.boot_us
            action = _battery_action(now)
            self._warn(now, action)
            if action is not None and now.settings.com_bat_act_t > 0:
                return Mode.LOITER
        if self._battery_us is None or now.boot_us - self._battery_us <= now.settings.com_bat_act_t * 1e6:
            return intended
        self._battery_us = None
        return _battery_action(now) or intended

    def _warn(self, now: Situation, action: Mode | None) -> None:
        if now.battery_level == LOW:
            self._say(_CRITICAL, "Low battery level, return advised")
            return
        is_critical = now.battery_level == CRITICAL_LEVEL
        what, severity = ("Critical", _CRITICAL) if is_critical else ("Dangerous", _EMERGENCY)
        if action is None:
            self._say(severity, f"{what} battery level, {'return' if is_critical else 'land'} now")
        else:
            after_s = int(now.settings.com_bat_act_t)
            self._say(severity, f"{what} battery level, executing {_STATE_NAMES[action]} in {after_s} seconds")


def _battery_action(now: Situation) -> Mode | None:
    if now.intended is Mode.LAND or now.battery_level < CRITICAL_LEVEL:
        return None
    action = now.settings.com_low_bat_act
    if action == 2 or (action == 3 and now.battery_level == EMERGENCY_LEVEL):
        return Mode.LAND
    return Mode.RTL if action in (1, 3) and now.intended is not Mode.RTL else None


def _loss(now: Situation, intended: Mode) -> tuple[str, Mode | int, float]:
    """(reason, or empty; the mode to fly, or a link loss action; seconds in which to hold before that action)."""
    settings, in_air = now.settings, now.armed and not now.landed
    if intended.needs_sticks:
        lost = now.armed and not now.has_sticks
        return (_NO_RC, settings.nav_rcl_act, settings.com_rcl_act_t) if lost else ("", 0, 0.0)
    if intended is Mode.OFFBOARD:
        return _offboard_loss(now)
    if intended not in _LINK_LOSS_COUNTS or not in_air:
        return "", 0, 0.0
    if not now.has_ground_station and settings.nav_dll_act > 0:
        return "no datalink", settings.nav_dll_act, 0.0
    excepted = {Mode.MISSION: _EXCEPT_MISSION, Mode.ORBIT: 0}.get(intended, _EXCEPT_HOLD)
    if now.has_sticks:
        return "", 0, 0.0
    if settings.com_rcl_except & excepted:
        is_left_alone = intended is Mode.MISSION and now.mission_is_over and not now.has_ground_station
        return ("no RC and no datalink", 2, 0.0) if is_left_alone else ("", 0, 0.0)
    if now.had_sticks and intended is not Mode.ORBIT:
        return _NO_RC, settings.nav_rcl_act, settings.com_rcl_act_t
    if not now.has_ground_station:
        return "no RC and no datalink", settings.nav_rcl_act, 0.0
    return "", 0, 0.0


def _offboard_loss(now: Situation) -> tuple[str, Mode | int, float]:
    settings = now.settings
    excepted = bool(settings.com_rcl_except & _EXCEPT_OFFBOARD)
    if not now.has_stream:
        if not now.has_sticks:
            return "no RC and no offboard", _offboard_action(settings.com_obl_act, _OFFBOARD_LOSS, 3), 0.0
        if excepted:
            return "no offboard", _offboard_action(settings.com_obl_act, _OFFBOARD_LOSS, 3), 0.0
        return "no offboard", _offboard_action(settings.com_obl_rc_act, _OFFBOARD_LOSS_WITH_RC, 6), 0.0
    if not now.has_sticks and not excepted and now.armed:
        return _NO_RC, settings.nav_rcl_act, settings.com_rcl_act_t
    return "", 0, 0.0


def _offboard_action(action: int, modes: dict[int, Mode], terminate: int) -> Mode | int:
    if action in (terminate, terminate + 1):
        return _TERMINATE
    return 0 if action < 0 else modes.get(action, Mode.LAND)
