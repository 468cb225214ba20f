"""The captain: takes the flight from phase to phase by the table of `mavquad.flight.machine`.

It hears the vehicle's messages and the passing of time, asks the vehicle for things until they happen, lets the law fly
while it may, and ends its control when a guard trips. The pilot always wins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from mavquad.agent_params import SETPOINTS_BEFORE_OFFBOARD, AgentParams
from mavquad.crew import Crew
from mavquad.endpoint import NEVER_US, grid_us
from mavquad.errors import MavquadError
from mavquad.flight import reasons
from mavquad.flight.bridge import Address
from mavquad.flight.guard_set import GuardSet
from mavquad.flight.guards import Tripped
from mavquad.flight.machine import ON_GROUND, Event, Phase, next_phase
from mavquad.flight.snapshot import status_of
from mavquad.flight.story import Story
from mavquad.flight_record import Status
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.command import Command, Reply
from mavquad.protocol.timesync import TimeSync
from mavquad.types import Position


class Captain:
    """One mission on one vehicle. What the parts of the flight may ask of him is `mavquad.flight.bridge.Bridge`.

    Attributes:
        phase: where the flight is.
        story: what happened, and why the flight did not complete.
        operator: what was ordered, and may be.
        control: the law in force.
        preparation: the vehicle's parameters, before the flight and after it.
    """

    def __init__(self, params: AgentParams, start_us: int, send: Callable[[Message], None], sync: TimeSync) -> None:
        self._params, self._send, self._sync = params, send, sync
        self.now_us = start_us
        self.target: Address = (0, 0)
        self.refusal_us = NEVER_US
        self.phase = Phase.CONNECTING
        self._phase_name = self.phase.value
        self.phase_us = start_us
        self.limit_us = self._limit_us(self.phase)
        self.ground_m = 0.0
        self.story = Story()
        self.note("phase", self._phase_name)
        self._crew = crew = Crew(self, params, sync)
        self.control, self.operator, self.preparation = crew.control, crew.operator, crew.preparation
        # What each frame needs is at hand.
        self._vehicle, self._exchange, self._probe = crew.vehicle, crew.exchange, crew.probe
        self._takeoff, self._keeper = crew.takeoff, crew.identifying.keeper
        self._delay, self._velocity_check = crew.law_choice.delay, crew.law_choice.velocity_check
        self._enter = self._actions()
        self._handlers = self._listeners()

    # ------------------------------------------------------------------ messages and time

    def hears(self, number: int) -> bool:
        """Whether messages of this id are read here at all."""
        return number in self._handlers

    def take(self, message: Message, sender: Address, now_us: int) -> None:
        """Take in a message of the vehicle."""
        self.now_us = now_us
        self.target = sender
        self._keeper.on_message(message.get_msgId(), now_us)
        self._handlers[message.get_msgId()](message)

    def next_deadline_us(self) -> int:
        """The earliest of: a repeated request, the phase's time limit, the age of the pose, a safe setpoint."""
        return min(
            self._exchange.next_deadline_us(),
            self._crew.identifying.exchange.next_deadline_us() if self.phase is Phase.IDENTIFYING else NEVER_US,
            self.preparation.next_deadline_us(),
            self._probe.next_deadline_us(),
            self.limit_us,
            self.refusal_us,
            self.control.next_deadline_us(),
            self._keeper.gap_deadline_us() if self.control.on else NEVER_US,
        )

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self.now_us = now_us
        self._trip(self.control.silence(now_us))
        if self.control.on:
            self._crew.identifying.ask_after_gap()
        if self.phase is Phase.IDENTIFYING:
            self._crew.identifying.on_deadline()
        self._crew.preparing.on_deadline()
        self.send_all(self._probe.on_deadline(self.target, now_us))
        self._crew.refusals.on_deadline()
        if now_us >= self.limit_us:
            self.fire(Event.TIMEOUT, self._crew.limits.error())
        self.stay_safe()

    def measured_round_trip(self, round_trip_us: int) -> None:
        """The vehicle answered a TIMESYNC of ours."""
        self._vehicle.round_trips_us.append(round_trip_us)
        self._trip(self.control.guards.on_round_trip(round_trip_us))

    def heard_frame(self, sequence: int, now_us: int) -> None:
        """A frame of the vehicle, whatever it holds."""
        self.now_us = now_us
        self._trip(self.control.guards.on_frame(sequence, now_us))

    def heard_ground_station(self, now_us: int) -> None:
        """A HEARTBEAT of a ground station that is not ours."""
        self.control.guards.gcs.heard(now_us)

    def late(self, now_us: int, lateness_us: float) -> None:
        """The driver tells that a setpoint left late."""
        self.now_us = now_us
        self._trip(self.control.guards.on_late(round(lateness_us), now_us))

    def lose(self, now_us: int) -> None:
        """The vehicle is silent."""
        self.now_us = now_us
        self.fire(Event.LOST, reasons.lost(self.phase, self._params.link.heartbeat_timeout_s))

    # ------------------------------------------------------------------ operator and observers

    def takeoff(self, now_us: int, height_m: float = 0.0) -> None:
        """The operator orders the takeoff; to this height, or, at 0, to the configured one."""
        self.now_us = now_us
        self.operator.take_off(height_m)
        self._crew.identifying.check()

    def kept(self, now_us: int) -> None:
        """What the parameters were is kept where it survives us: they may be changed."""
        self.now_us = now_us
        self._crew.preparing.kept()

    def last_resort(self) -> list[Message]:
        """What to send when our own code has failed in flight."""
        return self._crew.going_down.last_resort()

    def status(self) -> Status:
        """A snapshot for a display."""
        return status_of(self, self._vehicle, self._crew.identifying.version, self.control, self._crew.hover)

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
        self._crew.modes.seen_own = False
        self.control.pose.may_restart = phase in ON_GROUND
        self.note("phase", phase.value)
        if phase in (Phase.RESTORING, Phase.DONE):
            self.control.stop()
            self._probe.stop()
        action = self._enter.get(phase)
        if action is not None:
            action()

    def _limit_us(self, phase: Phase) -> int:
        limit_s = self._params.flight.limit_s(phase)
        return self.now_us + grid_us(limit_s) if limit_s else NEVER_US

    def _actions(self) -> dict[Phase, Callable[[], None]]:
        """What is done on entering a phase."""
        return {
            Phase.IDENTIFYING: self._crew.identifying.begin,
            Phase.PREPARING: self._crew.preparing.prepare,
            Phase.PROBING: self._crew.probing.begin,
            Phase.WITHDRAWING: self._crew.probing.withdraw,
            Phase.ARMING: self._crew.going_up.arm,
            Phase.TAKING_OFF: self._crew.going_up.take_off,
            Phase.ENGAGING: self._crew.going_up.engage,
            Phase.FLYING: self._crew.going_up.fly,
            Phase.HANDING_BACK: self._crew.going_down.hand_back,
            Phase.LANDING: self._crew.going_down.land,
            Phase.DISARMING: self._crew.going_down.disarm,
            Phase.RESTORING: self._crew.preparing.restore,
            Phase.DONE: self._crew.preparing.end,
        }

    # ------------------------------------------------------------------ what the parts ask for (Bridge)

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

    def height_m(self) -> float:
        """Above the arming point; 0 without a position."""
        position = self.control.pose.position
        return position.position_nwu_m[2] - self.ground_m if position else 0.0

    def said(self) -> str:
        """The vehicle's own texts that may explain what happens now."""
        return self._vehicle.said(self.phase_us, self.now_us)

    def send_all(self, messages: Iterable[Message]) -> None:
        """Send these, once."""
        for message in messages:
            self._send(message)

    def request(self, command: Command) -> None:
        """Send a command, again and again until it is answered or the phase is over."""
        self._send(self._exchange.request(command, self.target, self.now_us))

    def stay_safe(self) -> None:
        """Send the safe setpoint, when it is due."""
        safe = self.control.safe_due(self.target, self.now_us)
        if safe is not None:
            self._send(safe)

    # ------------------------------------------------------------------ what the vehicle says

    def _listeners(self) -> dict[int, Callable[[Message], None]]:
        """Who hears a message."""
        guarded = GuardSet.MESSAGES.keys() - {mavlink.MAVLINK_MSG_ID_SYS_STATUS}
        return {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._crew.heartbeats.take,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: self._on_attitude,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._on_position,
            mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: self._crew.going_up.on_attitude_target,
            mavlink.MAVLINK_MSG_ID_COMMAND_ACK: self._on_ack,
            mavlink.MAVLINK_MSG_ID_PARAM_VALUE: self._on_param,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._crew.identifying.on_version,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: self._on_sys_status,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._crew.going_down.on_extended_state,
            mavlink.MAVLINK_MSG_ID_STATUSTEXT: self._on_statustext,
            **dict.fromkeys(guarded, self._on_guarded),
        }

    def _on_ack(self, message: Message) -> None:
        if message.target_system not in (0, self._params.link.system_id):
            return
        if self.phase is Phase.IDENTIFYING:
            self._crew.identifying.on_ack(message)
            return
        if self.phase is Phase.PROBING:
            self._crew.probing.on_ack(message)
            return
        reply = self._exchange.on_ack(message)
        if reply is Reply.REFUSED:
            self._crew.refusals.on_refusal()
        elif reply is Reply.ACCEPTED and self.phase is Phase.ENGAGING:
            self._crew.going_up.on_offboard_accepted()

    def _on_param(self, message: Message) -> None:
        if self.phase is Phase.IDENTIFYING:
            self._crew.identifying.on_param(message)
        else:
            self._crew.preparing.on_param(message)

    def _on_sys_status(self, message: Message) -> None:
        self._vehicle.take_sys_status(message)
        self._crew.identifying.check()
        self._on_guarded(message)

    def _on_guarded(self, message: Message) -> None:
        self._trip(self.control.guards.on_message(message, self.now_us))

    def _on_statustext(self, message: Message) -> None:
        self.note("vehicle", self._vehicle.take_text(message, self.now_us))

    # ------------------------------------------------------------------ the pose

    def _on_attitude(self, message: Message) -> None:
        self._vehicle.streams["ATTITUDE"].on_message(self.now_us)
        attitude = self.control.take_attitude(message, self.now_us)
        if isinstance(attitude, Tripped):
            self._trip(attitude)
        elif attitude is not None:
            if self.phase is Phase.TAKING_OFF:
                self._delay.take(self._sync.age_us(attitude.stamp_us, self.now_us))
            self._trip(self.control.guards.on_attitude(attitude, self.now_us))
            words = self.control.law.take_words()
            if words:
                self.note("law", words)
            # Where positions step the law and are late, it flies on its prediction.
            self._fly(self.control.law.steps_on_attitude or self.control.pose.authority(self.now_us) < 1.0)

    def _on_position(self, message: Message) -> None:
        self._vehicle.streams["LOCAL_POSITION_NED"].on_message(self.now_us)
        position = self.control.take_position(message, self.now_us)
        if isinstance(position, Tripped):
            self._trip(position)
        elif position is not None:
            self._on_fresh_position(position)

    def _on_fresh_position(self, position: Position) -> None:
        self._trip(self.control.guards.on_position(position, self.now_us))
        law = self.control.law
        if self.phase is Phase.WAITING and not self._crew.waiting.not_ready():
            self._crew.probing.on_ready()
        elif self.phase is Phase.TAKING_OFF:
            self._velocity_check.take(position)
            holds = self._vehicle.mode == self._vehicle.firmware.hover and self.control.pose.stale(self.now_us) is None
            if self._takeoff.is_over(position, self.ground_m, holds, self.now_us):
                self._crew.going_up.on_airborne(self._params.mission, self._params.guards)
        elif self.phase is Phase.FLYING and law.mission_over(position.stamp_us) and not self.operator.holds:
            self.fire(Event.MISSION_OVER)
        law.take_position(position)
        self._fly(not law.steps_on_attitude)

    def _fly(self, steps: bool) -> None:
        """Whatever was just measured may trip a guard; one of the two streams steps the law."""
        if not self.control.on:
            return
        self._trip(self.control.checked(self.ground_m))
        setpoint = self.control.step(self.target, self._phase_name, self.now_us) if steps else None
        if isinstance(setpoint, Tripped):
            self._trip(setpoint)
        if setpoint is None or isinstance(setpoint, Tripped):
            return
        self._send(setpoint)
        asks = self.phase is Phase.ENGAGING and self.control.sent == SETPOINTS_BEFORE_OFFBOARD
        if asks and not self._vehicle.firmware.acts_at_once:
            self.request(commands.set_mode(self._vehicle.firmware.offboard))

    def _trip(self, tripped: Tripped | None) -> None:
        """A guard ends our control: the mode change goes first, then safe setpoints until HEARTBEAT shows it.

        Silence alone is not safe: the firmwares hold the last command.
        """
        if tripped is None or not self.control.on:
            return
        self.control.make_safe(self.now_us)
        self._crew.modes.reaction = tripped.reaction
        error = reasons.guard(tripped)
        if self.phase is Phase.HANDING_BACK:
            self.blame(error)
        self.fire(Event.GUARD, error)
        self.stay_safe()
