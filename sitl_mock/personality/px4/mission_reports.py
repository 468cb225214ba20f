"""What PX4 tells of a mission by itself: the current item and the items reached, each also again and again."""

from __future__ import annotations

from collections.abc import Sequence

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.personality.px4.mission_flight import MissionFlight
from sitl_mock.personality.px4.mission_plan import MissionPlan
from sitl_mock.port import Port

_NO_MISSION = 65535
_NOT_STARTED, _ACTIVE, _COMPLETE = 2, 3, 5
_IN_MISSION_MODE, _IN_ANOTHER = 1, 2
_AGAIN = 10
_AGAIN_EVERY_US = 100_000


class MissionReports:
    """Sends MISSION_CURRENT when it changes, MISSION_ITEM_REACHED at once and the last one another ten times."""

    def __init__(self, plan: MissionPlan, flight: MissionFlight, ports: Sequence[Port], is_113: bool) -> None:
        self._plan = plan
        self._is_113 = is_113
        self._flight = flight
        self._ports = ports
        self._is_flown = False
        self._told: tuple[int, int] = (0, 0)
        self._last_reached = -1
        self._times_left = 0
        self._due_us = 0

    def current(self) -> Message:
        """MISSION_CURRENT; without a mission as recorded on 1.16; 1.13 knows its first field alone."""
        if self._is_113:
            return mavlink.MAVLink_mission_current_message(self._plan.current if self._plan.items else 0)
        count = len(self._plan.items)
        if not count:
            return mavlink.MAVLink_mission_current_message(0, _NO_MISSION)
        state = (_COMPLETE if self._flight.is_over else _ACTIVE) if self._is_flown else _NOT_STARTED
        mode = _IN_MISSION_MODE if self._is_flown else _IN_ANOTHER
        return mavlink.MAVLink_mission_current_message(self._plan.current, count, state, mode)

    def step(self, is_flown: bool, boot_us: int) -> None:
        """Send what there is to tell."""
        self._is_flown = is_flown
        now = (self._plan.current, len(self._plan.items))
        if now != self._told:
            self._told = now
            if now[1]:
                self._send(self.current())
        reached = self._flight.reached
        if reached:
            for index in reached:
                self._send(mavlink.MAVLink_mission_item_reached_message(index))
            self._last_reached, self._times_left = reached[-1], _AGAIN
            self._due_us = boot_us + _AGAIN_EVERY_US
            reached.clear()
        elif self._times_left and boot_us >= self._due_us:
            self._times_left -= 1
            self._due_us += _AGAIN_EVERY_US
            self._send(mavlink.MAVLink_mission_item_reached_message(self._last_reached))

    def _send(self, message: Message) -> None:
        for port in self._ports:
            port.send(message)
