"""The check as an `Endpoint`: it listens, asks, measures, and puts back what it asked for. No socket, no clock.

    LOOKING     until the HEARTBEAT of an autopilot comes
    ASKING      for its version, some parameters and the streams of a flight, on our own link
    MEASURING   what arrives, for the time that was given; TIMESYNC meanwhile, and its pre-arm checks are run
    RESTORING   the streams to their default rates

It arms nothing, sets no mode and no parameter, and runs no pre-arm checks where the vehicle is armed.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from mavquad.check.arrivals import Arrivals
from mavquad.check.asking import Asking, back_to_default, prearm_checks, questions
from mavquad.check.roster import Roster
from mavquad.check.words import Texts
from mavquad.endpoint import NEVER_US, floor_to_grid_us, grid_us
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from mavquad.protocol.firmware import firmware_of
from mavquad.protocol.link import Link, LinkParams, heartbeat
from mavquad.protocol.param_value import encoding_of
from mavquad.protocol.params import ParamReader
from mavquad.protocol.timesync import TimeSync

HEARTBEAT_US = 1_000_000
LOOKING_S = 10.0
ASKING_S = 8.0
RESTORING_S = 3.0
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


class Stage(Enum):
    """Where the check is."""

    LOOKING = "looking for an autopilot"
    ASKING = "asking"
    MEASURING = "measuring"
    RESTORING = "putting the streams back"
    DONE = "done"


class Checker:
    """Checks one vehicle. See `mavquad.endpoint.Endpoint` for the calls.

    Args:
        params: the connection, and who we are on it.
        start_us: now.
        duration_s: how long it is measured.
        rate_hz: asked of the pose's streams.
        key: of MAVLink 2 signing.

    Attributes:
        stage: where the check is.
        link: which vehicle, and what was refused.
        roster: everybody heard.
        sync: the vehicle's clock.
        arrivals: by message id, while it was measured.
        round_trips_us: of TIMESYNC.
        asking: what was asked, and what became of it.
        reader: the parameters.
        texts: what it said.
        latest: the last message of each kind, by its id.
        thrusts: ATTITUDE_TARGET.thrust in the air.
        measured_us: (from, to).
        measured_bytes: of the vehicle's frames in that time.
    """

    def __init__(
        self, params: LinkParams, start_us: int, duration_s: float, rate_hz: float, key: bytes | None = None
    ) -> None:
        start_us = floor_to_grid_us(start_us)
        self._duration_us = grid_us(duration_s)
        self._heartbeat_us = start_us if params.speaks_first else NEVER_US
        self._stage_ends_us = start_us + grid_us(LOOKING_S)
        self._now_us = start_us
        self._system_id = params.system_id
        self._outbox: list[bytes] = []
        self.rate_hz = rate_hz
        self.stage = Stage.LOOKING
        self.link = Link(params, key)
        self.roster = Roster()
        self.sync = TimeSync()
        self.arrivals: dict[int, Arrivals] = {}
        self.round_trips_us: list[int] = []
        self.asking = Asking()
        self.reader = ParamReader()
        self.texts = Texts()
        self.latest: dict[int, Message] = {}
        self.thrusts: list[float] = []
        self.measured_us = (start_us, start_us)
        self.measured_bytes = 0

    # ------------------------------------------------------------------ Endpoint

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one frame."""
        self._now_us = now_us
        if self.stage is Stage.DONE:
            return
        if self._heartbeat_us == NEVER_US:
            self._send_heartbeat()
        self.roster.take(data)
        if not self.link.accept(data, now_us):
            return
        message = decode(data)
        if self.stage is Stage.MEASURING:
            self.measured_bytes += len(data)
        elif self.stage is Stage.LOOKING:
            self._ask(message, frame_source(data))
        self._take(message_id(data), message)

    def next_deadline_us(self) -> int:
        """The earliest of: our heartbeat, a question, the end of the stage."""
        if self.stage is Stage.DONE:
            return NEVER_US
        return min(
            self._heartbeat_us,
            self._stage_ends_us,
            self.sync.next_deadline_us(),
            self.asking.next_deadline_us(),
            self.reader.next_deadline_us(),
        )

    def on_deadline(self, now_us: int) -> None:
        """Act on whatever is due."""
        self._now_us = now_us
        if now_us >= self._heartbeat_us:
            self._send_heartbeat()
        question = self.sync.on_deadline(now_us)
        if question is not None:
            self._send([question])
        if self.link.vehicle is not None:
            self._send(self.reader.on_deadline(self.link.vehicle, now_us))
            self._send(self.asking.on_deadline(self.link.vehicle, now_us))
        self._go_on()

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready, one frame a datagram."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def stop(self, now_us: int) -> None:
        """The operator stops: put back what was changed, and end."""
        self._now_us = now_us
        if self.stage in (Stage.ASKING, Stage.MEASURING):
            self._restore()
        else:
            self.stage = Stage.DONE

    # ------------------------------------------------------------------ stages

    def _go_on(self) -> None:
        """To the next stage, when this one is over."""
        is_late = self._now_us >= self._stage_ends_us
        if self.stage is Stage.ASKING and (is_late or (self.asking.done and self.reader.done)):
            self._measure()
        elif self.stage is Stage.MEASURING and is_late:
            self._restore()
        elif is_late or (self.stage is Stage.RESTORING and self.asking.done):
            self.stage = Stage.DONE

    def _ask(self, beat: Message, vehicle: tuple[int, int]) -> None:
        self._enter(Stage.ASKING, ASKING_S)
        self.sync.start(self._now_us)
        self.reader = ParamReader(encoding_of(beat.autopilot))
        firmware = firmware_of(beat.autopilot, beat.type)
        names = (firmware.hover_parameter, *firmware.parameters) if firmware is not None else ()
        self._send(self.reader.request(names, vehicle, self._now_us))
        self._send(self.asking.add(questions(self.rate_hz), vehicle, self._now_us))

    def _measure(self) -> None:
        assert self.link.vehicle is not None
        self._enter(Stage.MEASURING, self._duration_us * 1e-6)
        self.measured_us = (self._now_us, self._now_us + self._duration_us)
        if not self.is_armed:
            self._send(self.asking.add([prearm_checks()], self.link.vehicle, self._now_us))

    def _restore(self) -> None:
        assert self.link.vehicle is not None
        if self.stage is Stage.MEASURING:
            self.measured_us = (self.measured_us[0], self._now_us)
        self._enter(Stage.RESTORING, RESTORING_S)
        self.sync.stop()
        self.asking.forget()
        changed = [c for c in self.asking.asked if c.command_id == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL]
        self._send(self.asking.add(map(back_to_default, changed), self.link.vehicle, self._now_us))

    def _enter(self, stage: Stage, limit_s: float) -> None:
        self.stage = stage
        self._stage_ends_us = self._now_us + grid_us(limit_s)

    # ------------------------------------------------------------------ messages

    def _take(self, number: int, message: Message) -> None:
        vehicle, now_us = self.link.vehicle, self._now_us
        assert vehicle is not None
        self.latest[number] = message
        if self.stage is Stage.MEASURING:
            self._count(number, message)
        if number == mavlink.MAVLINK_MSG_ID_TIMESYNC:
            self._on_timesync(message)
        elif number == mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            if message.target_system in (0, self._system_id):
                self._send(self.asking.on_ack(message, vehicle, now_us))
                self._go_on()
        elif number == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
            self.reader.on_value(message)
            self._go_on()
        elif number == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            self.texts.take(message)
        elif number == mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET and self.is_flying:
            self.thrusts.append(message.thrust)

    def _count(self, number: int, message: Message) -> None:
        stamp_ms = getattr(message, "time_boot_ms", None)
        age_us = self.sync.age_us(stamp_ms * 1000, self._now_us) if stamp_ms is not None else None
        self.arrivals.setdefault(number, Arrivals()).add(self._now_us, age_us)

    def _on_timesync(self, message: Message) -> None:
        before = self.sync.strays
        answer = self.sync.on_message(message, self._now_us)
        if answer is not None:
            self._send([answer])
        elif self.sync.strays == before and self.sync.latest_round_trip_us is not None:
            self.round_trips_us.append(self.sync.latest_round_trip_us)

    @property
    def is_armed(self) -> bool:
        """As HEARTBEAT shows it."""
        beat = self.latest.get(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
        return beat is not None and bool(beat.base_mode & _ARMED)

    @property
    def is_flying(self) -> bool:
        """Armed and, by EXTENDED_SYS_STATE, in the air."""
        state = self.latest.get(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
        return self.is_armed and state is not None and state.landed_state == mavlink.MAV_LANDED_STATE_IN_AIR

    # ------------------------------------------------------------------ sending

    def _send(self, messages: Iterable[Message]) -> None:
        self._outbox += [self.link.encode(message, self._now_us) for message in messages]

    def _send_heartbeat(self) -> None:
        self._heartbeat_us = self._now_us + HEARTBEAT_US
        self._send([heartbeat()])
