"""The agent core: link, flight and law as one `Endpoint`. No socket, no clock, no sleep, no log.

It is driven live, in lockstep or in replay; what it sends is a function of its inputs alone.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from mavquad.agent_params import AgentParams
from mavquad.endpoint import NEVER_US, floor_to_grid_us, grid_us
from mavquad.errors import FlightEnded, MavquadError, VehicleRefused, VehicleTimeout
from mavquad.flight.airframe import HoverThrust
from mavquad.flight.guards import Tripped, check
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.machine import IN_FLIGHT, Event, Phase, next_phase
from mavquad.flight.pose import PoseIntake
from mavquad.flight_record import TraceRow
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Encoder, Message, decode, mavlink, message_id
from mavquad.protocol.command import Command, CommandExchange, Reply
from mavquad.protocol.firmware import px4
from mavquad.protocol.link import Link, heartbeat
from mavquad.protocol.params import ParamReader
from mavquad.protocol.streams import StreamMonitor, requests, shortfalls
from mavquad.types import Attitude, Position

HEARTBEAT_US = 1_000_000
SETPOINTS_BEFORE_OFFBOARD = 20
HOVER_SPEED_M_S = 0.4
LIFTED_M = 0.5
DISARM_PATIENCE_US = 5_000_000
TEXT_MATTERS_US = 3_000_000
TEXTS_KEPT = 3
PARAMETERS = ("MPC_THR_HOVER", "MIS_TAKEOFF_ALT", "COM_RCL_EXCEPT", "COM_OF_LOSS_T")
VERSION_REQUESTS = 5
REASON_US = 250_000
PREARM_OK = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK

# Modes that are ours to expect in each phase; a change to any other one is the pilot's or a failsafe's.
_OWN_MODES = {
    Phase.TAKING_OFF: (px4.TAKEOFF, px4.LOITER),
    Phase.ENGAGING: (px4.TAKEOFF, px4.LOITER, px4.OFFBOARD),
    Phase.FLYING: (px4.OFFBOARD,),
    Phase.HANDING_BACK: (px4.OFFBOARD, px4.LOITER, px4.LAND),
    # Landing may begin right behind the takeoff command, before HEARTBEAT shows what that did.
    Phase.LANDING: (px4.TAKEOFF, px4.OFFBOARD, px4.LOITER, px4.LAND),
}
_LAW_PHASES = frozenset((Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK))


@dataclass(frozen=True, slots=True)
class Note:
    """A line of the flight's story: a phase entered, a text of the vehicle, a guard."""

    stamp_us: int
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class Status:
    """What a display wants to know at any moment."""

    phase: Phase
    mode: str
    armed: bool
    vehicle: str
    height_m: float | None
    position_error_m: float | None
    yaw_error_rad: float | None
    controls: tuple[float, ...]
    mission_s: float
    mission_duration_s: float
    position_hz: float
    setpoints_sent: int


class Agent:
    """Flies one mission on one vehicle. See `mavquad.endpoint.Endpoint` for the calls.

    Attributes:
        phase: where the flight is.
        error: why the flight did not complete; None while it may still.
        interrupted: whether the operator stopped it.
        setpoints_sent: setpoints of the law; safe_setpoints: those sent once per loss.
        version: the autopilot's release, (0, 0, 0) until it is known.
    """

    def __init__(self, params: AgentParams, start_us: int) -> None:
        self._params = params
        self._now_us = floor_to_grid_us(start_us)
        self._outbox: list[bytes] = []
        self._encoder = Encoder(params.link.system_id, params.link.component_id)
        self._silence_us = grid_us(params.link.heartbeat_timeout_s)
        self._heartbeat_us = self._now_us if params.link.speaks_first else NEVER_US
        self._exchange = CommandExchange()
        self._queue: list[Command] = []
        self._version_requests = 0
        self._refusal: tuple[Command, str] | None = None
        self._refusal_us = NEVER_US
        self._parameters = ParamReader()
        self._phase_us = self._now_us
        self._phase_limit_us = self._limit_us(Phase.CONNECTING)
        self._ground_m = 0.0
        self._settled_us = NEVER_US
        self._mode: px4.Mode | None = None
        self._armed = False
        self._prearm_ok = False
        self._on_ground_us = NEVER_US
        self._law_on = False
        self._texts: deque[tuple[int, str]] = deque(maxlen=TEXTS_KEPT)
        self._notes: list[Note] = []
        self._trace: list[TraceRow] = []
        self._last_row: TraceRow | None = None
        self._monitors = {"ATTITUDE": StreamMonitor(), "LOCAL_POSITION_NED": StreamMonitor()}
        self._hover = HoverThrust(params.airframe)
        self._law = LawFlight(params.law, params.airframe, params.mission, self._hover)
        self.pose = PoseIntake(params.guards)
        self.link = Link(params.link)
        self.phase = Phase.CONNECTING
        self.error: MavquadError | None = None
        self.interrupted = False
        self.setpoints_sent = 0
        self.safe_setpoints = 0
        self.version = (0, 0, 0)

    # ------------------------------------------------------------------ Endpoint

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one frame. Frames of others than the vehicle are counted and ignored."""
        self._now_us = now_us
        if self._heartbeat_us == NEVER_US and not self.done:
            self._heartbeat_us = now_us + HEARTBEAT_US
            self._send(heartbeat())
        if not self.link.accept(data, now_us) or self.phase is Phase.DONE:
            return
        # A message that nobody here reads is not worth decoding.
        handler = self._HANDLERS.get(message_id(data))
        if handler is not None:
            handler(self, decode(data))

    def next_deadline_us(self) -> int:
        """The earliest of: heartbeat, a repeated request, the phase's time limit, the age of the pose."""
        if self.phase is Phase.DONE:
            return NEVER_US
        return min(
            self._heartbeat_us,
            self._exchange.next_deadline_us(),
            self._parameters.next_deadline_us(),
            self._phase_limit_us,
            self._refusal_us,
            self._lost_us(),
            self.pose.stale_deadline_us() if self._law_on else NEVER_US,
        )

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self._now_us = now_us
        if now_us >= self._heartbeat_us:
            self._heartbeat_us = now_us + HEARTBEAT_US
            self._send(heartbeat())
        if now_us >= self._lost_us():
            silent_s = self._params.link.heartbeat_timeout_s
            self._fire(Event.LOST, self._lost_error(f"the vehicle has been silent for {silent_s:g} s"))
            return
        if self._law_on and now_us >= self.pose.stale_deadline_us():
            self._trip(self.pose.stale(now_us))
        if self.link.vehicle is not None:
            self._repeat_requests(self.link.vehicle, now_us)
        if now_us >= self._refusal_us:
            self._conclude_refusal()
        if now_us >= self._phase_limit_us:
            self._fire(Event.TIMEOUT, self._timeout_error())

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready, one frame a datagram."""
        outbox, self._outbox = self._outbox, []
        return outbox

    # ------------------------------------------------------------------ operator and observers

    def stop(self, now_us: int) -> None:
        """The operator stops: hand back and land, from wherever the flight is."""
        self._now_us = now_us
        if self.done:
            return
        self.interrupted = True
        self._note("operator", "stop")
        self._fire(Event.STOP)

    def last_resort(self) -> list[bytes]:
        """What to send when this agent itself has failed in flight: hold, and no rotation meanwhile."""
        if not self.in_flight or self.link.vehicle is None:
            return []
        hold = commands.set_mode(px4.LOITER.name, px4.LOITER.main, px4.LOITER.sub).message(self.link.vehicle, 0)
        safe = px4.torque_setpoint(self._now_us, self._law.safe_controls(), *self.link.vehicle)
        return [self._encoder.encode(message) for message in (hold, safe)]

    @property
    def done(self) -> bool:
        """Whether the flight is over and nothing will be sent any more."""
        return self.phase is Phase.DONE

    @property
    def in_flight(self) -> bool:
        """Whether the vehicle may be in the air."""
        return self.phase in IN_FLIGHT

    def take_notes(self) -> list[Note]:
        """The story since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def take_trace(self) -> list[TraceRow]:
        """The rows since the last call."""
        trace, self._trace = self._trace, []
        return trace

    @property
    def hover_thrust_norm(self) -> float:
        """The hover thrust in use."""
        return self._hover.norm

    def status(self) -> Status:
        """A snapshot for a display."""
        row = self._last_row if self._law_on else None
        position = self.pose.position
        errors = [r - m for r, m in zip(row.reference, row.measured, strict=True)] if row else None
        mission_s, mission_duration_s = self._law.progress_s(position.stamp_us if position else 0)
        return Status(
            phase=self.phase,
            mode=self._mode.name if self._mode else "",
            armed=self._armed,
            vehicle=self._vehicle_words(),
            height_m=position.position_nwu_m[2] - self._ground_m if position else None,
            position_error_m=(errors[0] ** 2 + errors[2] ** 2 + errors[3] ** 2) ** 0.5 if errors else None,
            yaw_error_rad=errors[1] if errors else None,
            controls=row.controls if row else (),
            mission_s=mission_s,
            mission_duration_s=mission_duration_s,
            position_hz=self._monitors["LOCAL_POSITION_NED"].rate_hz(self._now_us),
            setpoints_sent=self.setpoints_sent,
        )

    def _vehicle_words(self) -> str:
        if self.link.vehicle is None:
            return ""
        system, component = self.link.vehicle
        return f"PX4 {'.'.join(map(str, self.version))} ({system}/{component})"

    # ------------------------------------------------------------------ sending

    def _send(self, message: Message) -> None:
        self._outbox.append(self._encoder.encode(message))

    def _request(self, command: Command) -> None:
        assert self.link.vehicle is not None
        self._send(self._exchange.request(command, self.link.vehicle, self._now_us))

    def _request_next(self) -> None:
        if self._queue:
            self._request(self._queue.pop(0))
        elif self.version == (0, 0, 0) and self._version_requests < VERSION_REQUESTS:
            # An ACK came for it, and the message itself was lost.
            self._request_version()
        else:
            self._exchange.cancel()
            self._check_identity()

    def _request_version(self) -> None:
        self._version_requests += 1
        self._request(commands.request_message("AUTOPILOT_VERSION", mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION))

    def _repeat_requests(self, target: tuple[int, int], now_us: int) -> None:
        for message in self._parameters.on_deadline(target, now_us):
            self._send(message)
        # Giving up on a name that the vehicle does not know is an end too.
        self._check_identity()
        repeated = self._exchange.on_deadline(target, now_us)
        if repeated is Reply.TIMEOUT:
            self._on_reply(Reply.TIMEOUT)
        elif repeated is not None:
            self._send(repeated)

    # ------------------------------------------------------------------ the machine

    def _fire(self, event: Event, error: MavquadError | None = None) -> None:
        phase = next_phase(self.phase, event)
        if phase is self.phase:
            return
        self.error = self.error or error
        if error is not None:
            self._note("error", error.message)
        self.phase = phase
        self._phase_us = self._now_us
        self._phase_limit_us = self._limit_us(phase)
        # A request of the phase before must not be repeated into this one, least of all a mode change.
        self._exchange.cancel()
        self._refusal, self._refusal_us = None, NEVER_US
        self._note("phase", phase.value)
        action = self._ENTER.get(phase)
        if action is not None:
            action(self)

    def _note(self, kind: str, text: str) -> None:
        self._notes.append(Note(self._now_us, kind, text))

    def _limit_us(self, phase: Phase) -> int:
        limit_s = self._params.flight.limit_s(phase)
        return self._now_us + grid_us(limit_s) if limit_s else NEVER_US

    def _lost_us(self) -> int:
        if self.link.vehicle is None:
            return NEVER_US
        return self.link.last_heard_us + self._silence_us

    def _lost_error(self, words: str) -> MavquadError:
        if self.in_flight:
            return FlightEnded(f"lost in flight: {words}", "check the link, and that the autopilot still runs")
        return VehicleTimeout("HEARTBEAT", 1, self._params.link.heartbeat_timeout_s)

    def _timeout_error(self) -> MavquadError:
        waited_s = (self._now_us - self._phase_us) * 1e-6
        words, hint = _WAITING_FOR.get(self.phase, (self.phase.value, ""))
        if self.phase is Phase.ENGAGING:
            mode = self._mode.name if self._mode else "unknown"
            result = f"acknowledged {self._exchange.result}" if self._exchange.result else "no ACK"
            return VehicleRefused("mode OFFBOARD", f"{result}, but HEARTBEAT stays in {mode}", self._said(), hint)
        if self.phase is Phase.WAITING:
            words = f"{words}: {self._not_ready()}"
        elif self.phase is Phase.IDENTIFYING and self._exchange.command is not None:
            words = f"{words}: {self._exchange.command.words}"
        return VehicleTimeout(words, self._exchange.tries, waited_s, self._said(), hint)

    def _enter_identifying(self) -> None:
        assert self.link.vehicle is not None
        for message in self._parameters.request(PARAMETERS, self.link.vehicle, self._now_us):
            self._send(message)
        self._queue = requests(self._params.streams)
        self._request_version()

    def _check_identity(self) -> None:
        if self.phase is not Phase.IDENTIFYING or self._queue or self._exchange.pending or not self._parameters.done:
            return
        if self.version == (0, 0, 0):
            return
        if not px4.takes_torque(self.version):
            version = ".".join(map(str, self.version))
            self._fire(
                Event.REFUSED,
                VehicleRefused(
                    "torque setpoints (SET_ACTUATOR_CONTROL_TARGET)",
                    f"PX4 {version} ignores them silently",
                    hint="PX4 takes torque over MAVLink up to release 1.13",
                ),
            )
            return
        self._hover.from_parameter = self._parameters.values.get("MPC_THR_HOVER", 0.0)
        self._fire(Event.IDENTIFIED)

    def _enter_arming(self) -> None:
        assert self.pose.position is not None
        self._ground_m = self.pose.position.position_nwu_m[2]
        self._request(commands.arm())

    def _enter_taking_off(self) -> None:
        self._request(commands.takeoff(commands.NAN))

    def _enter_engaging(self) -> None:
        self._law_on = True

    def _enter_flying(self) -> None:
        assert self.pose.position is not None
        self._law.in_control = True
        self._law.start_mission(self.pose.position.stamp_us)

    def _enter_handing_back(self) -> None:
        self._request(commands.set_mode(px4.LOITER.name, px4.LOITER.main, px4.LOITER.sub))

    def _enter_landing(self) -> None:
        self._law_on = False
        self._request(commands.land())

    def _enter_disarming(self) -> None:
        self._request(commands.disarm())

    def _enter_done(self) -> None:
        self._law_on = False

    _ENTER: ClassVar[dict[Phase, Callable[[Agent], None]]] = {
        Phase.IDENTIFYING: _enter_identifying,
        Phase.ARMING: _enter_arming,
        Phase.TAKING_OFF: _enter_taking_off,
        Phase.ENGAGING: _enter_engaging,
        Phase.FLYING: _enter_flying,
        Phase.HANDING_BACK: _enter_handing_back,
        Phase.LANDING: _enter_landing,
        Phase.DISARMING: _enter_disarming,
        Phase.DONE: _enter_done,
    }

    # ------------------------------------------------------------------ what the vehicle says

    def _on_heartbeat(self, message: Message) -> None:
        before = self._mode
        self._mode = px4.mode_from_custom(message.custom_mode)
        self._armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if self.phase is Phase.CONNECTING:
            self._on_found(message)
            return
        if self._mode != before and self._mode not in _OWN_MODES.get(self.phase, (self._mode,)):
            self._fire(Event.TAKEN_OVER, self._taken_over_error(self._mode))
            return
        if self._mode != before:
            self._note("mode", self._mode.name)
        self._on_armed() if self._armed else self._on_disarmed()

    def _on_found(self, message: Message) -> None:
        if message.autopilot == mavlink.MAV_AUTOPILOT_PX4:
            self._fire(Event.FOUND)
            return
        autopilot = mavlink.enums["MAV_AUTOPILOT"].get(message.autopilot)
        name = autopilot.name.removeprefix("MAV_AUTOPILOT_") if autopilot else str(message.autopilot)
        hint = "torque setpoints (SET_ACTUATOR_CONTROL_TARGET) are taken by PX4 up to 1.13 alone"
        self._fire(Event.REFUSED, VehicleRefused("flight at torque depth", f"the autopilot is {name}", hint=hint))

    def _taken_over_error(self, mode: px4.Mode) -> FlightEnded:
        return FlightEnded(
            f"the pilot or a failsafe took over: mode {mode.name} while {self.phase.value}" + self._says(),
            "the vehicle is in its own or its pilot's hands; nothing was sent to it after that",
        )

    def _on_armed(self) -> None:
        if self.phase is Phase.ARMING:
            self._fire(Event.ARMED)
        elif self.phase is Phase.ENGAGING and self._mode == px4.OFFBOARD:
            self._fire(Event.ENGAGED)
        elif self.phase is Phase.HANDING_BACK and self._mode != px4.OFFBOARD and not self._exchange.pending:
            self._fire(Event.RELEASED)

    def _on_disarmed(self) -> None:
        if self.phase is Phase.DISARMING and self._exchange.pending:
            return  # this heartbeat may be from before an arming that we did not hear of
        ended = None
        if self.phase in IN_FLIGHT and self.phase is not Phase.LANDING:
            ended = FlightEnded(f"the vehicle disarmed while {self.phase.value}" + self._says(), "look at its own log")
        self._fire(Event.DISARMED, ended)

    def _said(self) -> str:
        """The vehicle's last texts, those that can have to do with what happens now."""
        since_us = min(self._phase_us, self._now_us - TEXT_MATTERS_US)
        return "; ".join(text for stamp_us, text in self._texts if stamp_us >= since_us)

    def _says(self) -> str:
        said = self._said()
        return f'; the vehicle says: "{said}"' if said else ""

    def _on_ack(self, message: Message) -> None:
        own = (0, self._params.link.system_id)
        reply = self._exchange.on_ack(message) if message.target_system in own else None
        if reply is not None:
            self._on_reply(reply)

    def _on_reply(self, reply: Reply) -> None:
        """An answer to the command of the phase, or its absence."""
        command = self._exchange.command
        assert command is not None
        if self.phase is Phase.IDENTIFYING:
            # A stream that the vehicle does not have is no reason to stay on the ground: arrivals decide.
            self._request_next()
        elif reply is Reply.TIMEOUT:
            waited_s = (self._now_us - self._exchange.requested_us) * 1e-6
            error = VehicleTimeout(command.words, self._exchange.tries, waited_s, self._said())
            self._fire(Event.TIMEOUT, error)
        elif reply is Reply.REFUSED:
            self._on_refusal(command)
        elif self.phase is Phase.ENGAGING and command.words.endswith(px4.OFFBOARD.name):
            # Most likely our setpoints act from here on; HEARTBEAT says so up to a second later.
            self._law.in_control = True

    def _on_refusal(self, command: Command) -> None:
        """PX4 sends the text that says why right behind the ACK: wait for it, unless there is a vehicle to bring down."""
        if self._refusal is None:
            self._refusal = command, self._exchange.result
            waits = self.phase in (Phase.ARMING, Phase.TAKING_OFF, Phase.ENGAGING)
            self._refusal_us = self._now_us + (REASON_US if waits else 0)
        if self._now_us >= self._refusal_us:
            self._conclude_refusal()

    def _conclude_refusal(self) -> None:
        assert self._refusal is not None
        command, result = self._refusal
        self._refusal, self._refusal_us = None, NEVER_US
        hint = _REFUSED_HINTS.get(command.command_id, "")
        self._fire(Event.REFUSED, VehicleRefused(command.words, result, self._said(), hint))

    def _on_param(self, message: Message) -> None:
        self._parameters.on_value(message)
        self._check_identity()

    def _on_version(self, message: Message) -> None:
        version = message.flight_sw_version
        self.version = (version >> 24 & 0xFF, version >> 16 & 0xFF, version >> 8 & 0xFF)
        self._check_identity()

    def _on_sys_status(self, message: Message) -> None:
        self._prearm_ok = bool(message.onboard_control_sensors_health & PREARM_OK)

    def _on_extended_state(self, message: Message) -> None:
        """On the ground and still armed well after touch-down: the autopilot does not disarm by itself."""
        if message.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND or self.phase is not Phase.LANDING:
            self._on_ground_us = NEVER_US
        elif self._on_ground_us == NEVER_US:
            self._on_ground_us = self._now_us
        elif self._now_us - self._on_ground_us > DISARM_PATIENCE_US:
            self._fire(Event.LANDED)

    def _on_statustext(self, message: Message) -> None:
        # PX4 1.13 ends its texts with a tab.
        text = message.text.strip()
        self._texts.append((self._now_us, text))
        self._note("vehicle", text)

    def _on_timesync(self, message: Message) -> None:
        if message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(self._now_us * 1000, message.ts1))

    def _on_attitude_target(self, message: Message) -> None:
        if self.phase is Phase.TAKING_OFF and self._settled_us != NEVER_US and self.pose.attitude is not None:
            self._hover.learn(message.thrust, self.pose.attitude)

    # ------------------------------------------------------------------ the pose

    def _on_attitude(self, message: Message) -> None:
        self._monitors["ATTITUDE"].on_message(self._now_us)
        attitude = self.pose.take_attitude(message, self._now_us)
        if isinstance(attitude, Tripped):
            self._trip(attitude)
        elif isinstance(attitude, Attitude):
            self._law.take_attitude(attitude)

    def _on_position(self, message: Message) -> None:
        self._monitors["LOCAL_POSITION_NED"].on_message(self._now_us)
        position = self.pose.take_position(message, self._now_us)
        if isinstance(position, Tripped):
            self._trip(position)
        elif isinstance(position, Position):
            self._on_fresh_position(position)

    def _on_fresh_position(self, position: Position) -> None:
        if self.phase is Phase.WAITING and not self._not_ready():
            self._fire(Event.READY)
        elif self.phase is Phase.TAKING_OFF:
            self._watch_takeoff(position)
        elif self.phase is Phase.FLYING and self._law.mission_over(position.stamp_us):
            self._fire(Event.MISSION_OVER)
        if self._law_on:
            self._step_law(position)

    def _not_ready(self) -> str:
        """Why the vehicle cannot be armed yet; empty when it can."""
        if not self._prearm_ok:
            return "the autopilot's own pre-arm checks have not passed"
        if self.pose.attitude is None or self.pose.position is None:
            return "no pose"
        return "; ".join(shortfalls(self._params.streams, self._monitors, self._now_us))

    def _watch_takeoff(self, position: Position) -> None:
        """The takeoff is over when the autopilot holds its position and has done so for a while."""
        speed_m_s = sum(v * v for v in position.velocity_nwu_m_s) ** 0.5
        # HEARTBEAT may still show the hold mode of before the takeoff, on the ground.
        lifted = position.position_nwu_m[2] - self._ground_m > max(self._params.guards.floor_m, LIFTED_M)
        fresh = self.pose.stale(self._now_us) is None
        if self._mode != px4.LOITER or speed_m_s > HOVER_SPEED_M_S or not lifted or not fresh:
            self._settled_us = NEVER_US
            self._hover.restart()
        elif self._settled_us == NEVER_US:
            self._settled_us = self._now_us
        elif self._now_us - self._settled_us >= self._params.flight.settle_s * 1e6:
            self._fire(Event.AIRBORNE)

    def _step_law(self, position: Position) -> None:
        attitude = self.pose.attitude
        assert attitude is not None
        tripped = (
            check(self._params.guards, attitude, position, self._law.origin_nwu_m, self._ground_m)
            if self._law.in_control
            else None
        )
        if tripped is not None:
            self._trip(tripped)
            return
        row = self._law.step(position, attitude, self._now_us, self.phase.value)
        self._send_setpoint(row.controls)
        self.setpoints_sent += 1
        self._last_row = row
        self._trace.append(row)
        if self.phase is Phase.ENGAGING and self.setpoints_sent == SETPOINTS_BEFORE_OFFBOARD:
            self._request(commands.set_mode(px4.OFFBOARD.name, px4.OFFBOARD.main, px4.OFFBOARD.sub))

    def _send_setpoint(self, controls: tuple[float, float, float, float]) -> None:
        assert self.link.vehicle is not None
        self._send(px4.torque_setpoint(self._now_us, controls, *self.link.vehicle))

    def _trip(self, tripped: Tripped | None) -> None:
        """A guard ends our control: the mode change goes first, then one safe setpoint while it takes effect.

        Silence alone is not safe: PX4 holds the last torque for COM_OF_LOSS_T.
        """
        if tripped is None or not self._law_on:
            return
        self._law_on = False
        self._note("guard", tripped.words)
        error = FlightEnded(
            f"guard '{tripped.name}': {tripped.words}", "the vehicle was handed back to the autopilot and landed"
        )
        self._fire(Event.GUARD, error)
        self._send_setpoint(self._law.safe_controls())
        self.safe_setpoints += 1

    _HANDLERS: ClassVar[dict[int, Callable[[Agent, Message], None]]] = {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: _on_heartbeat,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: _on_attitude,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _on_position,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: _on_attitude_target,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK: _on_ack,
        mavlink.MAVLINK_MSG_ID_PARAM_VALUE: _on_param,
        mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: _on_version,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS: _on_sys_status,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: _on_extended_state,
        mavlink.MAVLINK_MSG_ID_STATUSTEXT: _on_statustext,
        mavlink.MAVLINK_MSG_ID_TIMESYNC: _on_timesync,
    }


_WAITING_FOR = {
    Phase.CONNECTING: ("HEARTBEAT of an autopilot", "is the vehicle on, and is this its address and port?"),
    Phase.IDENTIFYING: ("the vehicle's version and parameters", "is the link two-way?"),
    Phase.WAITING: ("ready to arm", "the vehicle's own texts say what it waits for"),
    Phase.ARMING: ("the armed bit in HEARTBEAT", "the command was acknowledged, but the vehicle did not arm"),
    Phase.TAKING_OFF: ("hover at the takeoff altitude", "the vehicle was told to land"),
    Phase.ENGAGING: ("mode OFFBOARD", "the vehicle was told to land; see its own texts"),
    Phase.HANDING_BACK: ("mode AUTO.LOITER", "the vehicle was told to land"),
    Phase.LANDING: ("touch-down and disarm", "watch the vehicle: it may still be in the air"),
    Phase.DISARMING: ("disarm", "the motors may still run"),
}

_REFUSED_HINTS = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "resolve what the vehicle says, then fly again",
    mavlink.MAV_CMD_NAV_TAKEOFF: "the vehicle was disarmed again",
    mavlink.MAV_CMD_DO_SET_MODE: "PX4 without a transmitter needs COM_RCL_EXCEPT = 4; the vehicle was told to land",
}
