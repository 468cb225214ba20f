"""Failsafes of PX4 1.14 and later: everything that is wrong asks for an action, and the most severe one is taken.

After the commander's failsafe framework (failsafe.cpp, framework.cpp). Actions that a pilot may want to prevent hold
for COM_FAIL_ACT_T first; the loss of OFFBOARD setpoints acts at once. An action that has begun goes on until the pilot
selects a mode or the vehicle is disarmed, but for the loss of setpoints, which ends with it.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

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

_WARNING: int = mavlink.MAV_SEVERITY_WARNING
_CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
_EMERGENCY: int = mavlink.MAV_SEVERITY_EMERGENCY
_EXCEPT_MISSION, _EXCEPT_AUTO, _EXCEPT_OFFBOARD = 1, 2, 4
_STREAM = "stream"


class Action(IntEnum):
    """From the mildest to the most severe."""

    NONE = 0
    POSCTL = 1
    ALTCTL = 2
    STABILIZED = 3
    HOLD = 4
    RTL = 5
    LAND = 6
    DISARM = 7
    TERMINATE = 8


_MODES = {
    Action.POSCTL: Mode.POSCTL,
    Action.ALTCTL: Mode.ALTCTL,
    Action.STABILIZED: Mode.STABILIZED,
    Action.HOLD: Mode.LOITER,
    Action.RTL: Mode.RTL,
    Action.LAND: Mode.LAND,
}
_LINK_LOSS = {1: Action.HOLD, 2: Action.RTL, 3: Action.LAND, 5: Action.TERMINATE, 6: Action.DISARM}
_FENCE = {2: Action.HOLD, 3: Action.RTL, 4: Action.TERMINATE, 5: Action.LAND}
_STREAM_LOSS = {
    0: Action.POSCTL,
    1: Action.ALTCTL,
    2: Action.STABILIZED,
    3: Action.RTL,
    4: Action.LAND,
    5: Action.HOLD,
    6: Action.TERMINATE,
    7: Action.DISARM,
}
_BATTERY_TEXTS = {
    LOW: (_WARNING, "Low battery"),
    CRITICAL_LEVEL: (_CRITICAL, "Critical battery"),
    EMERGENCY_LEVEL: (_EMERGENCY, "Emergency battery level"),
}


class Failsafe114:
    """`say` sends a STATUSTEXT of some severity. `needs_sticks`: 1.17 flies on by sticks only where there are any, else it
    does what NAV_RCL_ACT says (seen: AUTO.RTL after the last setpoint, where 1.15 and 1.16 go to POSCTL and sink)."""

    def __init__(self, say: Callable[[int, str], None], needs_sticks: bool = False) -> None:
        self._say = say
        self._needs_sticks = needs_sticks
        self._actions: dict[str, Action] = {}
        self._overridden: set[str] = set()
        self._acting = Action.NONE
        self._hold_until_us: int | None = None
        self._was_armed = False
        self._had_sticks_at_arming = False
        self._level_at_arming = NO_WARNING
        self._level = NO_WARNING
        self._terminated = False

    def pilot_chose(self) -> None:
        """He takes over from what is acting; what is wrong may not act again before it has been right."""
        if self._acting != Action.NONE:
            self._overridden |= self._actions.keys()
        self._actions.clear()
        self._hold_until_us = None

    def step(self, now: Situation) -> Decision:
        """What is flown now."""
        self._watch_arming(now)
        self._tell_battery(now.battery_level)
        if not now.armed:
            return Decision(now.intended, now.intended)
        self._collect(now)
        action = self._worst(now)
        may_wait = action in (Action.RTL, Action.LAND)
        if may_wait and self._hold_until_us is not None and now.boot_us < self._hold_until_us:
            action = Action.HOLD
        self._announce(action, now)
        self._terminated = self._terminated or action is Action.TERMINATE
        mode = now.intended if action is Action.NONE else _MODES.get(action, now.flown)
        return Decision(mode, now.intended, action is not Action.NONE, self._terminated, disarm=action is Action.DISARM)

    def _watch_arming(self, now: Situation) -> None:
        if now.armed and not self._was_armed:
            self._had_sticks_at_arming, self._level_at_arming = now.has_sticks, now.battery_level
        elif now.armed and now.has_sticks:
            self._had_sticks_at_arming = True
        elif not now.armed:
            self._actions.clear()
            self._overridden.clear()
            self._acting, self._hold_until_us, self._terminated = Action.NONE, None, False
        self._was_armed = now.armed

    def _tell_battery(self, level: int) -> None:
        if level > self._level:
            self._say(*_BATTERY_TEXTS[level])
        self._level = level

    def _collect(self, now: Situation) -> None:
        """Add what has gone wrong; forget the loss of setpoints and what the pilot put up with, once it is right."""
        wrong = _wrong(now, self._had_sticks_at_arming, self._level_at_arming, self._needs_sticks)
        if not wrong and not self._actions and not self._overridden:
            return
        self._overridden &= wrong.keys()
        if _STREAM not in wrong:
            self._actions.pop(_STREAM, None)
        for cause, action in wrong.items():
            if cause in self._overridden:
                continue
            if cause not in self._actions and cause != _STREAM and self._hold_until_us is None:
                self._hold_until_us = now.boot_us + round(now.settings.com_fail_act_t * 1e6)
            self._actions[cause] = action

    def _worst(self, now: Situation) -> Action:
        worst = max(self._actions.values(), default=Action.NONE)
        if worst is Action.NONE:
            self._hold_until_us = None
        elif (now.intended is Mode.LAND and worst in (Action.HOLD, Action.RTL, Action.LAND)) or (
            now.intended is Mode.RTL and worst in (Action.HOLD, Action.RTL)
        ):
            return Action.NONE  # it is going down, or home, already
        if self._actions.get(_STREAM) is worst:
            self._hold_until_us = None
        return worst

    def _announce(self, action: Action, now: Situation) -> None:
        if action is self._acting:
            return
        self._acting = action
        if action is Action.NONE:
            return
        waits = action is Action.HOLD and max(self._actions.values()) > Action.HOLD
        delay = f": entering Hold for {int(now.settings.com_fail_act_t)} seconds" if waits else ""
        self._say(_CRITICAL, f"Failsafe activated{delay}")


def _wrong(now: Situation, had_sticks: bool, level_at_arming: int, needs_sticks: bool) -> dict[str, Action]:
    """What is wrong now, and the action that the parameters ask for."""
    settings, intended = now.settings, now.intended
    wrong: dict[str, Action] = {}
    if not now.has_stream and intended is Mode.OFFBOARD:
        action = _STREAM_LOSS.get(settings.com_obl_rc_act, Action.POSCTL)
        by_sticks = action in (Action.POSCTL, Action.ALTCTL, Action.STABILIZED)
        lacks_sticks = needs_sticks and by_sticks and not now.has_sticks
        wrong[_STREAM] = _LINK_LOSS.get(settings.nav_rcl_act, Action.NONE) if lacks_sticks else action
    if had_sticks and not now.has_sticks and not _is_excepted(intended, settings.com_rcl_except):
        wrong["sticks"] = _LINK_LOSS.get(settings.nav_rcl_act, Action.NONE)
    if not now.has_ground_station and settings.nav_dll_act > 0 and intended not in (Mode.LAND, Mode.PRECLAND):
        wrong["ground station"] = _LINK_LOSS.get(settings.nav_dll_act, Action.NONE)
    if now.is_fence_breached:
        wrong["fence"] = _FENCE.get(settings.gf_action, Action.NONE)
    if now.battery_level > max(LOW, level_at_arming):
        wrong["battery"] = _battery_action(settings.com_low_bat_act, now.battery_level)
    return {cause: action for cause, action in wrong.items() if action is not Action.NONE} if wrong else wrong


def _battery_action(action: int, level: int) -> Action:
    if action == 2 or (action == 3 and level == EMERGENCY_LEVEL):
        return Action.LAND
    return Action.RTL if action in (1, 3) else Action.NONE


def _is_excepted(mode: Mode, exceptions: int) -> bool:
    if mode.needs_sticks:
        return False
    bit = {Mode.MISSION: _EXCEPT_MISSION, Mode.OFFBOARD: _EXCEPT_OFFBOARD}.get(mode, _EXCEPT_AUTO)
    return bool(exceptions & bit)
