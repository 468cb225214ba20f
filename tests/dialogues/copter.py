"""A scripted ArduCopter, beside the scripted PX4 of `tests.dialogues.peer`: GUIDED to arm, to take off and to be flown in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mavquad.flight.parameters import VehicleParameters
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import Mode
from mavquad.protocol.firmware.ardupilot import BRAKE, GUIDED, LAND, RTL, mode
from tests.dialogues.peer import ACCEPTED, PARAMS, SPEED_M_S, Dialogue, ScriptedVehicle, command_name

STABILIZE = mode(0)
REAL = mavlink.MAV_PARAM_TYPE_REAL32
PARAMETERS = {
    "MOT_THST_HOVER": (REAL, 0.4),
    "GUID_OPTIONS": (mavlink.MAV_PARAM_TYPE_INT32, 0.0),
    "GUID_TIMEOUT": (REAL, 3.0),
}
CHANGING = PARAMS.model_copy(
    update={"parameters": VehicleParameters(arducopter={"GUID_OPTIONS": "+8", "GUID_TIMEOUT": 0.3})}
)


@dataclass
class ScriptedCopter(ScriptedVehicle):
    """ArduCopter 4.7 on the ground in STABILIZE."""

    autopilot: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    version: tuple[int, int, int] = (4, 7, 0)
    mode: Mode = STABILIZE
    parameters: dict[str, tuple[int, float]] = field(default_factory=lambda: dict(PARAMETERS))
    goal_m: float = 0.0

    def hear(self, message: Any, name: str) -> None:
        if message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_DO_SET_MODE:
            self.command = message
            asked = mode(int(message.param2))
            self.answers.get(asked.name, lambda _: self.enter(asked))(self)
        else:
            super().hear(message, name)

    def enter(self, asked: Mode) -> None:
        """A mode that it is told to enter."""
        self.mode = asked
        self.ack(ACCEPTED)

    def do_takeoff(self) -> None:
        self.goal_m = self.command.param7
        self.ack(ACCEPTED)

    def do_land(self) -> None:
        self.enter(LAND)

    def _move(self) -> float:
        step_m = SPEED_M_S * self.tick_us * 1e-6
        if self.mode == GUIDED and self.armed and self.height_m < self.goal_m:
            self.height_m += step_m
            return SPEED_M_S
        if self.mode in (LAND, RTL) and self.armed:
            self.height_m = max(self.height_m - step_m, 0.0)
            self.on_ground_us += self.tick_us if self.height_m == 0.0 else 0
            self.armed = self.on_ground_us < 500_000
            return -SPEED_M_S if self.height_m > 0.0 else 0.0
        return 0.0


def names(dialogue: Dialogue) -> list[str]:
    """What was sent, in order, repetitions collapsed; modes by their names."""
    ignored = ("HEARTBEAT", "TIMESYNC", "PARAM_REQUEST_READ", "PARAM_SET", "interval", "request")
    said = [name_of(sent.message) for sent in dialogue.sent]
    kept = [name for name in said if name not in ignored]
    return [name for i, name in enumerate(kept) if i == 0 or kept[i - 1] != name]


def name_of(message: Any) -> str:
    """A mode's name for a command to enter it, else the command's or the message's."""
    if message.get_type() != "COMMAND_LONG":
        return str(message.get_type())
    is_mode = message.command == mavlink.MAV_CMD_DO_SET_MODE
    return mode(int(message.param2)).name if is_mode else command_name(message)


def stamps_of(dialogue: Dialogue, name: str) -> list[int]:
    """When it was sent."""
    return [sent.stamp_us for sent in dialogue.sent if name_of(sent.message) == name]


__all__ = ["BRAKE", "CHANGING", "GUIDED", "LAND", "RTL", "STABILIZE", "ScriptedCopter", "name_of", "names", "stamps_of"]
