"""CONNECTING, IDENTIFYING: who the vehicle is, and what is flown on it."""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.errors import MavquadError
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.law_choice import LawChoice
from mavquad.flight.machine import Event, Phase
from mavquad.flight.operator import Operator
from mavquad.flight.parameters import VehicleParameters
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.codec import Message
from mavquad.protocol.firmware import PX4, Version, firmware_of
from mavquad.protocol.identify import Identification
from mavquad.protocol.streams import StreamKeeper, StreamParams


class Identifying:
    """Asks until it is known, and the operator lets it take off.

    Attributes:
        exchange: the questions and their answers.
        keeper: of the streams; to be told of every message.
    """

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        operator: Operator,
        law_choice: LawChoice,
        takeoff: TakeoffWatch,
        streams: StreamParams,
        parameters: VehicleParameters,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._operator = operator
        self._law_choice = law_choice
        self._takeoff = takeoff
        self._streams = streams
        self._parameters = parameters
        self.exchange = Identification(streams, PX4)
        self.keeper = StreamKeeper(streams, PX4)

    @property
    def version(self) -> Version:
        """The autopilot's release, `UNKNOWN_VERSION` until it is known."""
        return self.exchange.version

    @property
    def told(self) -> dict[str, float]:
        """The values of the parameters that were asked for, by name; one that the vehicle does not know is missing."""
        return self.exchange.parameters

    @property
    def waits_for(self) -> str:
        """What is not yet known, in words."""
        return self.exchange.waiting_for or "SYS_STATUS"

    # ------------------------------------------------------------------ on the way

    def on_found(self, message: Message) -> None:
        """The first HEARTBEAT of an autopilot."""
        firmware = firmware_of(message.autopilot, message.type)
        if firmware is None:
            self._bridge.fire(Event.REFUSED, reasons.not_flown(message.autopilot, message.type))
            return
        self._vehicle.firmware = firmware
        self._vehicle.take_heartbeat(message)
        if self._vehicle.armed:
            self._bridge.fire(Event.REFUSED, reasons.armed_already(self._vehicle.mode_name))
        else:
            self._bridge.fire(Event.FOUND)

    def begin(self) -> None:
        """Ask for its version and parameters."""
        firmware = self._vehicle.firmware
        self.exchange = Identification(self._streams, firmware, self._parameters.changes(firmware))
        self.keeper.restart(firmware)
        self._bridge.send_all(self.exchange.start(self._bridge.target, self._bridge.now_us))

    def on_deadline(self) -> None:
        """Repeat what went without an answer."""
        self._bridge.send_all(self.exchange.on_deadline(self._bridge.target, self._bridge.now_us))
        self.check()

    def on_ack(self, message: Message) -> None:
        """A COMMAND_ACK: ask for the next thing."""
        self._bridge.send_all(self.exchange.on_ack(message, self._bridge.target, self._bridge.now_us))
        self.check()

    def on_param(self, message: Message) -> None:
        """A PARAM_VALUE."""
        self.exchange.on_param(message)
        self.check()

    def on_version(self, message: Message) -> None:
        """An AUTOPILOT_VERSION."""
        self.exchange.on_version(message)
        self.check()

    def keep_streams(self) -> None:
        """Streams that do not come are asked for again; to be called now and then, until the law takes over."""
        bridge = self._bridge
        if bridge.phase is not Phase.IDENTIFYING or self.exchange.done:
            bridge.send_all(command.message(bridge.target, 0) for command in self.keeper.again(bridge.now_us))

    def ask_after_gap(self) -> None:
        """A pose stream that is silent in flight is asked for at once: somebody may have set it to another rate."""
        bridge = self._bridge
        bridge.send_all(command.message(bridge.target, 0) for command in self.keeper.after_gap(bridge.now_us))

    # ------------------------------------------------------------------ known

    def check(self) -> None:
        """Whether all is known, and the operator lets it take off: then the law is chosen."""
        known = self.exchange.done and self._vehicle.reported
        if self._bridge.phase is not Phase.IDENTIFYING or not known:
            return
        if not self._operator.may_take_off:
            self._bridge.limit_us = NEVER_US  # the operator takes his time
            return
        try:
            self._law_choice.choose(self.version)
        except MavquadError as error:
            self._bridge.fire(Event.REFUSED, error)
            return
        self._takeoff.expect(self._vehicle.firmware, self.told, self._operator.takeoff_m)
        self._bridge.fire(Event.IDENTIFIED)
