"""Who does what in a flight: its parts, made for one mission and told of each other."""

from __future__ import annotations

from mavquad.agent_params import AgentParams
from mavquad.analysis.margin_check import check_margins
from mavquad.control.params import LawParams
from mavquad.flight.airframe import HoverThrust
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.law_choice import LawChoice
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.mode_watch import ModeWatch
from mavquad.flight.operator import Operator
from mavquad.flight.phases.going_down import GoingDown
from mavquad.flight.phases.going_up import GoingUp
from mavquad.flight.phases.heartbeats import Heartbeats
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.phases.limits import Limits
from mavquad.flight.phases.preparing import Preparing
from mavquad.flight.phases.probing import Probing
from mavquad.flight.phases.refusals import Refusals
from mavquad.flight.phases.waiting import Waiting
from mavquad.flight.preparation import Preparation
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.torque_probe import TorqueProbe
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.command import CommandExchange
from mavquad.protocol.firmware import PX4
from mavquad.protocol.timesync import TimeSync
from mavquad.types import Depth


class Crew:
    """The parts of one flight.

    Attributes:
        vehicle: what it says of itself.
        exchange: the command on its way.
        control: the law in force.
        hover: the thrust that carries the weight.
        takeoff: when it is over.
        probe: whether the vehicle takes torques.
        preparation: the vehicle's parameters.
        operator: what was ordered.
        modes: whose mode a mode is.
        law_choice: what `control` flies.
        identifying: connecting and identifying.
        preparing: preparing and restoring.
        waiting: until it is ready.
        probing: probing and withdrawing.
        going_up: from arming until the law flies.
        going_down: from the law's end until it is disarmed.
        heartbeats: to whom each matters.
        refusals: of commands.
        limits: of time.
    """

    def __init__(self, bridge: Bridge, params: AgentParams, sync: TimeSync) -> None:
        self.vehicle = Vehicle()
        self.exchange = CommandExchange()
        self.preparation = Preparation()
        self.probe = TorqueProbe(PX4.offboard)
        self.hover = HoverThrust(params.airframe)
        self.takeoff = TakeoffWatch(self.hover, params.flight.settle_s, params.guards.floor_m)
        law = LawFlight(params.law, params.airframe, params.mission, params.streams, self.hover)
        self.control = Control(params.guards, law, sync)
        self._choose(bridge, params)
        self._prepare(bridge, params)
        self._fly(bridge, params)

    def _choose(self, bridge: Bridge, params: AgentParams) -> None:
        """What is flown."""

        def admit(law: LawParams, depth: Depth) -> None:
            if not params.flight.force:
                check_margins(law, params.streams, depth, "configuration")

        self.operator = Operator(bridge, self.control, params.mission, params.guards)
        self.operator.holds = params.flight.at_end == "hold"
        self.operator.may_take_off = not params.flight.waits_for_takeoff
        self.operator.takeoff_m = params.flight.takeoff_m
        position_hz = params.streams.position_hz
        self.law_choice = LawChoice(bridge, self.control, self.vehicle, params.law, position_hz, admit)

    def _prepare(self, bridge: Bridge, params: AgentParams) -> None:
        """On the ground."""
        vehicle, control, exchange, operator = self.vehicle, self.control, self.exchange, self.operator
        streams, changes, round_trip_s = params.streams, params.parameters, params.guards.stale_attitude_s
        self.identifying = Identifying(bridge, vehicle, operator, self.law_choice, self.takeoff, streams, changes)
        self.preparing = Preparing(bridge, vehicle, operator, self.identifying, self.preparation, changes)
        self.waiting = Waiting(bridge, vehicle, control, exchange, streams, round_trip_s)
        self.probing = Probing(bridge, vehicle, control, exchange, self.identifying, self.probe)

    def _fly(self, bridge: Bridge, params: AgentParams) -> None:
        """In the air, and what may go wrong."""
        vehicle, control, exchange, takeoff = self.vehicle, self.control, self.exchange, self.takeoff
        self.modes = ModeWatch(bridge, vehicle, takeoff, self.probe)
        self.going_up = GoingUp(bridge, vehicle, control, self.law_choice, takeoff, params.streams)
        self.going_down = GoingDown(bridge, vehicle, control, exchange, self.modes)
        self.heartbeats = Heartbeats(
            bridge, vehicle, self.modes, self.identifying, self.waiting, self.probing, self.going_up, self.going_down
        )
        self.refusals = Refusals(bridge, control, exchange, self.modes)
        self.limits = Limits(bridge, vehicle, exchange, self.identifying, self.preparation, self.waiting, takeoff)
