"""Everything that the agent core can be told; sections live beside the code that they configure."""

from __future__ import annotations

from pydantic import Field

from mavquad.control.params import LawParams
from mavquad.flight.airframe import AirframeParams
from mavquad.flight.guards import GuardParams
from mavquad.flight.machine import Phase
from mavquad.flight.mission import MissionParams
from mavquad.protocol.link import LinkParams
from mavquad.protocol.streams import StreamParams
from mavquad.schema import Section


class FlightParams(Section):
    """Time limits of the phases, in seconds."""

    connect_s: float = Field(default=10.0, gt=0.0, le=600.0)
    """To hear an autopilot."""
    identify_s: float = Field(default=15.0, gt=0.0, le=600.0)
    """To get its version, parameters and streams."""
    ready_s: float = Field(default=90.0, gt=0.0, le=600.0)
    """Until it can be armed; estimators need their time."""
    arm_s: float = Field(default=5.0, gt=0.0, le=60.0)
    """To arm."""
    takeoff_s: float = Field(default=40.0, gt=0.0, le=600.0)
    """To hover at the autopilot's own takeoff altitude."""
    settle_s: float = Field(default=2.0, ge=0.5, le=60.0)
    """How long that hover must be steady; the hover thrust is learned in this time."""
    engage_s: float = Field(default=5.0, gt=1.5, le=60.0)
    """To enter the offboard mode, setpoints beforehand included; HEARTBEAT alone may take a second to show it."""
    hand_back_s: float = Field(default=5.0, gt=1.5, le=60.0)
    """To leave it."""
    land_s: float = Field(default=120.0, gt=0.0, le=600.0)
    """To land and disarm; a real PX4 may bounce between "landing detected" and "takeoff detected" for half a minute."""
    disarm_s: float = Field(default=5.0, gt=0.0, le=60.0)
    """To disarm on the ground."""

    def limit_s(self, phase: Phase) -> float:
        """The time limit of a phase; 0 where there is none."""
        return {
            Phase.CONNECTING: self.connect_s,
            Phase.IDENTIFYING: self.identify_s,
            Phase.WAITING: self.ready_s,
            Phase.ARMING: self.arm_s,
            Phase.TAKING_OFF: self.takeoff_s,
            Phase.ENGAGING: self.engage_s,
            Phase.HANDING_BACK: self.hand_back_s,
            Phase.LANDING: self.land_s,
            Phase.DISARMING: self.disarm_s,
        }.get(phase, 0.0)


class AgentParams(Section):
    """The agent's part of a configuration."""

    link: LinkParams = LinkParams()
    streams: StreamParams = StreamParams()
    flight: FlightParams = FlightParams()
    airframe: AirframeParams = AirframeParams()
    guards: GuardParams = GuardParams()
    law: LawParams = LawParams()
    mission: MissionParams = MissionParams()
