"""Why a phase took longer than its limit, as far as it can be told."""

from __future__ import annotations

from mavquad.errors import MavquadError
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.machine import Phase
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.phases.waiting import Waiting
from mavquad.flight.preparation import Preparation
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.command import CommandExchange


class Limits:
    """Knows what each phase waits for."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        exchange: CommandExchange,
        identifying: Identifying,
        preparation: Preparation,
        waiting: Waiting,
        takeoff: TakeoffWatch,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._exchange = exchange
        self._identifying = identifying
        self._preparation = preparation
        self._waiting = waiting
        self._takeoff = takeoff

    def error(self) -> MavquadError:
        """The phase is over its limit."""
        bridge, exchange, said = self._bridge, self._exchange, self._bridge.said()
        if bridge.phase is Phase.ENGAGING:
            return reasons.not_engaged(exchange, self._vehicle, self._identifying.told.get("COM_RCL_EXCEPT"), said)
        waited_s = (bridge.now_us - bridge.phase_us) * 1e-6
        firmware, details = self._vehicle.firmware, self._details()
        return reasons.too_long(bridge.phase, firmware, details, exchange.tries, waited_s, said)

    def _details(self) -> str:
        phase = self._bridge.phase
        if phase is Phase.WAITING:
            return self._waiting.not_ready()
        if phase is Phase.IDENTIFYING:
            return self._identifying.waits_for
        if phase in (Phase.PREPARING, Phase.RESTORING):
            return self._preparation.waiting_for
        if phase is Phase.TAKING_OFF and self._takeoff.lacks_thrust:
            return "its hover thrust is not known (ATTITUDE_TARGET; or set airframe.hover_thrust_norm)"
        return ""
