"""PREPARING, RESTORING: the vehicle's parameters as the flight wants them, and as they were."""

from __future__ import annotations

from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.machine import Event, Phase
from mavquad.flight.operator import Operator
from mavquad.flight.parameters import VehicleParameters
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.preparation import Preparation
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.codec import Message


class Preparing:
    """Leads `preparation` through the flight."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        operator: Operator,
        identifying: Identifying,
        preparation: Preparation,
        parameters: VehicleParameters,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._operator = operator
        self._identifying = identifying
        self._preparation = preparation
        self._parameters = parameters

    def prepare(self) -> None:
        """Read what is to be changed; the height of the takeoff too, where that is a parameter."""
        firmware, found = self._vehicle.firmware, self._identifying.told
        wanted = self._parameters.wanted(firmware, found, self._vehicle.transmitter)
        if firmware.takeoff_parameter in found and self._operator.takeoff_m:
            wanted[firmware.takeoff_parameter] = self._operator.takeoff_m
        bridge = self._bridge
        bridge.send_all(self._preparation.start(wanted, firmware, bridge.target, bridge.now_us))
        self._check()

    def kept(self) -> None:
        """What the parameters were is kept where it survives us: they may be changed."""
        self._bridge.send_all(self._preparation.change(self._bridge.target, self._bridge.now_us))
        self._check()

    def restore(self) -> None:
        """Put back what was changed."""
        self._bridge.send_all(self._preparation.restore(self._bridge.target, self._bridge.now_us))
        self._check()

    def end(self) -> None:
        """The flight is over, whatever became of the parameters."""
        self._preparation.stop()
        if self._preparation.left_over:
            names = ", ".join(record.name for record in self._preparation.records)
            self._bridge.note("parameter", f"not put back: {names}")

    def on_param(self, message: Message) -> None:
        """A PARAM_VALUE."""
        self._bridge.send_all(self._preparation.on_value(message, self._bridge.target, self._bridge.now_us))
        self._check()

    def on_deadline(self) -> None:
        """Repeat what went without an answer."""
        self._bridge.send_all(self._preparation.on_deadline(self._bridge.target, self._bridge.now_us))
        self._check()

    def _check(self) -> None:
        """Whether nothing is waited for any more."""
        phase, preparation = self._bridge.phase, self._preparation
        if phase is Phase.PREPARING and preparation.over:
            if preparation.failed:
                self._bridge.fire(Event.REFUSED, reasons.parameters_refused(preparation.failed))
            else:
                self._note_changes()
                self._bridge.fire(Event.PREPARED)
        elif phase is Phase.RESTORING and preparation.over:
            if preparation.failed:
                self._bridge.blame(reasons.parameters_left(preparation.failed))
            self._bridge.fire(Event.RESTORED)

    def _note_changes(self) -> None:
        for record in self._preparation.records:
            self._bridge.note("parameter", f"{record.name} {record.original:g} -> {record.changed:g}")
