"""A scripted PX4 for the agent to talk to, and the rule of time that both are stepped by.

The vehicle does what it is told as far as telemetry shows it, without any physics: it climbs, holds still and sinks at
constant speed. Every answer and every stream can be overridden.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mavquad.agent import Agent
from mavquad.agent_params import AgentParams, FlightParams
from mavquad.control.params import LawParams
from mavquad.drivers.runner import Runner
from mavquad.flight.guard_motion import JumpParams
from mavquad.flight.guards import GuardParams
from mavquad.flight.machine import Phase
from mavquad.flight.mission import MissionParams
from mavquad.flight.parameters import VehicleParameters
from mavquad.flight_record import Note
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.firmware import px4
from mavquad.protocol.link import LinkParams
from mavquad.types import Depth

START_US = 1_600_000_000_000_000
TICK_US = 10_000
BOOT_MS = 20_000
ALTITUDE_M = 2.5
SPEED_M_S = 2.5

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
POSCTL = px4.mode(3)
SETPOINT = "SET_ACTUATOR_CONTROL_TARGET"
PROBE = {SETPOINT: "zero", "offboard": "probe", "loiter": "withdraw"}
"""What a message is called while it is probed whether the vehicle takes torques."""

PARAMS = AgentParams(
    link=LinkParams(url="udpin:127.0.0.1:14540"),
    flight=FlightParams(settle_s=0.5),
    guards=GuardParams(
        stale_attitude_s=0.1,
        stale_attitude_at_torque_s=0.1,
        late_position_s=0.1,
        stale_position_s=0.1,
        jump=JumpParams(position_m=0.0),
    ),
    mission=MissionParams(name="hover", duration_s=2.5),
    parameters=VehicleParameters(px4={}, arducopter={}),
)
PARAMETERS = {
    "MPC_THR_HOVER": (mavlink.MAV_PARAM_TYPE_REAL32, 0.45),
    "MIS_TAKEOFF_ALT": (mavlink.MAV_PARAM_TYPE_REAL32, 2.5),
    "COM_RCL_EXCEPT": (mavlink.MAV_PARAM_TYPE_INT32, struct.unpack("<f", struct.pack("<i", 4))[0]),
    "COM_OF_LOSS_T": (mavlink.MAV_PARAM_TYPE_REAL32, 1.0),
}
VERSIONS: dict[Depth, tuple[int, int, int]] = {"torque": (1, 13, 3), "rate": (1, 16, 2), "attitude": (1, 16, 2)}
SETPOINTS: dict[Depth, str] = {"torque": SETPOINT, "rate": "SET_ATTITUDE_TARGET", "attitude": "SET_ATTITUDE_TARGET"}
Answer = Callable[["ScriptedVehicle"], None]


def heartbeat(autopilot: int, kind: int, mode: px4.Mode = px4.LOITER, armed: bool = False) -> Any:
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base, mode.custom_mode, mavlink.MAV_STATE_ACTIVE, 3)


def answer(*results: int, text: str = "") -> Answer:
    """Acknowledge the command with these results, and do nothing."""

    def act(vehicle: ScriptedVehicle) -> None:
        if text:
            vehicle.say(mavlink.MAVLink_statustext_message(4, text.encode()))
        for result in results:
            vehicle.ack(result)

    return act


def silent(vehicle: ScriptedVehicle) -> None:
    """Do not answer at all."""


@dataclass
class ScriptedVehicle:
    """Attributes: `answers` by the command's name, `muted` message names, periods of the pose streams, how much later than
    its stamp a position is sent, its speed `drift_m_s` to the east."""

    answers: dict[str, Answer] = field(default_factory=dict)
    autopilot: int = mavlink.MAV_AUTOPILOT_PX4
    kind: int = mavlink.MAV_TYPE_QUADROTOR
    version: tuple[int, int, int] = (1, 13, 3)
    muted: set[str] = field(default_factory=set)
    lost: Callable[[Any], bool] = lambda message: False
    repeated: Callable[[Any], bool] = lambda message: False
    tick_us: int = TICK_US
    attitude_ms: int = 10
    position_ms: int = 10
    position_late_ms: int = 0
    mode: px4.Mode = px4.LOITER
    armed: bool = False
    prearm: bool = True
    transmitter: bool = False
    thrust: float = 0.5
    height_m: float = 0.0
    east_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.3
    drift_m_s: float = 0.0
    parameters: dict[str, tuple[int, float]] = field(default_factory=lambda: dict(PARAMETERS))

    def __post_init__(self) -> None:
        self.encoder = Encoder(1, 1)
        self.outbox: list[bytes] = []
        self.command: Any = None
        self.ticks = 0
        self.on_ground_us = 0
        self._late: deque[tuple[int, Any]] = deque()

    @property
    def boot_ms(self) -> int:
        return BOOT_MS + self.ticks * self.tick_us // 1000

    def due(self, period_ms: int, at_ms: int = 0) -> bool:
        return (self.boot_ms - BOOT_MS) % period_ms == at_ms

    def say(self, message: Any) -> None:
        frame = self.encoder.encode(message)
        if message.get_type() not in self.muted and not self.lost(message):
            self.outbox += [frame] * (2 if self.repeated(message) else 1)

    def ack(self, result: int) -> None:
        self.say(mavlink.MAVLink_command_ack_message(self.command.command, result, 0, 0, 245, 190))

    # ------------------------------------------------------------------ what it is told

    def hear(self, message: Any, name: str) -> None:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            type_, value = self.parameters[message.param_id]
            self.say(mavlink.MAVLink_param_value_message(message.param_id.encode(), value, type_, 700, 1))
        elif kind == "PARAM_SET" and message.param_id in self.parameters:
            self.parameters[message.param_id] = (message.param_type, message.param_value)
            self.say(
                mavlink.MAVLink_param_value_message(
                    message.param_id.encode(), message.param_value, message.param_type, 700, 1
                )
            )
        elif kind == "COMMAND_LONG":
            self.command = message
            self.answers.get(name, getattr(type(self), f"do_{name}"))(self)

    def do_arm(self) -> None:
        self.armed = True
        self.ack(ACCEPTED)

    def do_disarm(self) -> None:
        self.armed = False
        self.ack(ACCEPTED)

    def do_interval(self) -> None:
        self.ack(ACCEPTED)

    def do_request(self) -> None:
        self.ack(ACCEPTED)
        self.tell_version()

    def tell_version(self) -> None:
        major, minor, patch = self.version
        packed = major << 24 | minor << 16 | patch << 8 | 255
        self.say(mavlink.MAVLink_autopilot_version_message(0, packed, 0, 0, 0, *[bytes(8)] * 3, 0, 0, 0))

    def do_takeoff(self) -> None:
        self.mode = px4.TAKEOFF
        self.ack(ACCEPTED)

    def do_land(self) -> None:
        self.mode = px4.LAND
        self.ack(ACCEPTED)

    def do_loiter(self) -> None:
        self.mode = px4.LOITER
        self.ack(ACCEPTED)

    def do_home(self) -> None:
        self.mode = px4.RTL
        self.ack(ACCEPTED)

    def do_offboard(self) -> None:
        self.mode = px4.OFFBOARD
        self.ack(ACCEPTED)

    do_probe = do_offboard
    do_withdraw = do_loiter

    # ------------------------------------------------------------------ what it tells

    def tick(self) -> list[bytes]:
        """Time passes; the frames to deliver now."""
        self.ticks += 1
        climb_m_s = self._move()
        if self.due(1000):
            self.say(heartbeat(self.autopilot, self.kind, self.mode, self.armed))
        if self.due(500, at_ms=250):
            health = (0x10000000 if self.prearm else 0) | (0x10000 if self.transmitter else 0)
            self.say(mavlink.MAVLink_sys_status_message(health, health, health, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0))
        if self.due(200, at_ms=50):
            landed = mavlink.MAV_LANDED_STATE_IN_AIR if self.height_m > 0.0 else mavlink.MAV_LANDED_STATE_ON_GROUND
            self.say(mavlink.MAVLink_extended_sys_state_message(0, landed))
        if self.due(100, at_ms=70):
            self.say(
                mavlink.MAVLink_attitude_target_message(
                    self.boot_ms, 0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, self.thrust
                )
            )
        if self.due(self.attitude_ms):
            self.say(self.attitude())
        if self.due(self.position_ms):
            self._late.append((self.boot_ms + self.position_late_ms, self.position(climb_m_s)))
        while self._late and self._late[0][0] <= self.boot_ms:
            self.say(self._late.popleft()[1])
        outbox, self.outbox = self.outbox, []
        return outbox

    def attitude(self, **changes: float) -> Any:
        values = {"roll": self.roll_rad, "pitch": self.pitch_rad, "yaw": self.yaw_rad, **changes}
        return mavlink.MAVLink_attitude_message(self.boot_ms, *values.values(), 0.0, 0.0, 0.0)

    def position(self, climb_m_s: float = 0.0, **changes: float) -> Any:
        place = {"x": 1.0, "y": self.east_m, "z": -self.height_m}
        values = {**place, "vx": 0.0, "vy": self.drift_m_s, "vz": -climb_m_s, **changes}
        return mavlink.MAVLink_local_position_ned_message(self.boot_ms, *values.values())

    def _move(self) -> float:
        step_m = SPEED_M_S * self.tick_us * 1e-6
        self.east_m += self.drift_m_s * self.tick_us * 1e-6
        if self.mode == px4.TAKEOFF:
            self.height_m += step_m
            if self.height_m >= ALTITUDE_M:
                self.mode = px4.LOITER
            return SPEED_M_S
        if self.mode in (px4.LAND, px4.RTL) and self.armed:
            self.height_m = max(self.height_m - step_m, 0.0)
            self.on_ground_us += self.tick_us if self.height_m == 0.0 else 0
            self.armed = self.on_ground_us < 500_000
            return -SPEED_M_S if self.height_m > 0.0 else 0.0
        return 0.0


def command_name(message: Any) -> str:
    """The name of a COMMAND_LONG in these tests."""
    if message.command == mavlink.MAV_CMD_DO_SET_MODE:
        mode = px4.mode(int(message.param2), int(message.param3))
        return {px4.OFFBOARD: "offboard", px4.LOITER: "loiter", px4.RTL: "home"}.get(mode, mode.name)
    if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
        return "arm" if message.param1 else "disarm"
    return {
        mavlink.MAV_CMD_NAV_TAKEOFF: "takeoff",
        mavlink.MAV_CMD_NAV_LAND: "land",
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: "interval",
        mavlink.MAV_CMD_REQUEST_MESSAGE: "request",
    }[message.command]


@dataclass(frozen=True)
class Sent:
    """One frame of the agent; `phase` is the agent's when it went out."""

    stamp_us: int
    message: Any
    phase: Phase

    @property
    def name(self) -> str:
        """The command's name, or the message's."""
        kind = self.message.get_type()
        name = command_name(self.message) if kind == "COMMAND_LONG" else kind
        return PROBE.get(name, name) if self.phase in (Phase.PROBING, Phase.WITHDRAWING) else name


class Dialogue:
    """The agent and its peer. `sent` is all that the agent sent, `record` both directions in order, `keeps` whether what is
    about to be changed is kept."""

    def __init__(self, vehicle: ScriptedVehicle | None = None, params: AgentParams = PARAMS) -> None:
        self.vehicle = vehicle or ScriptedVehicle()
        self.agent = Agent(params, START_US)
        self.sent: list[Sent] = []
        self.record: list[tuple[int, bytes, bool]] = []
        self.events: list[tuple[int, str, tuple[float, ...]]] = []
        self.now_us = START_US
        self.powered = True
        self.keeps = True
        self._notes: list[Note] = []
        self._heard = 0
        self._runner = Runner(self.agent, START_US, self._on_sent, self)

    def frame(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        self.record.append((stamp_us, frame, outbound))

    def event(self, stamp_us: int, name: str, args: tuple[float | str, ...] = ()) -> None:
        self.events.append((stamp_us, name, args))

    def _on_sent(self, stamp_us: int, data: bytes) -> None:
        self.sent.append(Sent(stamp_us, decode(data), self.agent.phase))

    def deliver(self, *messages: Any, sender: Encoder | None = None) -> None:
        """Hand messages to the agent now, the vehicle's or those of somebody else."""
        encoder = sender or self.vehicle.encoder
        for message in messages:
            self._runner.datagram(encoder.encode(message), self.now_us)

    @property
    def lost(self) -> int:
        """Frames of the vehicle that the agent's side missed."""
        return self._runner.framer.lost((1, 1))

    def stop(self) -> None:
        self._runner.command("stop", self.agent.stop, self.now_us)

    def step(self) -> None:
        """One tick: the vehicle hears what was sent before, then speaks."""
        heard = len(self.sent)
        self.now_us += self.vehicle.tick_us
        self._runner.advance(self.now_us)
        if self.agent.awaits_record and self.keeps:
            self._runner.command("kept", self.agent.kept, self.now_us)
        if not self.powered:
            return
        for sent in self.sent[self._heard : heard]:
            self.vehicle.hear(sent.message, sent.name)
        self._heard = heard
        for frame in self.vehicle.tick():
            self._runner.datagram(frame, self.now_us)

    def run(self, until: Callable[[], bool] | Phase = Phase.DONE, limit_s: float = 150.0) -> Dialogue:
        """Step until the condition holds, or the phase is reached; it must be within `limit_s`."""
        end_us = self.now_us + round(limit_s * 1e6)
        while not (self.agent.phase is until if isinstance(until, Phase) else until()):
            assert self.now_us < end_us, f"still {self.agent.phase} after {limit_s} s"
            self.step()
        return self

    def until_sent(self, name: str, count: int = 1) -> Dialogue:
        return self.run(lambda: len(self.of(name)) >= count)

    def run_for(self, duration_s: float) -> Dialogue:
        for _ in range(round(duration_s * 1e6 / self.vehicle.tick_us)):
            self.step()
        return self

    # ------------------------------------------------------------------ what was seen

    @property
    def setpoints(self) -> list[Sent]:
        """The setpoints, of whichever depth."""
        return [sent for sent in self.sent if sent.name in SETPOINTS.values()]

    def arrivals(self, kind: str) -> list[int]:
        """When messages of this kind arrived with a newer stamp than all before."""
        newest, stamps = -1, []
        for stamp_us, frame, outbound in self.record:
            message = decode(frame)
            if not outbound and message.get_type() == kind and message.time_boot_ms > newest:
                newest = message.time_boot_ms
                stamps.append(stamp_us)
        return stamps

    def names(
        self,
        *,
        ignore: tuple[str, ...] = (
            *("HEARTBEAT", "TIMESYNC", "PARAM_REQUEST_READ", "interval", "request"),
            *PROBE.values(),
        ),
    ) -> list[str]:
        """What was sent, in order, repetitions collapsed; the probe of the torques left out."""
        names = [sent.name for sent in self.sent if sent.name not in ignore]
        return [name for i, name in enumerate(names) if i == 0 or names[i - 1] != name]

    def of(self, name: str) -> list[Sent]:
        return [sent for sent in self.sent if sent.name == name]

    @property
    def notes(self) -> list[Note]:
        """The story so far."""
        self._notes += self.agent.take_notes()
        return self._notes

    @property
    def phases(self) -> list[str]:
        """The phases entered so far."""
        return [note.text for note in self.notes if note.kind == "phase"]


def with_law(**law: object) -> AgentParams:
    """The agent's parameters with these keys of [law]."""
    return PARAMS.model_copy(update={"law": LawParams.model_validate(law)})


def at_depth(depth: Depth, **vehicle: Any) -> Dialogue:
    """A dialogue with a vehicle whose firmware takes this depth, and an agent that is told to fly it."""
    return Dialogue(ScriptedVehicle(version=VERSIONS[depth], **vehicle), with_law(depth=depth))
