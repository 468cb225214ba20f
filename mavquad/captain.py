"""The captain: takes the flight from phase to phase by the table of `mavquad.flight.machine`.

It hears the vehicle's messages and the passing of time, asks the vehicle for things until they happen, lets the law fly
while it may, and ends its control when a guard trips. The pilot always wins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from mavquad.agent_params import SETPOINTS_BEFORE_OFFBOARD, AgentParams
from mavquad.analysis.margin_check import check_margins
from mavquad.control.params import LawParams
from mavquad.endpoint import NEVER_US, grid_us
from mavquad.errors import MavquadError
from mavquad.flight import reasons
from mavquad.flight.airframe import HoverThrust
from mavquad.flight.control import Control
from mavquad.flight.guard_set import GuardSet
from mavquad.flight.guards import Tripped
from mavquad.flight.law_choice import LawChoice
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.machine import IN_FLIGHT, Event, Phase, next_phase
from mavquad.flight.mode_watch import ModeWatch
from mavquad.flight.operator import Operator
from mavquad.flight.phases.bridge import Address
from mavquad.flight.phases.going_down import GoingDown
from mavquad.flight.phases.going_up import GoingUp
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.phases.limits import Limits
from mavquad.flight.phases.preparing import Preparing
from mavquad.flight.phases.probing import Probing
from mavquad.flight.phases.refusals import Refusals
from mavquad.flight.phases.waiting import Waiting
from mavquad.flight.preparation import Preparation
from mavquad.flight.snapshot import status_of
from mavquad.flight.story import Story
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.torque_probe import TorqueProbe
from mavquad.flight.vehicle import Vehicle
from mavquad.flight_record import Status, TraceRow
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.command import Command, CommandExchange, Reply
from mavquad.protocol.firmware import PX4, Mode
from mavquad.protocol.timesync import TimeSync
from mavquad.types import Depth, Position

_PROBE = frozenset((Phase.PROBING, Phase.WITHDRAWING))
_DISARMED = frozenset((Phase.IDENTIFYING, Phase.PREPARING, Phase.WAITING))
_ON_GROUND = _DISARMED | _PROBE | {Phase.CONNECTING}
_BEFORE_THE_LAW = _DISARMED | _PROBE | {Phase.TAKING_OFF}


class Captain:
    """One mission on one vehicle.

    Attributes:
        phase: where the flight is.
        story: what happened, and why the flight did not complete.
        operator: what was ordered.
    """

    def __init__(self, params: AgentParams, start_us: int, send: Callable[[Message], None], sync: TimeSync) -> None:
        self._params = params
        self.now_us = start_us
        self._send = send
        self.target: Address = (0, 0)
        self._exchange = CommandExchange()
        self.refusal_us = NEVER_US
        self.phase_us = self.now_us
        self.limit_us = self._limit_us(Phase.CONNECTING)
        self.ground_m = 0.0
        self.story = Story()
        self.note("phase", Phase.CONNECTING.value)
        self._vehicle = Vehicle()
        self._preparation = Preparation()
        self._probe = TorqueProbe(PX4.offboard)
        self._hover = HoverThrust(params.airframe)
        self._sync = sync
        self._takeoff = TakeoffWatch(self._hover, params.flight.settle_s, params.guards.floor_m)
        law = LawFlight(params.law, params.airframe, params.mission, params.streams, self._hover)
        self._control = Control(params.guards, law, sync)
        self.operator = Operator(self, self._control, params.mission, params.guards)
        self.operator.holds = params.flight.at_end == "hold"
        self.operator.may_take_off = not params.flight.waits_for_takeoff
        self.operator.takeoff_m = params.flight.takeoff_m
        self._modes = ModeWatch(self, self._vehicle, self._takeoff, self._probe)
        self._going_down = GoingDown(self, self._vehicle, self._control, self._exchange, self._modes)
        self._law_choice = self._choice()
        self._delay, self._velocity_check = self._law_choice.delay, self._law_choice.velocity_check
        self._identifying = Identifying(
            self, self._vehicle, self.operator, self._law_choice, self._takeoff, params.streams, params.parameters
        )
        self._keeper = self._identifying.keeper
        self._preparing = Preparing(
            self, self._vehicle, self.operator, self._identifying, self._preparation, params.parameters
        )
        self._waiting = Waiting(
            self, self._vehicle, self._control, self._exchange, params.streams, params.guards.stale_attitude_s
        )
        self._probing = Probing(self, self._vehicle, self._control, self._exchange, self._identifying, self._probe)
        self._limits = Limits(
            self,
            self._vehicle,
            self._exchange,
            self._identifying,
            self._preparation,
            self._waiting,
            self._takeoff,
        )
        self._refusals = Refusals(self, self._control, self._exchange, self._modes)
        self._going_up = GoingUp(self, self._vehicle, self._control, self._law_choice, self._takeoff, params.streams)
        self.phase = Phase.CONNECTING
        self._phase_name = self.phase.value
        self._enter = self._actions()
        self._handlers = self._listeners()

    def _choice(self) -> LawChoice:
        params = self._params

        def admit(law: LawParams, depth: Depth) -> None:
            if not params.flight.force:
                check_margins(law, params.streams, depth, "configuration")

        return LawChoice(self, self._control, self._vehicle, params.law, params.streams.position_hz, admit)

    # ------------------------------------------------------------------ messages and time

    def hears(self, number: int) -> bool:
        """Whether messages of this id are read here at all."""
        return number in self._handlers

    def take(self, message: Message, sender: Address, now_us: int) -> None:
        """Take in a message of the vehicle."""
        self.now_us = now_us
        self.target = sender
        self._keeper.on_message(message.get_msgId())
        self._handlers[message.get_msgId()](message)

    def next_deadline_us(self) -> int:
        """The earliest of: a repeated request, the phase's time limit, the age of the pose, a safe setpoint."""
        return min(
            self._exchange.next_deadline_us(),
            self._identifying.exchange.next_deadline_us() if self.phase is Phase.IDENTIFYING else NEVER_US,
            self._preparation.next_deadline_us(),
            self._probe.next_deadline_us(),
            self.limit_us,
            self.refusal_us,
            self._control.next_deadline_us(),
        )

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self.now_us = now_us
        self._trip(self._control.silence(now_us))
        self._repeat_requests()
        self._refusals.act_when_due()
        if now_us >= self.limit_us:
            self.fire(Event.TIMEOUT, self._limits.error())
        self.stay_safe()

    def measured_round_trip(self, round_trip_us: int) -> None:
        """The vehicle answered a TIMESYNC of ours."""
        self._vehicle.round_trips_us.append(round_trip_us)
        self._trip(self._control.guards.on_round_trip(round_trip_us))

    def heard_frame(self, sequence: int, now_us: int) -> None:
        """A frame of the vehicle, whatever it holds."""
        self.now_us = now_us
        self._trip(self._control.guards.on_frame(sequence, now_us))

    def heard_ground_station(self, now_us: int) -> None:
        """A HEARTBEAT of a ground station that is not ours."""
        self._control.guards.gcs.heard(now_us)

    def late(self, now_us: int, lateness_us: float) -> None:
        """The driver tells that a setpoint left late."""
        self.now_us = now_us
        self._trip(self._control.guards.on_late(round(lateness_us), now_us))

    def lose(self, now_us: int) -> None:
        """The vehicle is silent."""
        self.now_us = now_us
        self.fire(Event.LOST, reasons.lost(self.phase, self._params.link.heartbeat_timeout_s))

    # ------------------------------------------------------------------ operator and observers

    def stop(self, now_us: int) -> None:
        """The operator stops: hand back and land, from wherever the flight is."""
        self.now_us = now_us
        self.operator.stop()

    def takeoff(self, now_us: int, height_m: float = 0.0) -> None:
        """The operator orders the takeoff; to this height, or, at 0, to the configured one."""
        self.now_us = now_us
        self.operator.take_off(height_m)
        self._identifying.check()

    def goto(self, now_us: int, north_m: float, east_m: float, down_m: float, heading_deg: float | None = None) -> None:
        """The operator orders another place, from where the law took over; it stays there until the next order."""
        self.now_us = now_us
        self.operator.goto((north_m, east_m, down_m), heading_deg)

    def fly(self, now_us: int, mission_json: str) -> None:
        """The operator orders another mission, from where the reference is; it stays at its end until the next order."""
        self.now_us = now_us
        self.operator.fly(mission_json)

    def land(self, now_us: int) -> None:
        """The operator orders the landing."""
        self.now_us = now_us
        self.operator.land()

    @property
    def law(self) -> LawFlight:
        """The law in flight."""
        return self._control.law

    @property
    def preparation(self) -> Preparation:
        """The vehicle's parameters, before the flight and after it."""
        return self._preparation

    def kept(self, now_us: int) -> None:
        """What the parameters were is kept where it survives us: they may be changed."""
        self.now_us = now_us
        self._preparing.kept()

    def last_resort(self) -> list[Message]:
        """What to send when our own code has failed in flight."""
        return self._going_down.last_resort()

    def take_trace(self) -> list[TraceRow]:
        """The rows since the last call."""
        return self._control.take_trace()

    def status(self) -> Status:
        """A snapshot for a display."""
        return status_of(self, self._vehicle, self._identifying.version, self._control, self._hover)

    # ------------------------------------------------------------------ sending

    def send_all(self, messages: Iterable[Message]) -> None:
        """Send these, once."""
        for message in messages:
            self._send(message)

    def request(self, command: Command) -> None:
        """Send a command, again and again until it is answered or the phase is over."""
        self._send(self._exchange.request(command, self.target, self.now_us))

    def _repeat_requests(self) -> None:
        if self.phase is Phase.IDENTIFYING:
            self._identifying.on_deadline()
        self._preparing.on_deadline()
        self.send_all(self._probe.on_deadline(self.target, self.now_us))
        self._refusals.repeat()

    # ------------------------------------------------------------------ the machine

    def fire(self, event: Event, error: MavquadError | None = None) -> None:
        """Something happened: on to the phase that the table names, if any; then the error, if any, is why."""
        phase = next_phase(self.phase, event)
        if phase is self.phase:
            return
        if error is not None:
            self.blame(error)
        self.phase, self._phase_name = phase, phase.value
        self.phase_us = self.now_us
        self.limit_us = self._limit_us(phase)
        # A request of the phase before must not be repeated into this one, least of all a mode change.
        self._exchange.cancel()
        self.refusal_us = NEVER_US
        self._modes.seen_own = False
        self._control.pose.may_restart = phase in _ON_GROUND
        self.note("phase", phase.value)
        action = self._enter.get(phase)
        if action is not None:
            action()

    @property
    def is_ending(self) -> bool:
        """Whether something went wrong, or the operator stopped it."""
        return self.story.error is not None or self.operator.interrupted

    def blame(self, error: MavquadError) -> None:
        """Something went wrong."""
        self.story.blame(self.now_us, error)

    def note(self, kind: str, text: str) -> None:
        """A line of the story."""
        self.story.note(self.now_us, kind, text)

    def said(self) -> str:
        """The vehicle's own texts that may explain what happens now."""
        return self._vehicle.said(self.phase_us, self.now_us)

    def _limit_us(self, phase: Phase) -> int:
        limit_s = self._params.flight.limit_s(phase)
        return self.now_us + grid_us(limit_s) if limit_s else NEVER_US

    def _enter_restoring(self) -> None:
        self._control.stop()
        self._probe.stop()
        self._preparing.restore()

    def _enter_done(self) -> None:
        self._control.stop()
        self._probe.stop()
        self._preparing.end()

    def _actions(self) -> dict[Phase, Callable[[], None]]:
        """What is done on entering a phase."""
        return {
            Phase.IDENTIFYING: self._identifying.begin,
            Phase.PREPARING: self._preparing.prepare,
            Phase.PROBING: self._probing.begin,
            Phase.WITHDRAWING: self._probing.withdraw,
            Phase.ARMING: self._going_up.arm,
            Phase.TAKING_OFF: self._going_up.take_off,
            Phase.ENGAGING: self._going_up.engage,
            Phase.FLYING: self._going_up.fly,
            Phase.HANDING_BACK: self._going_down.hand_back,
            Phase.LANDING: self._going_down.land,
            Phase.DISARMING: self._going_down.disarm,
            Phase.RESTORING: self._enter_restoring,
            Phase.DONE: self._enter_done,
        }

    # ------------------------------------------------------------------ what the vehicle says

    def _on_heartbeat(self, message: Message) -> None:
        if self.phase is Phase.CONNECTING:
            self._identifying.on_found(message)
            return
        was_armed = self._vehicle.armed
        changed = self._vehicle.take_heartbeat(message)
        if changed is not None and self._modes.is_taken_over(changed):
            self.fire(Event.TAKEN_OVER, reasons.taken_over(changed, self.phase, self.said()))
            return
        if changed is not None:
            self.note("mode", changed.name)
            if self._vehicle.mode != self._vehicle.firmware.offboard and self.phase is Phase.LANDING:
                self._control.stop()
        if self.phase is Phase.RESTORING and self._vehicle.armed and not was_armed:
            self.fire(Event.TAKEN_OVER, reasons.armed_again(self._vehicle.mode_name))
            return
        if self.phase in _BEFORE_THE_LAW:
            self._identifying.keep_streams()
        self._on_armed(changed) if self._vehicle.armed else self._on_disarmed(changed)

    def height_m(self) -> float:
        """Above the arming point; 0 without a position."""
        position = self._control.pose.position
        return position.position_nwu_m[2] - self.ground_m if position else 0.0

    def _on_armed(self, changed: Mode | None) -> None:
        """HEARTBEAT shows it armed; where it does not show what was asked for and acknowledged, that is asked again."""
        offboard = self._vehicle.mode == self._vehicle.firmware.offboard
        if self.phase is Phase.ARMING:
            self.fire(Event.ARMED)
        elif self.phase is Phase.ENGAGING and offboard and self._control.sent:
            self.fire(Event.ENGAGED)
        elif self.phase in _PROBE:
            self.fire(Event.TAKEN_OVER, reasons.armed_meanwhile(self._vehicle.mode_name, self.phase))
        elif self.phase in _DISARMED:
            self.fire(Event.REFUSED, reasons.armed_already(self._vehicle.mode_name))
        else:
            self._going_down.on_armed(changed)

    def _on_disarmed(self, changed: Mode | None) -> None:
        if self.phase is Phase.WAITING:
            self._waiting.on_heartbeat()
        elif self.phase in _PROBE:
            self._probing.on_heartbeat(changed)
        if self.phase is Phase.DISARMING and self._exchange.pending:
            return  # this heartbeat may be from before an arming that we did not hear of
        expected = self.phase not in IN_FLIGHT or (self.phase is Phase.LANDING and self._going_down.is_down_well())
        self.fire(Event.DISARMED, None if expected else reasons.disarmed(self.phase, self.said()))

    def _on_ack(self, message: Message) -> None:
        if message.target_system not in (0, self._params.link.system_id):
            return
        if self.phase is Phase.IDENTIFYING:
            self._identifying.on_ack(message)
            return
        if self.phase is Phase.PROBING:
            self._probing.on_ack(message)
            return
        reply = self._exchange.on_ack(message)
        if reply is Reply.REFUSED:
            self._refusals.on_refusal()
        elif reply is Reply.ACCEPTED and self.phase is Phase.ENGAGING:
            self._going_up.on_offboard_accepted()

    def _on_param(self, message: Message) -> None:
        if self.phase is Phase.IDENTIFYING:
            self._identifying.on_param(message)
        else:
            self._preparing.on_param(message)

    def _on_sys_status(self, message: Message) -> None:
        self._vehicle.take_sys_status(message)
        self._identifying.check()
        self._on_guarded(message)

    def _on_guarded(self, message: Message) -> None:
        self._trip(self._control.guards.on_message(message, self.now_us))

    def _on_statustext(self, message: Message) -> None:
        self.note("vehicle", self._vehicle.take_text(message, self.now_us))

    # ------------------------------------------------------------------ the pose

    def _on_attitude(self, message: Message) -> None:
        self._vehicle.streams["ATTITUDE"].on_message(self.now_us)
        attitude = self._control.take_attitude(message, self.now_us)
        if isinstance(attitude, Tripped):
            self._trip(attitude)
        elif attitude is not None:
            if self.phase is Phase.TAKING_OFF:
                self._delay.take(self._sync.age_us(attitude.stamp_us, self.now_us))
            self._trip(self._control.guards.on_attitude(attitude, self.now_us))
            words = self._control.law.take_words()
            if words:
                self.note("law", words)
            # Where positions step the law and are late, it flies on its prediction.
            self._fly(self._control.law.steps_on_attitude or self._control.pose.authority(self.now_us) < 1.0)

    def _on_position(self, message: Message) -> None:
        self._vehicle.streams["LOCAL_POSITION_NED"].on_message(self.now_us)
        position = self._control.take_position(message, self.now_us)
        if isinstance(position, Tripped):
            self._trip(position)
        elif position is not None:
            self._on_fresh_position(position)

    def _on_fresh_position(self, position: Position) -> None:
        self._trip(self._control.guards.on_position(position, self.now_us))
        law = self._control.law
        if self.phase is Phase.WAITING and not self._waiting.not_ready():
            self._probing.on_ready()
        elif self.phase is Phase.TAKING_OFF:
            self._velocity_check.take(position)
            holds = self._vehicle.mode == self._vehicle.firmware.hover and self._control.pose.stale(self.now_us) is None
            if self._takeoff.is_over(position, self.ground_m, holds, self.now_us):
                self._going_up.on_airborne(self._params.mission, self._params.guards)
        elif self.phase is Phase.FLYING and law.mission_over(position.stamp_us) and not self.operator.holds:
            self.fire(Event.MISSION_OVER)
        law.take_position(position)
        self._fly(not law.steps_on_attitude)

    def _fly(self, steps: bool) -> None:
        """Whatever was just measured may trip a guard; one of the two streams steps the law."""
        if not self._control.on:
            return
        self._trip(self._control.checked(self.ground_m))
        setpoint = self._control.step(self.target, self._phase_name, self.now_us) if steps else None
        if isinstance(setpoint, Tripped):
            self._trip(setpoint)
        if setpoint is None or isinstance(setpoint, Tripped):
            return
        self._send(setpoint)
        asks = self.phase is Phase.ENGAGING and self._control.sent == SETPOINTS_BEFORE_OFFBOARD
        if asks and not self._vehicle.firmware.acts_at_once:
            self.request(commands.set_mode(self._vehicle.firmware.offboard))

    def _trip(self, tripped: Tripped | None) -> None:
        """A guard ends our control: the mode change goes first, then safe setpoints until HEARTBEAT shows it.

        Silence alone is not safe: the firmwares hold the last command.
        """
        if tripped is None or not self._control.on:
            return
        self._control.make_safe(self.now_us)
        self._modes.reaction = tripped.reaction
        error = reasons.guard(tripped)
        if self.phase is Phase.HANDING_BACK:
            self.blame(error)
        self.fire(Event.GUARD, error)
        self.stay_safe()

    def stay_safe(self) -> None:
        """Send the safe setpoint, when it is due."""
        safe = self._control.safe_due(self.target, self.now_us)
        if safe is not None:
            self._send(safe)

    def _listeners(self) -> dict[int, Callable[[Message], None]]:
        """Who hears a message."""
        guarded = GuardSet.MESSAGES.keys() - {mavlink.MAVLINK_MSG_ID_SYS_STATUS}
        return {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._on_heartbeat,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: self._on_attitude,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._on_position,
            mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: self._going_up.on_attitude_target,
            mavlink.MAVLINK_MSG_ID_COMMAND_ACK: self._on_ack,
            mavlink.MAVLINK_MSG_ID_PARAM_VALUE: self._on_param,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._identifying.on_version,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: self._on_sys_status,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._going_down.on_extended_state,
            mavlink.MAVLINK_MSG_ID_STATUSTEXT: self._on_statustext,
            **dict.fromkeys(guarded, self._on_guarded),
        }
