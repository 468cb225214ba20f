"""ArduCopter's mission: the plan as it is stored, with home as its item 0, and how far it has been flown.

What AUTO can fly: takeoff, waypoints (a spline's are flown straight), loiters (without turns: it stands there), return,
land, and the change of speed. Items of other commands are refused when they come in. Texts and names follow
ArduPilot's source.
"""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from sitl_mock.geometry import Vec3
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, geodetic, north_east
from sitl_mock.personality.mission import ACCEPTED, MISSION, MissionItem

TAKEOFF: int = mavlink.MAV_CMD_NAV_TAKEOFF
LAND: int = mavlink.MAV_CMD_NAV_LAND
RTL: int = mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
LOITER_UNLIMITED: int = mavlink.MAV_CMD_NAV_LOITER_UNLIM
LOITER_TIME: int = mavlink.MAV_CMD_NAV_LOITER_TIME
CHANGE_SPEED: int = mavlink.MAV_CMD_DO_CHANGE_SPEED
WAYPOINT: int = mavlink.MAV_CMD_NAV_WAYPOINT
SPLINE: int = mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT
_NAMES: dict[int, str] = {
    TAKEOFF: "Takeoff",
    LAND: "Land",
    RTL: "RTL",
    LOITER_UNLIMITED: "LoitUnlim",
    LOITER_TIME: "LoitTime",
    CHANGE_SPEED: "ChangeSpeed",
    WAYPOINT: "WP",
    SPLINE: "SplineWP",
    mavlink.MAV_CMD_NAV_LOITER_TURNS: "LoitTurns",
}
_STATES: dict[str, int] = {
    "waits": mavlink.MISSION_STATE_NOT_STARTED,
    "flies": mavlink.MISSION_STATE_ACTIVE,
    "over": mavlink.MISSION_STATE_COMPLETE,
}
_MOST_ITEMS = 724
_ABOVE_HOME = (3, 6, 10, 11)
_INFO: int = mavlink.MAV_SEVERITY_INFO
_UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED


class Mission:
    """The stored plan and the item in force.

    Attributes:
        items: those of the mission but for home, which has number 0; the first here has number 1.
        current: number of the item in force; 0 before the first.
        texts: (severity, STATUSTEXT) to be sent.
        reached: numbers for MISSION_ITEM_REACHED.
        home_ned_m: what item 0 shows.
        has_jumped: the item in force was set from outside, and is to be begun.
        is_paused: the vehicle is to stand on its way.
    """

    def __init__(self) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self.current = 0
        self.has_jumped = False
        self.is_paused = False
        self._stage = "waits"
        self.texts: list[tuple[int, str]] = []
        self.reached: list[int] = []
        self.home_ned_m: Vec3 = (0.0, 0.0, 0.0)

    # --- what the mission protocol asks (`mission.Plans`) --------------------------------------------------------

    def most_items(self, mission_type: int) -> int:
        """Room for a mission; fences and rally points are not taken."""
        return _MOST_ITEMS if mission_type == MISSION else 0

    def refusal(self, mission_type: int, item: MissionItem) -> int:
        """MAV_MISSION_RESULT of an item; home, the first, may be anything."""
        return ACCEPTED if item.command in _NAMES else _UNSUPPORTED

    def plan(self, mission_type: int) -> tuple[MissionItem, ...]:
        """The stored items, home first."""
        if mission_type != MISSION or not self.items:
            return ()
        x, y = geodetic(self.home_ned_m)
        home = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, 0, (0.0,) * 4, x, y, HOME_ALTITUDE_M - self.home_ned_m[2])
        return (home, *self.items)

    def replace(self, mission_type: int, items: tuple[MissionItem, ...]) -> None:
        """A new plan, whose first item counts as home; empty clears it."""
        if mission_type == MISSION:
            self.items, self.current, self._stage = items[1:], 0, "waits"
            if items:
                self.texts.append((_INFO, "Flight plan received"))

    def set_current(self, index: int) -> bool:
        """Go to an item."""
        if not 0 <= index <= len(self.items):
            return False
        self.current, self.has_jumped = index, True
        return True

    def say(self, severity: int, text: str) -> None:
        """What the protocol says is PX4's; ArduPilot has no words for it."""

    # --- what AUTO asks ----------------------------------------------------------------------------------------

    @property
    def starts_with_takeoff(self) -> bool:
        """Whether it can be begun on the ground."""
        return bool(self.items) and self.items[0].command == TAKEOFF

    @property
    def item(self) -> MissionItem | None:
        """The item in force; None before the first and after the last."""
        is_flown = self._stage == "flies" and 1 <= self.current <= len(self.items)
        return self.items[self.current - 1] if is_flown else None

    @property
    def goes_on(self) -> bool:
        """Whether a place to fly to follows on the item in force."""
        after = (item.command for item in self.items[self.current :])
        following = next((command for command in after if command != CHANGE_SPEED), None)
        return following is not None and following != RTL

    @property
    def is_over(self) -> bool:
        """Whether its last item has been flown."""
        return bool(self.items) and self._stage == "over"

    @property
    def state(self) -> int:
        """MISSION_STATE of MISSION_CURRENT."""
        if not self.items and self._stage == "waits":
            return int(mavlink.MISSION_STATE_NO_MISSION)
        if self._stage == "flies" and self.is_paused:
            return int(mavlink.MISSION_STATE_PAUSED)
        return _STATES[self._stage]

    def begin(self) -> None:
        """Take it up: the item in force is the next one to be begun; after the last one, the first."""
        self.current = 0 if self._stage == "over" and not self.has_jumped else max(0, self.current - 1)
        self.has_jumped = self.is_paused = False

    def leave(self) -> None:
        """Another mode is flown."""
        self._stage = "over" if self._stage == "over" else "waits"

    def pause(self, is_pause: bool) -> None:
        """Stop on the way, or go on."""
        self.is_paused = is_pause

    def finish(self, is_flown: bool) -> None:
        """The vehicle is disarmed: the next flight begins anew. `is_flown`: that was what the item asked for."""
        if is_flown and self.item is not None:
            self.reach(is_told=False)
            self._stage = "over"
        self.current = 0

    def go_on(self) -> MissionItem | None:
        """The next item; None when there is none any more, and the last one stays the current one."""
        self._stage = "flies" if self.current < len(self.items) else "over"
        if self._stage == "over":
            return None
        self.current += 1
        item = self.items[self.current - 1]
        self.texts.append((_INFO, f"Mission: {self.current} {_NAMES[item.command]}"))
        return item

    def reach(self, is_told: bool = True) -> None:
        """The item in force has been flown. Of several in one moment the last alone is told, as on the real one."""
        self.reached = [self.current]
        if is_told:
            self.texts.append((_INFO, f"Reached command #{self.current}"))


def place_of(item: MissionItem, here_ned_m: Vec3, home_ned_m: Vec3) -> Vec3:
    """Where an item leads, NED; a latitude and longitude of 0 mean: where the vehicle is."""
    n, e = north_east(item.x, item.y) if item.is_global and (item.x or item.y) else here_ned_m[:2]
    is_above_home = item.frame in _ABOVE_HOME
    return (n, e, home_ned_m[2] - item.z if is_above_home else HOME_ALTITUDE_M - item.z)
