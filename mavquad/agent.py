"""The agent core: link and captain as one `Endpoint`. No socket, no clock, no sleep, no log.

It is driven live, in lockstep or in replay; what it sends is a function of its inputs alone.
"""

from __future__ import annotations

from mavquad.agent_params import AgentParams
from mavquad.captain import Captain
from mavquad.endpoint import NEVER_US, floor_to_grid_us, grid_us
from mavquad.errors import MavquadError
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.machine import Phase
from mavquad.flight_record import Note, Status, TraceRow
from mavquad.protocol.codec import Message, decode, frame_sequence, frame_source, mavlink, message_id
from mavquad.protocol.link import Link, heartbeat
from mavquad.protocol.param_record import ChangedParameters
from mavquad.protocol.timesync import TimeSync

HEARTBEAT_US = 1_000_000


class Agent:
    """Flies one mission on one vehicle. See `mavquad.endpoint.Endpoint` for the calls.

    Attributes:
        link: who the vehicle is, and what was lost.
        sync: the vehicle's clock on ours.
    """

    def __init__(self, params: AgentParams, start_us: int, key: bytes | None = None) -> None:
        """`key`: of MAVLink 2 signing; it is no part of the parameters, which are kept in the run folder."""
        start_us = floor_to_grid_us(start_us)
        self._outbox: list[bytes] = []
        self._ourselves = (params.link.system_id, params.link.component_id)
        self._silence_us = grid_us(params.link.heartbeat_timeout_s)
        self._heartbeat_us = start_us if params.link.speaks_first else NEVER_US
        self._now_us = start_us
        self.sync = TimeSync()
        self._captain = Captain(params, start_us, self._send, self.sync)
        self.link = Link(params.link, key)

    # ------------------------------------------------------------------ Endpoint

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one frame. Frames of others than the vehicle are counted and ignored."""
        self._now_us = now_us
        if self._heartbeat_us == NEVER_US and not self.done:
            self._send_heartbeat()
        is_known = self.link.vehicle is not None
        number = message_id(data)
        if not self.link.accept(data, now_us) or self.done:
            if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self._notice_ground_station(data, now_us)
            return
        if not is_known:
            self.sync.start(now_us)
        self._captain.heard_frame(frame_sequence(data), now_us)
        # A message that nobody here reads is not worth decoding.
        if number == mavlink.MAVLINK_MSG_ID_TIMESYNC:
            self._on_timesync(decode(data), now_us)
        elif self._captain.hears(number):
            assert self.link.vehicle is not None
            self._captain.take(decode(data), self.link.vehicle, now_us)

    def next_deadline_us(self) -> int:
        """The earliest of: our heartbeat, the vehicle's silence, and what the captain waits for."""
        if self.done:
            return NEVER_US
        return min(self._heartbeat_us, self._lost_us(), self.sync.next_deadline_us(), self._captain.next_deadline_us())

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self._now_us = now_us
        if now_us >= self._heartbeat_us:
            self._send_heartbeat()
        question = self.sync.on_deadline(now_us)
        if question is not None:
            self._send(question)
        if now_us >= self._lost_us():
            self._captain.lose(now_us)
        else:
            self._captain.on_deadline(now_us)

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready, one frame a datagram."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def _send(self, message: Message) -> None:
        self._outbox.append(self.link.encode(message, self._now_us))

    def _send_heartbeat(self) -> None:
        self._heartbeat_us = self._now_us + HEARTBEAT_US
        self._send(heartbeat())

    def _notice_ground_station(self, data: bytes, now_us: int) -> None:
        """On the vehicle's link, another than us: a pilot's."""
        if frame_source(data) != self._ourselves and decode(data).type == mavlink.MAV_TYPE_GCS:
            self._captain.heard_ground_station(now_us)

    def _on_timesync(self, message: Message, now_us: int) -> None:
        answer = self.sync.on_message(message, now_us)
        if answer is not None:
            self._send(answer)
        elif self.sync.round_trip_us is not None:
            self._captain.measured_round_trip(self.sync.round_trip_us)

    def _lost_us(self) -> int:
        return self.link.last_heard_us + self._silence_us if self.link.vehicle is not None else NEVER_US

    # ------------------------------------------------------------------ operator and observers

    def stop(self, now_us: int) -> None:
        """The operator stops: hand back and land, from wherever the flight is."""
        self._now_us = now_us
        self._captain.operator.stop(now_us)

    @property
    def changed_parameters(self) -> ChangedParameters | None:
        """What is about to be changed on the vehicle, or was, or was put back; None where nothing is."""
        return self._captain.preparation.changed

    @property
    def awaits_record(self) -> bool:
        """Whether `changed_parameters` must be kept where they survive us, and `kept` be called."""
        preparation = self._captain.preparation
        return preparation.changed is not None and not preparation.kept

    def takeoff(self, now_us: int, height_m: float = 0.0) -> None:
        """The operator orders the takeoff (flight.waits_for_takeoff); to the configured height where none is given."""
        self._now_us = now_us
        self._captain.takeoff(now_us, height_m)

    def goto(self, now_us: int, north_m: float, east_m: float, down_m: float, heading_deg: float | None = None) -> None:
        """The operator orders another place, from where the law took over; see `order_fault`."""
        self._now_us = now_us
        self._captain.operator.goto(now_us, (north_m, east_m, down_m), heading_deg)

    def fly(self, now_us: int, mission_json: str) -> None:
        """The operator orders another mission (`MissionParams` in JSON), from where the reference is; see `order_fault`."""
        self._now_us = now_us
        self._captain.operator.fly(now_us, mission_json)

    def land(self, now_us: int) -> None:
        """The operator orders the landing."""
        self._now_us = now_us
        self._captain.operator.land(now_us)

    @property
    def awaits_takeoff(self) -> bool:
        """Whether the vehicle is known and `takeoff` is waited for."""
        return self._captain.operator.is_awaited

    @property
    def order_fault(self) -> str:
        """Why the operator's last order is not flown; empty when it is."""
        return self._captain.operator.order_fault

    def late(self, now_us: int, lateness_us: float) -> None:
        """The driver saw a setpoint leave so late."""
        self._now_us = now_us
        self._captain.late(now_us, lateness_us)

    def kept(self, now_us: int) -> None:
        """`changed_parameters` are kept where they survive us: the vehicle's parameters may be changed."""
        self._now_us = now_us
        self._captain.kept(now_us)

    @property
    def law(self) -> LawFlight:
        """The law in flight, to be looked at."""
        return self._captain.control.law

    def last_resort(self) -> list[bytes]:
        """Frames to send when this agent itself has failed in flight: hold, and no rotation meanwhile."""
        return [self.link.encode(message, self._now_us) for message in self._captain.last_resort()]

    @property
    def phase(self) -> Phase:
        """Where the flight is."""
        return self._captain.phase

    @property
    def done(self) -> bool:
        """Whether the flight is over and nothing will be sent any more."""
        return self._captain.phase is Phase.DONE

    @property
    def error(self) -> MavquadError | None:
        """Why the flight did not complete; None while it may still."""
        return self._captain.story.error

    @property
    def interrupted(self) -> bool:
        """Whether the operator stopped it."""
        return self._captain.operator.interrupted

    def take_notes(self) -> list[Note]:
        """The story since the last call."""
        return self._captain.story.take_notes()

    def take_trace(self) -> list[TraceRow]:
        """The rows of the law since the last call."""
        return self._captain.control.take_trace()

    def status(self) -> Status:
        """A snapshot for a display and for the summary."""
        return self._captain.status()
