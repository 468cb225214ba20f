"""The captain: takes the flight from phase to phase by the table of `mavquad.flight.machine`.

It hears the vehicle's messages and the passing of time, asks the vehicle for things until they happen, lets the law fly
while it may, and ends its control when a guard trips. The pilot always wins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ClassVar

from mavquad.agent_params import SETPOINTS_BEFORE_OFFBOARD, AgentParams
from mavquad.analysis.margin_check import check_margins
from mavquad.endpoint import NEVER_US, grid_us
from mavquad.errors import ConfigError, MavquadError
from mavquad.flight import reasons
from mavquad.flight.airframe import HoverThrust, within_hover
from mavquad.flight.guards import Tripped, check
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.machine import IN_FLIGHT, Event, Phase, next_phase
from mavquad.flight.mission_check import height_fault
from mavquad.flight.pose import PoseIntake
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.vehicle import Vehicle
from mavquad.flight_record import Note, Status, TraceRow
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.command import Command, CommandExchange, Reply
from mavquad.protocol.firmware import px4
from mavquad.protocol.identify import UNKNOWN_VERSION, Identification
from mavquad.protocol.streams import shortfalls
from mavquad.types import Attitude, Position, Vec4

DISARM_PATIENCE_US = 5_000_000
REASON_US = 250_000

# Modes that are ours to expect in each phase; a change to any other one is the pilot's or a failsafe's.
_OWN_MODES: dict[Phase, tuple[px4.Mode, ...]] = {
    Phase.ARMING: (),
    Phase.TAKING_OFF: (px4.TAKEOFF, px4.LOITER),
    Phase.ENGAGING: (px4.TAKEOFF, px4.LOITER, px4.OFFBOARD),
    Phase.FLYING: (px4.OFFBOARD,),
    Phase.HANDING_BACK: (px4.OFFBOARD, px4.LOITER, px4.LAND),
    # Landing may begin right behind the takeoff command, before HEARTBEAT shows what that did.
    Phase.LANDING: (px4.TAKEOFF, px4.OFFBOARD, px4.LOITER, px4.LAND),
}
# What a phase asks for; once HEARTBEAT has shown it, leaving it is no longer a matter of course.
_ASKED_FOR = {Phase.TAKING_OFF: px4.TAKEOFF, Phase.LANDING: px4.LAND}
_ON_GROUND = frozenset((Phase.CONNECTING, Phase.IDENTIFYING, Phase.WAITING))

Address = tuple[int, int]
"""(system id, component id)."""


class Captain:
    """One mission on one vehicle.

    Attributes:
        phase: where the flight is.
        error: why the flight did not complete; None while it may still.
        interrupted: whether the operator stopped it.
    """

    def __init__(self, params: AgentParams, start_us: int, send: Callable[[Message], None]) -> None:
        self._params = params
        self._now_us = start_us
        self._send = send
        self._target: Address = (0, 0)
        self._exchange = CommandExchange()
        self._refusal_us = NEVER_US
        self._refusal_result = ""
        self._identification = Identification(params.streams)
        self._phase_us = self._now_us
        self._phase_limit_us = self._limit_us(Phase.CONNECTING)
        self._ground_m = 0.0
        self._seen_own_mode = False
        self._law_on = False
        self._notes = [Note(start_us, "phase", Phase.CONNECTING.value)]
        self._trace: list[TraceRow] = []
        self._last_row: TraceRow | None = None
        self._vehicle = Vehicle()
        self._hover = HoverThrust(params.airframe)
        self._takeoff = TakeoffWatch(self._hover, params.flight.settle_s, params.guards.floor_m)
        self._law = LawFlight(params.law, params.airframe, params.mission, params.streams, self._hover)
        self._pose = PoseIntake(params.guards)
        self.phase = Phase.CONNECTING
        self._phase_name = self.phase.value
        self.error: MavquadError | None = None
        self.interrupted = False
        self._setpoints_sent = 0
        self._safe_setpoints = 0

    # ------------------------------------------------------------------ messages and time

    def hears(self, number: int) -> bool:
        """Whether messages of this id are read here at all."""
        return number in self._HANDLERS

    def take(self, message: Message, sender: Address, now_us: int) -> None:
        """Take in a message of the vehicle."""
        self._now_us = now_us
        self._target = sender
        self._HANDLERS[message.get_msgId()](self, message)

    def next_deadline_us(self) -> int:
        """The earliest of: a repeated request, the phase's time limit, the age of the pose."""
        return min(
            self._exchange.next_deadline_us(),
            self._identification.next_deadline_us() if self.phase is Phase.IDENTIFYING else NEVER_US,
            self._phase_limit_us,
            self._refusal_us,
            self._pose.stale_deadline_us() if self._law_on else NEVER_US,
        )

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self._now_us = now_us
        if self._law_on and now_us >= self._pose.stale_deadline_us():
            self._trip(self._pose.stale(now_us))
        self._repeat_requests()
        if now_us >= self._refusal_us:
            self._fire(Event.REFUSED, reasons.refused(self._exchange, self._refusal_result, self._said()))
        if now_us >= self._phase_limit_us:
            self._fire(Event.TIMEOUT, self._limit_error())

    def measured_round_trip(self, round_trip_us: int) -> None:
        """The vehicle answered a TIMESYNC of ours."""
        self._vehicle.round_trip_us = round_trip_us

    def lose(self, now_us: int) -> None:
        """The vehicle is silent."""
        self._now_us = now_us
        self._fire(Event.LOST, reasons.lost(self.phase, self._params.link.heartbeat_timeout_s))

    # ------------------------------------------------------------------ operator and observers

    def stop(self, now_us: int) -> None:
        """The operator stops: hand back and land, from wherever the flight is."""
        self._now_us = now_us
        if self.phase is Phase.DONE:
            return
        self.interrupted = True
        self._note("operator", "stop")
        self._fire(Event.STOP)

    def last_resort(self) -> list[Message]:
        """What to send when our own code has failed in flight: hold, and no rotation meanwhile."""
        if self.phase not in (Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK):
            return []  # the autopilot flies it, by itself
        hold = commands.set_mode(px4.LOITER)
        return [hold.message(self._target, 0), self._setpoint(self._law.safe_controls(self._pose.attitude))]

    def take_notes(self) -> list[Note]:
        """The story since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def take_trace(self) -> list[TraceRow]:
        """The rows since the last call."""
        trace, self._trace = self._trace, []
        return trace

    def status(self) -> Status:
        """A snapshot for a display."""
        position = self._pose.position
        mission_s, mission_duration_s = self._law.progress_s(position.stamp_us if position else 0)
        return Status(
            phase=self.phase.value,
            mode=self._vehicle.mode_name,
            armed=self._vehicle.armed,
            vehicle=self._vehicle_words(),
            version=self._identification.version,
            height_m=position.position_nwu_m[2] - self._ground_m if position else None,
            row=self._last_row if self._law_on else None,
            mission_s=mission_s,
            mission_duration_s=mission_duration_s,
            depth="" if self._identification.version == UNKNOWN_VERSION else self._law.depth,
            position_hz=self._vehicle.streams["LOCAL_POSITION_NED"].rate_hz(self._now_us),
            hover_thrust_norm=self._hover.norm,
            setpoints_sent=self._setpoints_sent,
            safe_setpoints=self._safe_setpoints,
            old_poses=self._pose.old,
        )

    def _vehicle_words(self) -> str:
        if self._identification.version == UNKNOWN_VERSION:
            return ""
        return f"PX4 {'.'.join(map(str, self._identification.version))} ({self._target[0]}/{self._target[1]})"

    # ------------------------------------------------------------------ sending

    def _send_all(self, messages: Iterable[Message]) -> None:
        for message in messages:
            self._send(message)

    def _request(self, command: Command) -> None:
        self._send(self._exchange.request(command, self._target, self._now_us))

    def _repeat_requests(self) -> None:
        if self.phase is Phase.IDENTIFYING:
            self._send_all(self._identification.on_deadline(self._target, self._now_us))
            self._check_identity()
        repeated = self._exchange.on_deadline(self._target, self._now_us)
        if repeated is Reply.TIMEOUT and self.phase is not Phase.LANDING:
            self._fire(Event.TIMEOUT, reasons.unanswered(self._exchange, self._said(), self._now_us))
        elif repeated is not None and repeated is not Reply.TIMEOUT:
            self._send(repeated)

    def _setpoint(self, controls: Vec4) -> Message:
        return px4.setpoint(self._now_us, self._law.depth, controls, *self._target)

    # ------------------------------------------------------------------ the machine

    def _fire(self, event: Event, error: MavquadError | None = None) -> None:
        phase = next_phase(self.phase, event)
        if phase is self.phase:
            return
        self._blame(error)
        self.phase, self._phase_name = phase, phase.value
        self._phase_us = self._now_us
        self._phase_limit_us = self._limit_us(phase)
        # A request of the phase before must not be repeated into this one, least of all a mode change.
        self._exchange.cancel()
        self._refusal_us = NEVER_US
        self._seen_own_mode = False
        self._pose.may_restart = phase in _ON_GROUND
        self._note("phase", phase.value)
        action = self._ENTER.get(phase)
        if action is not None:
            action(self)

    def _blame(self, error: MavquadError | None) -> None:
        """The first error is why the flight did not complete; what goes wrong after it is told too."""
        if error is None:
            return
        self._note("error", error.message)
        if self.error is None:
            self.error = error
        else:
            self.error.followed_by(error)

    def _note(self, kind: str, text: str) -> None:
        self._notes.append(Note(self._now_us, kind, text))

    def _said(self) -> str:
        return self._vehicle.said(self._phase_us, self._now_us)

    def _limit_us(self, phase: Phase) -> int:
        limit_s = self._params.flight.limit_s(phase)
        return self._now_us + grid_us(limit_s) if limit_s else NEVER_US

    def _limit_error(self) -> MavquadError:
        if self.phase is Phase.ENGAGING:
            except_mask = self._identification.parameters.get("COM_RCL_EXCEPT")
            return reasons.not_engaged(self._exchange, self._vehicle.mode_name, except_mask, self._said())
        details = ""
        if self.phase is Phase.WAITING:
            details = self._not_ready()
        elif self.phase is Phase.IDENTIFYING:
            details = self._identification.waiting_for
        elif self.phase is Phase.TAKING_OFF and self._takeoff.lacks_thrust:
            details = "its hover thrust is not known (ATTITUDE_TARGET; or set airframe.hover_thrust_norm)"
        waited_s = (self._now_us - self._phase_us) * 1e-6
        return reasons.too_long(self.phase, details, self._exchange.tries, waited_s, self._said())

    def _enter_identifying(self) -> None:
        self._send_all(self._identification.start(self._target, self._now_us))

    def _check_identity(self) -> None:
        if self.phase is not Phase.IDENTIFYING or not self._identification.done:
            return
        version, asked = self._identification.version, self._params.law.depth
        self._law.choose(px4.default_depth(version) if asked == "auto" else asked)
        if not px4.takes(version, self._law.depth):
            words = ".".join(map(str, version))
            self._fire(Event.REFUSED, reasons.no_torque(f"PX4 {words} ignores torque setpoints silently"))
            return
        if not self._params.flight.force:
            try:
                check_margins(self._params.law, self._params.streams, self._law.depth, "configuration")
            except ConfigError as error:
                self._fire(Event.REFUSED, error)
                return
        self._note("law", f"depth {self._law.depth}, measurements {self._params.law.measured()}")
        told = self._identification.parameters
        self._takeoff.altitude_m = told.get("MIS_TAKEOFF_ALT", 0.0)
        self._hover.parameter_norm = within_hover(told.get("MPC_THR_HOVER", 0.0))
        self._fire(Event.IDENTIFIED)

    def _enter_arming(self) -> None:
        assert self._pose.position is not None
        self._ground_m = self._pose.position.position_nwu_m[2]
        self._request(commands.arm())

    def _enter_taking_off(self) -> None:
        self._request(commands.takeoff(commands.NAN))

    def _enter_engaging(self) -> None:
        self._law_on = True

    def _enter_flying(self) -> None:
        assert self._pose.position is not None
        self._law.in_control = True
        self._law.start_mission(self._pose.position.stamp_us)

    def _enter_handing_back(self) -> None:
        self._request(commands.set_mode(px4.LOITER))

    def _enter_landing(self) -> None:
        self._law_on = False
        self._request(commands.land())

    def _enter_disarming(self) -> None:
        self._request(commands.disarm())

    def _enter_done(self) -> None:
        self._law_on = False

    _ENTER: ClassVar[dict[Phase, Callable[[Captain], None]]] = {
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
        changed = self._vehicle.take_heartbeat(message)
        if self.phase is Phase.CONNECTING:
            self._on_found(message.autopilot)
        elif self._is_taken_over(changed):
            assert changed is not None
            self._fire(Event.TAKEN_OVER, reasons.taken_over(changed, self.phase, self._said()))
        else:
            if changed is not None:
                self._note("mode", changed.name)
            self._on_armed() if self._vehicle.armed else self._on_disarmed()

    def _is_taken_over(self, changed: px4.Mode | None) -> bool:
        """Whether a change of mode is the pilot's or a failsafe's: to one that is not ours to expect, or not now."""
        if changed is None:
            return False
        if self.phase is Phase.LANDING and not self._vehicle.armed:
            return False  # down: PX4 1.16 shows AUTO.LOITER with the HEARTBEAT that shows it disarmed
        if self.phase is Phase.TAKING_OFF and changed == px4.LOITER and self._seen_own_mode:
            height_m = self._pose.position.position_nwu_m[2] - self._ground_m if self._pose.position else 0.0
            return not self._takeoff.is_high(height_m)
        if self.phase is Phase.LANDING and self._seen_own_mode:
            return True
        self._seen_own_mode |= changed == _ASKED_FOR.get(self.phase)
        return changed not in _OWN_MODES.get(self.phase, (changed,))

    def _on_found(self, autopilot: int) -> None:
        if autopilot != mavlink.MAV_AUTOPILOT_PX4:
            self._fire(Event.REFUSED, reasons.not_px4(autopilot))
        elif self._vehicle.armed:
            self._fire(Event.REFUSED, reasons.armed_already(self._vehicle.mode_name))
        else:
            self._fire(Event.FOUND)

    def _on_armed(self) -> None:
        """HEARTBEAT shows it armed; where it does not show what was asked for and acknowledged, that is asked again."""
        offboard = self._vehicle.mode == px4.OFFBOARD
        if self.phase is Phase.ARMING:
            self._fire(Event.ARMED)
        elif self.phase is Phase.ENGAGING and offboard and self._setpoints_sent:
            self._fire(Event.ENGAGED)
        elif self.phase in (Phase.IDENTIFYING, Phase.WAITING):
            self._fire(Event.REFUSED, reasons.armed_already(self._vehicle.mode_name))
        elif self._exchange.pending:
            return
        elif self.phase is Phase.HANDING_BACK:
            self._enter_handing_back() if offboard else self._fire(Event.RELEASED)
        elif self.phase is Phase.LANDING and self._vehicle.mode != px4.LAND:
            self._enter_landing()

    def _on_disarmed(self) -> None:
        if self.phase is Phase.DISARMING and self._exchange.pending:
            return  # this heartbeat may be from before an arming that we did not hear of
        expected = self.phase not in IN_FLIGHT or self.phase is Phase.LANDING
        self._fire(Event.DISARMED, None if expected else reasons.disarmed(self.phase, self._said()))

    def _on_ack(self, message: Message) -> None:
        if message.target_system not in (0, self._params.link.system_id):
            return
        if self.phase is Phase.IDENTIFYING:
            self._send_all(self._identification.on_ack(message, self._target, self._now_us))
            self._check_identity()
            return
        reply = self._exchange.on_ack(message)
        if reply is Reply.REFUSED:
            self._on_refusal()
        elif reply is Reply.ACCEPTED and self.phase is Phase.ENGAGING:
            # Most likely our setpoints act from here on; HEARTBEAT says so up to a second later.
            self._law.in_control = True

    def _on_refusal(self) -> None:
        """PX4 sends the text that says why right behind the ACK: wait for it, unless there is a vehicle to bring down."""
        if self.phase is Phase.LANDING:
            self._blame(reasons.refused(self._exchange, self._exchange.result, self._said()))
            return
        if self._refusal_us == NEVER_US:
            waits = self.phase in (Phase.ARMING, Phase.TAKING_OFF, Phase.ENGAGING)
            self._refusal_result = self._exchange.result
            self._refusal_us = self._now_us + (REASON_US if waits else 0)
        if self._now_us >= self._refusal_us:
            self._fire(Event.REFUSED, reasons.refused(self._exchange, self._refusal_result, self._said()))

    def _on_param(self, message: Message) -> None:
        self._identification.on_param(message)
        self._check_identity()

    def _on_version(self, message: Message) -> None:
        self._identification.on_version(message)
        self._check_identity()

    def _on_sys_status(self, message: Message) -> None:
        self._vehicle.take_sys_status(message)

    def _on_extended_state(self, message: Message) -> None:
        """On the ground and still armed well after touch-down: the autopilot does not disarm by itself."""
        self._vehicle.take_extended_state(message, self._now_us)
        since_us = max(self._vehicle.on_ground_since_us, self._phase_us)
        if self.phase is Phase.LANDING and self._now_us - since_us > DISARM_PATIENCE_US:
            self._fire(Event.LANDED)

    def _on_statustext(self, message: Message) -> None:
        self._note("vehicle", self._vehicle.take_text(message, self._now_us))

    def _on_attitude_target(self, message: Message) -> None:
        if self.phase is Phase.TAKING_OFF:
            self._takeoff.learn(message.thrust, self._pose.attitude)

    # ------------------------------------------------------------------ the pose

    def _on_attitude(self, message: Message) -> None:
        self._vehicle.streams["ATTITUDE"].on_message(self._now_us)
        attitude = self._pose.take_attitude(message, self._now_us)
        if isinstance(attitude, Tripped):
            self._trip(attitude)
        elif isinstance(attitude, Attitude):
            self._law.take_attitude(attitude)
            self._fly(self._law.steps_on_attitude)

    def _on_position(self, message: Message) -> None:
        self._vehicle.streams["LOCAL_POSITION_NED"].on_message(self._now_us)
        position = self._pose.take_position(message, self._now_us)
        if isinstance(position, Tripped):
            self._trip(position)
        elif isinstance(position, Position):
            self._on_fresh_position(position)

    def _on_fresh_position(self, position: Position) -> None:
        if self.phase is Phase.WAITING and not self._not_ready():
            self._fire(Event.READY)
        elif self.phase is Phase.TAKING_OFF:
            holds = self._vehicle.mode == px4.LOITER and self._pose.stale(self._now_us) is None
            if self._takeoff.is_over(position, self._ground_m, holds, self._now_us):
                self._on_airborne(position.position_nwu_m[2] - self._ground_m)
        elif self.phase is Phase.FLYING and self._law.mission_over(position.stamp_us):
            self._fire(Event.MISSION_OVER)
        self._law.take_position(position)
        self._fly(not self._law.steps_on_attitude)

    def _on_airborne(self, height_m: float) -> None:
        """How far the mission leads up and down counts from here."""
        fault = height_fault(self._params.mission, self._params.guards, height_m)
        if fault is None:
            self._fire(Event.AIRBORNE)
        else:
            self._fire(Event.TIMEOUT, reasons.too_high_or_low(fault))

    def _not_ready(self) -> str:
        """Why the vehicle cannot be armed yet; empty when it can."""
        if not self._vehicle.prearm_ok:
            return f"the autopilot's own pre-arm checks have not passed (mode {self._vehicle.mode_name})"
        if not self._vehicle.on_ground:
            return "EXTENDED_SYS_STATE does not show it on the ground"
        round_trip_us = self._vehicle.round_trip_us
        if round_trip_us is not None and round_trip_us * 1e-6 > self._params.guards.stale_pose_s:
            return f"a round trip over the link takes {round_trip_us * 1e-6:.2f} s: too slow to fly on"
        if self._pose.attitude is None or self._pose.position is None:
            return "no pose"
        return "; ".join(shortfalls(self._params.streams, self._vehicle.streams, self._now_us))

    def _fly(self, steps: bool) -> None:
        """Whatever was just measured may trip a guard; one of the two streams steps the law."""
        attitude, position = self._pose.attitude, self._pose.position
        if not self._law_on or attitude is None or position is None:
            return
        if self._law.in_control:
            self._trip(check(self._params.guards, attitude, position, self._law.origin_nwu_m, self._ground_m))
        if self._law_on and steps:
            self._step_law(position, attitude)

    def _step_law(self, position: Position, attitude: Attitude) -> None:
        row = self._law.step(position, attitude, self._now_us, self._phase_name)
        self._send(self._setpoint(row.controls))
        self._setpoints_sent += 1
        self._last_row = row
        self._trace.append(row)
        if self.phase is Phase.ENGAGING and self._setpoints_sent == SETPOINTS_BEFORE_OFFBOARD:
            self._request(commands.set_mode(px4.OFFBOARD))

    def _trip(self, tripped: Tripped | None) -> None:
        """A guard ends our control: the mode change goes first, then one safe setpoint while it takes effect.

        Silence alone is not safe: PX4 holds the last torque for COM_OF_LOSS_T.
        """
        if tripped is None or not self._law_on:
            return
        self._law_on = False
        error = reasons.guard(tripped)
        if self.phase is Phase.HANDING_BACK:
            self._blame(error)
        self._fire(Event.GUARD, error)
        self._send(self._setpoint(self._law.safe_controls(self._pose.attitude)))
        self._safe_setpoints += 1

    _HANDLERS: ClassVar[dict[int, Callable[[Captain, Message], None]]] = {
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
    }
