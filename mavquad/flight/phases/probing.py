"""PROBING, WITHDRAWING: whether the vehicle takes torques is found out on the ground, and the offboard mode left again."""

from __future__ import annotations

from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.machine import Event, Phase
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.torque_probe import TorqueProbe
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message
from mavquad.protocol.command import CommandExchange
from mavquad.protocol.firmware import Mode


class Probing:
    """Leads `probe` through the phases, and says what it has shown."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        control: Control,
        exchange: CommandExchange,
        identifying: Identifying,
        probe: TorqueProbe,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._control = control
        self._exchange = exchange
        self._identifying = identifying
        self._probe = probe

    def on_ready(self) -> None:
        """The vehicle is ready to be armed, but for whether it takes torques, where that matters."""
        is_known = self._probe.proven or self._control.law.depth != "torque"
        self._bridge.fire(Event.READY if is_known else Event.UNPROVEN)

    def begin(self) -> None:
        """Setpoints of zero go out from now on."""
        self._probe.start(self._bridge.now_us)

    def withdraw(self) -> None:
        """Leave the offboard mode, if it was ever asked for."""
        if not self._probe.asked:
            self._on_withdrawn()
        else:
            self._bridge.request(commands.set_mode(self._vehicle.firmware.hold))

    def on_ack(self, message: Message) -> None:
        """A COMMAND_ACK while it is probed."""
        self._probe.on_ack(message)
        self._check()

    def on_heartbeat(self, changed: Mode | None) -> None:
        """HEARTBEAT, disarmed, while it is probed, or leaves the offboard mode again."""
        bridge, offboard = self._bridge, self._vehicle.mode == self._vehicle.firmware.offboard
        if bridge.phase is Phase.PROBING:
            self._probe.proven |= offboard
            self._check()
            if bridge.phase is Phase.PROBING:
                bridge.send_all(self._probe.on_heartbeat(bridge.target, bridge.now_us))
        elif not offboard and (changed is not None or not self._exchange.pending):
            self._on_withdrawn()
        elif offboard and not self._exchange.pending:
            self.withdraw()

    def _check(self) -> None:
        """It is in the offboard mode, or its answers are known."""
        probe, firmware, version = self._probe, self._vehicle.firmware, self._identifying.version
        if probe.proven:
            self._bridge.note("law", "the vehicle takes torques")
            self._bridge.fire(Event.PROVEN)
        elif probe.refused:
            said = self._bridge.said()
            error = reasons.ignores_torque(firmware, version, probe.result, probe.refusals, said)
            self._bridge.fire(Event.REFUSED, error)

    def _on_withdrawn(self) -> None:
        """HEARTBEAT shows another mode: the setpoints end, and it goes on as it went before."""
        self._probe.stop()
        self._bridge.fire(Event.LEFT if self._bridge.is_ending else Event.RELEASED)
