"""Whose mode a change of mode is: ours, or the pilot's or a failsafe's, who then have the vehicle."""

from __future__ import annotations

from mavquad.flight.bridge import Bridge
from mavquad.flight.guards import LAND, Reaction
from mavquad.flight.machine import Phase
from mavquad.flight.modes import asked_for, own_modes
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.torque_probe import TorqueProbe
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.firmware import Mode


class ModeWatch:
    """Judges the modes that HEARTBEAT shows.

    Attributes:
        reaction: what follows the law's control: land, hold, return or pilot.
        seen_own: whether HEARTBEAT has shown the mode that the phase asks for.
    """

    def __init__(self, bridge: Bridge, vehicle: Vehicle, takeoff: TakeoffWatch, probe: TorqueProbe) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._takeoff = takeoff
        self._probe = probe
        self.reaction: Reaction = LAND
        self.seen_own = False

    @property
    def asked_for(self) -> Mode | None:
        """The mode that the phase asks for, if any."""
        return asked_for(self._vehicle.firmware, self._bridge.phase, self.reaction)

    def is_taken_over(self, changed: Mode) -> bool:
        """Whether a change of mode is the pilot's or a failsafe's: to one that is not ours to expect, or not now."""
        phase, firmware = self._bridge.phase, self._vehicle.firmware
        if phase is Phase.PROBING and not self._probe.asked:
            return True
        if phase is Phase.LANDING and not self._vehicle.armed:
            return False  # down: PX4 1.16 shows AUTO.LOITER with the HEARTBEAT that shows it disarmed
        if phase is Phase.TAKING_OFF and changed == firmware.hover and self.seen_own:
            return not self._takeoff.is_high(self._bridge.height_m())
        if phase is Phase.LANDING and self.seen_own:
            return True
        self.seen_own |= changed == self.asked_for
        own = own_modes(firmware, phase, self.reaction)
        return own is not None and changed not in own
