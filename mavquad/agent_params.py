"""Everything that the agent core can be told; sections live beside the code that they configure."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from mavquad.control.params import LawParams
from mavquad.flight.airframe import AirframeParams
from mavquad.flight.guards import GuardParams
from mavquad.flight.law_flight import MOST_COMMANDS_IN_FLIGHT
from mavquad.flight.machine import Phase
from mavquad.flight.mission import MissionParams
from mavquad.flight.mission_check import mission_fault
from mavquad.flight.parameters import VehicleParameters
from mavquad.protocol.link import LinkParams
from mavquad.protocol.streams import StreamParams
from mavquad.schema import Section

SETPOINTS_BEFORE_OFFBOARD = 20
"""PX4 wants to see a stream before it takes the mode; one would do."""


class FlightParams(Section):
    """The takeoff, and the time limits of the phases."""

    takeoff_m: float = Field(default=0.0, ge=0.0, le=100.0)
    """Height of the takeoff, m; 0 is the autopilot's own (PX4: MIS_TAKEOFF_ALT; ArduCopter: 2.5 m)."""

    waits_for_takeoff: bool = False
    """Change nothing, arm nothing before the operator orders the takeoff."""
    at_end: Literal["land", "hold"] = "land"
    """When the mission is over: land, or let the law hold the last pose until the operator orders something else."""
    connect_s: float = Field(default=10.0, gt=0.0, le=600.0)
    """To hear an autopilot."""
    identify_s: float = Field(default=15.0, gt=0.0, le=600.0)
    """To get its version, parameters and streams."""
    prepare_s: float = Field(default=20.0, gt=0.0, le=600.0)
    """To change its parameters."""
    ready_s: float = Field(default=120.0, gt=0.0, le=600.0)
    """Until it can be armed; estimators need their time (ArduCopter 42 s from its start, PX4 1.15 38 s)."""
    probe_s: float = Field(default=15.0, gt=5.0, le=60.0)
    """Depth torque: to see whether it takes torques, and again to leave the offboard mode afterwards."""
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
    restore_s: float = Field(default=20.0, gt=0.0, le=600.0)
    """To put its parameters back."""
    force: bool = False
    """Fly with gains that leave no margin on the configured link all the same."""

    def limit_s(self, phase: Phase) -> float:
        """The time limit of a phase; 0 where there is none."""
        return {
            Phase.CONNECTING: self.connect_s,
            Phase.IDENTIFYING: self.identify_s,
            Phase.PREPARING: self.prepare_s,
            Phase.WAITING: self.ready_s,
            Phase.PROBING: self.probe_s,
            Phase.WITHDRAWING: self.probe_s,
            Phase.ARMING: self.arm_s,
            Phase.TAKING_OFF: self.takeoff_s,
            Phase.ENGAGING: self.engage_s,
            Phase.HANDING_BACK: self.hand_back_s,
            Phase.LANDING: self.land_s,
            Phase.DISARMING: self.disarm_s,
            Phase.RESTORING: self.restore_s,
        }.get(phase, 0.0)


class AgentParams(Section):
    """The agent's part of a configuration."""

    link: LinkParams = LinkParams()
    streams: StreamParams = StreamParams()
    flight: FlightParams = FlightParams()
    airframe: AirframeParams = AirframeParams()
    guards: GuardParams = GuardParams()
    parameters: VehicleParameters = VehicleParameters()
    law: LawParams = LawParams()
    mission: MissionParams = MissionParams()

    @model_validator(mode="after")
    def _fits_together(self) -> AgentParams:
        for broken, words in self._contradictions():
            if broken:
                raise ValueError(words)
        return self

    def _too_short(self) -> list[tuple[bool, str]]:
        """Limits of age that the streams, at the least rate that is flown on, cannot keep."""
        guards, streams = self.guards, self.streams
        ages = [("stale_attitude_s", "attitude_hz"), ("late_position_s", "position_hz")]
        if "torque" in self.law.depths:
            ages.append(("stale_attitude_at_torque_s", "attitude_hz"))
        return [
            (
                getattr(guards, age) * getattr(streams, rate) * streams.least_share < 1.5,
                f"guards.{age} is too short for streams.{rate} times streams.least_share",
            )
            for age, rate in ages
        ]

    def _contradictions(self) -> tuple[tuple[bool, str], ...]:
        slowest_hz = self.streams.least_share * min(self.streams.position_hz, self.streams.attitude_hz)
        mission = mission_fault(self.mission, self.guards, self.law)
        engage_s = SETPOINTS_BEFORE_OFFBOARD / slowest_hz + 1.5
        return (
            (self.guards.floor_m >= self.guards.ceiling_m, "guards.floor_m must be below guards.ceiling_m"),
            (mission is not None, mission or ""),
            (
                self.guards.tilt_deg <= self.law.limits.tilt_max_deg,
                "guards.tilt_deg must be greater than law.limits.tilt_max_deg",
            ),
            *self._too_short(),
            (
                self.guards.late_position_s > self.guards.stale_position_s,
                "guards.late_position_s must not be greater than guards.stale_position_s",
            ),
            (self.flight.settle_s >= self.flight.takeoff_s, "flight.settle_s must be shorter than flight.takeoff_s"),
            (
                engage_s >= self.flight.engage_s,
                f"flight.engage_s must be more than {engage_s:.1f} s at streams.position_hz",
            ),
            (
                self.law.delay() * self.streams.position_hz > MOST_COMMANDS_IN_FLIGHT,
                f"law.delay_s times streams.position_hz must be at most {MOST_COMMANDS_IN_FLIGHT}",
            ),
        )
