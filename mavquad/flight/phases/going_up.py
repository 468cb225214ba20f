"""ARMING, TAKING_OFF, ENGAGING, FLYING: the vehicle takes off by itself, and the law takes over."""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.guards import GuardParams
from mavquad.flight.law_choice import LawChoice
from mavquad.flight.machine import Event, Phase
from mavquad.flight.mission_check import height_fault
from mavquad.flight.mission_params import MissionParams
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message
from mavquad.protocol.messages import attitude_target_from
from mavquad.protocol.streams import StreamParams

BELIEVED_US = 150_000
"""After the ACK of the offboard mode an ATTITUDE_TARGET may still be from before it; later, it shows that it was wrong."""


class GoingUp:
    """The way from the ground to the law's control."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        control: Control,
        law_choice: LawChoice,
        takeoff: TakeoffWatch,
        streams: StreamParams,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._control = control
        self._law_choice = law_choice
        self._takeoff = takeoff
        self._streams = streams
        self._believed_us = NEVER_US

    # ------------------------------------------------------------------ entering

    def arm(self) -> None:
        """Heights count from here."""
        position = self._control.pose.position
        assert position is not None
        self._bridge.ground_m = position.position_nwu_m[2]
        self._bridge.request(commands.arm())

    def take_off(self) -> None:
        """The autopilot does that by itself."""
        self._bridge.request(commands.takeoff(self._vehicle.firmware, self._takeoff.altitude_m))

    def engage(self) -> None:
        """The law answers what is measured; where the vehicle is in the mode already, what is sent acts."""
        now_us, asked, streams = self._bridge.now_us, self._streams, self._vehicle.streams
        attitude_hz = min(asked.attitude_hz, streams["ATTITUDE"].rate_hz(now_us))
        position_hz = min(asked.position_hz, streams["LOCAL_POSITION_NED"].rate_hz(now_us))
        self._control.law.in_control = self._vehicle.firmware.acts_at_once
        self._control.start(attitude_hz, position_hz, now_us, self._vehicle.round_trip_s)

    def fly(self) -> None:
        """The law is in control, and the mission begins."""
        control, position = self._control, self._control.pose.position
        assert position is not None
        control.law.in_control = True
        control.echo.wanted = False
        control.law.start_mission(position.stamp_us)

    # ------------------------------------------------------------------ what happens

    def on_armed(self) -> None:
        """HEARTBEAT shows it armed; and in the offboard mode, which counts once it has heard of us."""
        if self._bridge.phase is Phase.ARMING:
            self._bridge.fire(Event.ARMED)
        elif self._vehicle.mode == self._vehicle.firmware.offboard and self._control.sent:
            self._bridge.fire(Event.ENGAGED)

    def on_airborne(self, mission: MissionParams, guards: GuardParams) -> None:
        """It hovers. How far the mission leads up and down counts from here."""
        fault = height_fault(mission, guards, self._bridge.height_m())
        if fault is None:
            self._law_choice.settle()
            self._bridge.fire(Event.AIRBORNE)
        else:
            self._bridge.fire(Event.TIMEOUT, reasons.too_high_or_low(fault))

    def on_offboard_accepted(self) -> None:
        """An ACK is no proof (PX4 1.16 takes it back), but what is sent may act from now on: it is believed, for a while.

        PX4 1.16 pauses ATTITUDE_TARGET for half a second just then, and what acts unknown to the observer shakes the vehicle.
        """
        self._control.law.in_control = True
        self._believed_us = self._bridge.now_us

    def on_attitude_target(self, message: Message) -> None:
        """What the autopilot's inner loops are told: by itself, or by us."""
        if self._bridge.phase is Phase.TAKING_OFF:
            self._takeoff.learn(message.thrust, self._control.pose.attitude)
            if self._takeoff.hovers:
                self._watch(message)
        elif self._bridge.phase is Phase.ENGAGING and self._control.echo.wanted:
            self._look_for_echo(message)

    def _look_for_echo(self, message: Message) -> None:
        law, echo = self._control.law, self._control.echo
        if echo.shows(message):
            self._bridge.note("law", "the autopilot follows: ATTITUDE_TARGET shows our setpoint")
            law.in_control, echo.wanted = True, False
        elif law.depth != "torque" and (not law.in_control or self._bridge.now_us - self._believed_us > BELIEVED_US):
            law.in_control = False
            self._watch(message)

    def _watch(self, message: Message) -> None:
        """The autopilot flies by its own command: let the observer run on that."""
        target, pose, law = attitude_target_from(message), self._control.pose, self._control.law
        if target is None or pose.attitude is None or pose.position is None:
            return
        if not law.watches:
            self._law_choice.settle()
        law.watch(target, pose.position, pose.attitude)
