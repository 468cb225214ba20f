"""The plans that PX4 holds: which items it takes, and whether it will fly the mission that they make.

An item of a command or frame that PX4 does not know is refused while it is uploaded. A whole mission that cannot be
flown is taken, and then refused by STATUSTEXT ("Mission rejected: ...") and by MISSION_START.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.mission import ACCEPTED, FENCE, MISSION, RALLY, MissionItem

_CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
_UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED
_BAD_FRAME: int = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
_MISSION_FRAME: int = mavlink.MAV_FRAME_MISSION
_GLOBAL_FRAMES = frozenset((0, 3, 5, 6))
RELATIVE_FRAMES = frozenset((3, 6))
_ROOM = {MISSION: 500, FENCE: 64, RALLY: 32}

WAYPOINT, LOITER_UNLIMITED, LOITER_TIME = 16, 17, 19
RETURN, LAND, TAKEOFF, LOITER_TO_ALTITUDE = 20, 21, 22, 31
VTOL_TAKEOFF, VTOL_LAND, DELAY, JUMP = 84, 85, 93, 177
CHANGE_SPEED, SET_HOME = 178, 179

PLACES = frozenset(
    (WAYPOINT, LOITER_UNLIMITED, LOITER_TIME, LAND, TAKEOFF, LOITER_TO_ALTITUDE, VTOL_TAKEOFF, VTOL_LAND)
)
"""Commands of items that are flown to."""
_OTHER_GLOBAL = frozenset((80, 195, 201, 4501))
_FENCE_ITEMS = frozenset((5000, 5001, 5002, 5003, 5004))
_RALLY_ITEM = 5100
# fmt: off
_MISSION_COMMANDS = frozenset((
    RETURN, DELAY, JUMP, CHANGE_SPEED, SET_HOME, 112, 114, 181, 183, 189, 196, 197, 200, 201, 80, 203, 204, 205, 206,
    214, 530, 531, 532, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 260,
))
# fmt: on
"""Commands of items without a place. What is no flying (cameras, gimbals, servos, conditions) is passed over."""


class MissionPlan:
    """Attributes: `is_valid`, whether there is a mission that can be flown; `current`, the item that is next."""

    def __init__(self, say: Callable[[int, str], None]) -> None:
        self._say = say
        self._plans: dict[int, tuple[MissionItem, ...]] = {MISSION: (), FENCE: (), RALLY: ()}
        self.is_valid = False
        self.current = 0
        self.changes = 0

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """The mission."""
        return self._plans[MISSION]

    def most_items(self, mission_type: int) -> int:
        """How many items there is room for."""
        return _ROOM.get(mission_type, 0)

    def refusal(self, mission_type: int, item: MissionItem) -> int:
        """MAV_MISSION_RESULT of an item that comes in."""
        if item.frame == _MISSION_FRAME:
            return ACCEPTED if mission_type == MISSION and item.command in _MISSION_COMMANDS else _UNSUPPORTED
        if item.frame not in _GLOBAL_FRAMES:
            return _BAD_FRAME
        kinds = {MISSION: PLACES | _OTHER_GLOBAL, FENCE: _FENCE_ITEMS, RALLY: {_RALLY_ITEM}}[mission_type]
        if item.command not in kinds or not math.isfinite(item.z):
            return _UNSUPPORTED
        return ACCEPTED

    def plan(self, mission_type: int) -> tuple[MissionItem, ...]:
        """The plan in force."""
        return self._plans.get(mission_type, ())

    def replace(self, mission_type: int, items: tuple[MissionItem, ...]) -> None:
        """A new plan; a mission starts at its first item."""
        self._plans[mission_type] = items
        if mission_type != MISSION:
            return
        self.current = 0
        self.changes += 1
        reason = _infeasible(items)
        self.is_valid = bool(items) and not reason
        if reason:
            self._say(_CRITICAL, f"Mission rejected: {reason}")

    def set_current(self, index: int) -> bool:
        """Go on with this item."""
        if index >= len(self.items):
            return False
        self.current = index
        self.changes += 1
        return True

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT."""
        self._say(severity, text)


def _infeasible(items: tuple[MissionItem, ...]) -> str:
    """Why PX4 would not fly it; empty if it would."""
    for number, item in enumerate(items, 1):
        if item.command in (LAND, VTOL_LAND) and number == 1:
            return "starts with landing"
        if item.command in (TAKEOFF, VTOL_TAKEOFF) and item.frame in RELATIVE_FRAMES and item.z < 0.5:
            return "Takeoff altitude too low!"
        if item.command == JUMP and not 0 <= item.params[0] < len(items):
            return f"item {number}: jump to nowhere"
    places = [item.command for item in items if item.command in PLACES]
    if any(command in (TAKEOFF, VTOL_TAKEOFF) for command in places[1:]):
        return "takeoff not first waypoint item"
    return ""
