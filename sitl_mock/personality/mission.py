"""The vehicle's side of the MAVLink mission protocol: plans are uploaded, read back and cleared. No clock, no sockets.

A plan is a mission, a fence or a set of rally points (MAV_MISSION_TYPE). An upload is driven by the vehicle: it asks
for item after item and asks again when none comes; a download is driven by the client. One transfer a port, one
upload in all. Results and texts are PX4's; what is taken as an item is the personality's own (`Plans.refusal`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.personality import Sender
from sitl_mock.port import AUTOPILOT_COMPONENT, Port

MISSION: int = mavlink.MAV_MISSION_TYPE_MISSION
FENCE: int = mavlink.MAV_MISSION_TYPE_FENCE
RALLY: int = mavlink.MAV_MISSION_TYPE_RALLY
ACCEPTED: int = mavlink.MAV_MISSION_ACCEPTED
_ALL: int = mavlink.MAV_MISSION_TYPE_ALL
_ERROR: int = mavlink.MAV_MISSION_ERROR
_UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED
_CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
_INFO: int = mavlink.MAV_SEVERITY_INFO

_ASK_AGAIN_US = 250_000
_GIVE_UP_US = 5_000_000
_GLOBAL_FRAMES = frozenset((0, 3, 5, 6, 10, 11))
_DEGREE = 1e7


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item as MISSION_ITEM_INT has it.

    `x` and `y` are latitude and longitude in degrees times 1e7 in the global frames, else what param5 and param6 say.
    """

    command: int
    frame: int
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1

    @property
    def is_global(self) -> bool:
        """Whether x, y is a latitude and a longitude."""
        return self.frame in _GLOBAL_FRAMES


class Plans(Protocol):
    """What a personality does with the plans that the server transfers."""

    def most_items(self, mission_type: int) -> int:
        """How many items of this MAV_MISSION_TYPE there is room for; 0 for a type that it does not have."""

    def refusal(self, mission_type: int, item: MissionItem) -> int:
        """MAV_MISSION_RESULT of one item as it comes in; ACCEPTED keeps it."""

    def plan(self, mission_type: int) -> tuple[MissionItem, ...]:
        """The plan in force."""

    def replace(self, mission_type: int, items: tuple[MissionItem, ...]) -> None:
        """Put a whole new plan in force; empty clears it."""

    def set_current(self, index: int) -> bool:
        """Go to an item of the mission; False if there is none of that number."""

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT."""


@dataclass(slots=True)
class _Transfer:
    is_upload: bool
    mission_type: int
    partner: Sender
    count: int
    heard_us: int
    next_index: int = 0
    asked_us: int = 0
    items: list[MissionItem] = field(default_factory=list)


class MissionServer:
    """Answers the mission messages that come in on any port; `step` asks again for what was lost."""

    MESSAGES = (
        "MISSION_COUNT",
        "MISSION_ITEM",
        "MISSION_ITEM_INT",
        "MISSION_REQUEST_LIST",
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
        "MISSION_ACK",
        "MISSION_CLEAR_ALL",
        "MISSION_SET_CURRENT",
    )

    def __init__(self, system_id: int, plans: Plans, asks_for_int: bool = False, in_order: bool = True) -> None:
        self._system_id = system_id
        self._plans = plans
        self._speaks_int = asks_for_int
        self._in_order = in_order
        self.transfers: dict[Port, _Transfer] = {}
        self._finished: dict[Port, tuple[Sender, int, int]] = {}
        self._handlers: dict[str, Callable[[Message, Sender, Port, int], None]] = {
            "MISSION_COUNT": self._count,
            "MISSION_ITEM": self._item,
            "MISSION_ITEM_INT": self._item,
            "MISSION_REQUEST_LIST": self._request_list,
            "MISSION_REQUEST": self._request,
            "MISSION_REQUEST_INT": self._request,
            "MISSION_ACK": self._acknowledged,
            "MISSION_CLEAR_ALL": self._clear,
            "MISSION_SET_CURRENT": self._set_current,
        }

    def handles(self, kind: str) -> bool:
        """Whether messages of this name are for the server."""
        return kind in self._handlers

    def handle(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """React to a mission message; answers go out on its port."""
        components = (0, AUTOPILOT_COMPONENT, mavlink.MAV_COMP_ID_MISSIONPLANNER)
        if message.target_system == self._system_id and message.target_component in components:
            self._handlers[message.get_type()](message, sender, port, boot_us)

    def step(self, boot_us: int) -> None:
        """Ask again, and give up, as time passes."""
        for port, transfer in list(self.transfers.items()) if self.transfers else ():
            if boot_us - transfer.heard_us > _GIVE_UP_US:
                self._plans.say(_CRITICAL, "Operation timeout")
                del self.transfers[port]
            elif transfer.is_upload and boot_us - transfer.asked_us > _ASK_AGAIN_US:
                self._ask(transfer, port, boot_us)

    # --- upload ------------------------------------------------------------------------------------------------

    def _count(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        self._drop_download(port)
        mission_type, running = message.mission_type, self.transfers.get(port)
        if running is not None and running.is_upload and running.next_index == 0 and running.partner == sender:
            running.count, running.heard_us = message.count, boot_us
            running.mission_type = mission_type
            self._ask(running, port, boot_us)
        elif running is not None:
            self._plans.say(_CRITICAL, "WPM: REJ. CMD: Busy" if running.is_upload else "WPM: IGN MISSION_COUNT: Busy")
            self._ack(port, sender, _ERROR, mission_type)
        elif any(other.is_upload for other in self.transfers.values()):
            self._ack(port, sender, _ERROR, mission_type)
        elif mission_type > RALLY or message.count > self._plans.most_items(mission_type):
            result = _UNSUPPORTED if mission_type > RALLY else mavlink.MAV_MISSION_NO_SPACE
            self._ack(port, sender, result, mission_type)
        elif message.count == 0:
            self._plans.replace(mission_type, ())
            self._ack(port, sender, ACCEPTED, mission_type)
        else:
            self.transfers[port] = transfer = _Transfer(True, mission_type, sender, message.count, boot_us)
            self._ask(transfer, port, boot_us)

    def _ask(self, transfer: _Transfer, port: Port, boot_us: int) -> None:
        transfer.asked_us = boot_us
        ask = (
            mavlink.MAVLink_mission_request_int_message if self._speaks_int else mavlink.MAVLink_mission_request_message
        )
        port.send(ask(*transfer.partner, transfer.next_index, transfer.mission_type))

    def _item(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        self._speaks_int = message.get_type() == "MISSION_ITEM_INT"
        transfer = self.transfers.get(port)
        if transfer is None or not transfer.is_upload:
            self._stray_item(message, sender, port, is_busy=transfer is not None)
        elif message.mission_type != transfer.mission_type:
            self._ack(port, sender, _ERROR, message.mission_type)
        else:
            transfer.heard_us = boot_us
            if message.seq == transfer.next_index:
                self._take(transfer, _item_of(message), port, boot_us)

    def _stray_item(self, message: Message, sender: Sender, port: Port, is_busy: bool) -> None:
        if self._finished.get(port) == (sender, message.mission_type, message.seq):
            self._ack(port, sender, ACCEPTED, message.mission_type)  # our ACK of the whole was lost
            return
        self._plans.say(_CRITICAL, f"IGN MISSION_ITEM: {'Busy' if is_busy else 'No transfer'}")
        self._ack(port, sender, _ERROR, message.mission_type)

    def _take(self, transfer: _Transfer, item: MissionItem | None, port: Port, boot_us: int) -> None:
        result = _ERROR if item is None else self._plans.refusal(transfer.mission_type, item)
        if item is None or result != ACCEPTED:
            self._plans.say(_CRITICAL, "IGN MISSION_ITEM: Invalid item")
            del self.transfers[port]
            self._ack(port, transfer.partner, result, transfer.mission_type)
            return
        transfer.items.append(item)
        transfer.next_index += 1
        if transfer.next_index < transfer.count:
            self._ask(transfer, port, boot_us)
            return
        del self.transfers[port]
        self._finished[port] = (transfer.partner, transfer.mission_type, transfer.count - 1)
        self._plans.replace(transfer.mission_type, tuple(transfer.items))
        self._ack(port, transfer.partner, ACCEPTED, transfer.mission_type)

    # --- download ----------------------------------------------------------------------------------------------

    def _request_list(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        running = self.transfers.get(port)
        if running is not None and running.is_upload:
            self._plans.say(_INFO, "Mission download request ignored, already active")
            return
        plan = self._plans.plan(message.mission_type)
        self.transfers[port] = _Transfer(False, message.mission_type, sender, len(plan), boot_us)
        port.send(mavlink.MAVLink_mission_count_message(*sender, len(plan), message.mission_type))

    def _request(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        transfer = self.transfers.get(port)
        if not self._in_order and (transfer is None or not transfer.is_upload):
            self._give_any(message, sender, port)
        elif transfer is None:
            return  # as PX4: some displays ask without a transfer
        elif sender != transfer.partner:
            self._plans.say(_CRITICAL, "WPM: REJ. CMD: partner id mismatch")
        elif transfer.is_upload:
            self._plans.say(_CRITICAL, "WPM: REJ. CMD: Busy")
        elif message.mission_type == transfer.mission_type:
            self._give(transfer, message, port, boot_us)

    def _give_any(self, message: Message, sender: Sender, port: Port) -> None:
        """As ArduPilot: any item, in any order, without having asked how many there are."""
        plan = self._plans.plan(message.mission_type)
        if message.seq >= len(plan):
            self._ack(port, sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, message.mission_type)
            return
        as_int = message.get_type() == "MISSION_REQUEST_INT"
        port.send(item_message(plan[message.seq], message.seq, sender, message.mission_type, as_int))

    def _drop_download(self, port: Port) -> None:
        """ArduPilot does not mind a download that was not ended."""
        running = self.transfers.get(port)
        if not self._in_order and running is not None and not running.is_upload:
            del self.transfers[port]

    def _give(self, transfer: _Transfer, message: Message, port: Port, boot_us: int) -> None:
        plan = self._plans.plan(transfer.mission_type)
        index = message.seq
        if index not in (transfer.next_index, transfer.next_index - 1) or index >= len(plan):
            del self.transfers[port]
            self._plans.say(_CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected")
            self._ack(port, transfer.partner, _ERROR, transfer.mission_type)
            return
        transfer.heard_us, transfer.next_index = boot_us, index + 1
        as_int = message.get_type() == "MISSION_REQUEST_INT"
        port.send(item_message(plan[index], index, transfer.partner, transfer.mission_type, as_int))

    def _acknowledged(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        transfer = self.transfers.get(port)
        if transfer is None or sender != transfer.partner or message.mission_type != transfer.mission_type:
            return
        if not transfer.is_upload or message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            del self.transfers[port]
        elif message.type == _UNSUPPORTED:  # it speaks the other kind of item
            self._speaks_int = not self._speaks_int
            self._ask(transfer, port, boot_us)

    # --- the rest ----------------------------------------------------------------------------------------------

    def _clear(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        self._drop_download(port)
        if port in self.transfers:
            self._plans.say(_CRITICAL, "WPM: IGN CLEAR CMD: Busy")
            return
        kinds = (MISSION, FENCE, RALLY) if message.mission_type == _ALL else (message.mission_type,)
        known = [kind for kind in kinds if kind <= RALLY]
        for kind in known:
            self._plans.replace(kind, ())
        self._ack(port, sender, ACCEPTED if known else _UNSUPPORTED, message.mission_type)

    def _set_current(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        self._drop_download(port)
        if port in self.transfers:
            self._plans.say(_CRITICAL, "WPM: IGN WP CURR CMD: Busy")
        elif not self._plans.set_current(message.seq):
            self._plans.say(_CRITICAL, "WPM: WP CURR CMD: Not in list")

    @staticmethod
    def _ack(port: Port, partner: Sender, result: int, mission_type: int) -> None:
        port.send(mavlink.MAVLink_mission_ack_message(*partner, result, mission_type))


def item_message(item: MissionItem, index: int, partner: Sender, mission_type: int, as_int: bool) -> Message:
    """The item as MISSION_ITEM_INT, or as MISSION_ITEM with x and y in degrees (MAVLink 1's, good to about a metre)."""
    scale = _DEGREE if item.is_global and not as_int else 1
    place = (item.x, item.y) if as_int else (item.x / scale, item.y / scale)
    message = mavlink.MAVLink_mission_item_int_message if as_int else mavlink.MAVLink_mission_item_message
    return message(
        *partner, index, item.frame, item.command, 0, item.autocontinue, *item.params, *place, item.z, mission_type
    )


def _item_of(message: Message) -> MissionItem | None:
    """The item in MISSION_ITEM or MISSION_ITEM_INT; None if its place is no number."""
    is_global, x, y = message.frame in _GLOBAL_FRAMES, message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        scale = _DEGREE if is_global else 1
        if not (math.isfinite(x) and math.isfinite(y) and max(abs(x), abs(y)) * scale < 2**31):
            return None
        x, y = round(x * scale), round(y * scale)
    params = (message.param1, message.param2, message.param3, message.param4)
    return MissionItem(message.command, message.frame, params, x, y, message.z, message.autocontinue)
