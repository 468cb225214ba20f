"""The law as it is for the vehicle that was met, and as the takeoff shows that it must be."""

from __future__ import annotations

from collections.abc import Callable

from mavquad.control.params import LawParams
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.delay import DelayMeter
from mavquad.flight.law_flight import MOST_COMMANDS_IN_FLIGHT
from mavquad.flight.vehicle import Vehicle
from mavquad.flight.velocity_check import VelocityCheck
from mavquad.protocol.firmware import PX4, Version
from mavquad.types import Depth

SLOW_LINK_S = 0.02
SLOW_LINK_VELOCITY_KAPPA_RAD_S = 10.0
"""With more delay than that beyond the usual, a higher gain on the velocity shakes the vehicle."""

Admit = Callable[[LawParams, Depth], None]
"""Raises MavquadError where the gains leave no margin."""


class LawChoice:
    """Chooses what `control` flies.

    Attributes:
        delay: how old attitudes are when they arrive; to be fed.
        velocity_check: whether the velocity is to be believed; to be fed.
    """

    def __init__(
        self, bridge: Bridge, control: Control, vehicle: Vehicle, own: LawParams, position_hz: float, admit: Admit
    ) -> None:
        """Args: `own`, the law as configured, whose open keys the choice fills; `position_hz`, the rate asked for."""
        self._bridge = bridge
        self._control = control
        self._vehicle = vehicle
        self._own = own
        self._most_delay_s = MOST_COMMANDS_IN_FLIGHT / position_hz
        self._admit = admit
        self.delay = DelayMeter()
        self.velocity_check = VelocityCheck()

    def choose(self, version: Version) -> None:
        """The law for this vehicle, at a depth that it takes.

        Raises:
            MavquadError: it does not take the depth, or the gains leave no margin.
        """
        firmware, asked = self._vehicle.firmware, self._own.depth
        taken = firmware.depths(version)
        depth = taken[0] if asked == "auto" else asked
        if depth not in taken:
            raise reasons.no_torque(firmware, version)
        law = self._own.of("px4" if firmware is PX4 else "arducopter")
        self._admit(law, depth)
        self._control.choose(law, depth)
        self._bridge.note("law", f"depth {depth}, measurements {law.measured()}")

    def settle(self) -> None:
        """What the takeoff has shown: the link's delay, and what the estimated velocity is worth."""
        self._count_on_the_delay()
        self._believe_velocity_or_not()

    def _count_on_the_delay(self) -> None:
        """The link's delay is known by now, as it was in the last seconds of the takeoff."""
        law = self._control.law
        delay_s = self.delay.delay_s(self._vehicle.round_trip_s, self._most_delay_s)
        if law.params.delay_s is None and delay_s is not None:
            update = {"delay_s": delay_s}
            if law.params.velocity_kappa_rad_s is None and delay_s > law.params.delay() + SLOW_LINK_S:
                usual = law.params.own(law.depth).velocity_kappa_rad_s
                update["velocity_kappa_rad_s"] = min(usual, SLOW_LINK_VELOCITY_KAPPA_RAD_S)
            self._control.choose(law.params.model_copy(update=update), law.depth)
            self._bridge.note("law", f"the link's delay is {delay_s * 1e3:.0f} ms")

    def _believe_velocity_or_not(self) -> None:
        """Whether the observer takes the estimated velocity, by what was seen of it so far."""
        law, check = self._control.law, self.velocity_check
        if check.misleads and law.params.mistrusting(law.depth) != law.params:
            self._control.choose(law.params.mistrusting(law.depth), law.depth)
            difference = f"{check.difference_m_s:.2f} m/s off the slope of the position"
            self._bridge.note("law", f"the estimated velocity counts less: it is {difference}")
