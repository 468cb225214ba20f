"""HEARTBEAT: the truth about mode and arming. Each phase takes it in its own way; a take-over ends them all."""

from __future__ import annotations

from mavquad.errors import FlightEnded
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.machine import Event, Phase
from mavquad.flight.mode_watch import ModeWatch
from mavquad.flight.phases.going_down import GoingDown
from mavquad.flight.phases.going_up import GoingUp
from mavquad.flight.phases.identifying import Identifying
from mavquad.flight.phases.probing import Probing
from mavquad.flight.phases.waiting import Waiting
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol.codec import Message
from mavquad.protocol.firmware import Mode

_PROBE = frozenset((Phase.PROBING, Phase.WITHDRAWING))
_DISARMED = frozenset((Phase.IDENTIFYING, Phase.PREPARING, Phase.WAITING))
_BEFORE_THE_LAW = _DISARMED | _PROBE | {Phase.TAKING_OFF}


class Heartbeats:
    """Takes them in."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        modes: ModeWatch,
        identifying: Identifying,
        waiting: Waiting,
        probing: Probing,
        going_up: GoingUp,
        going_down: GoingDown,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._modes = modes
        self._identifying = identifying
        self._waiting = waiting
        self._probing = probing
        self._going_up = going_up
        self._going_down = going_down

    def take(self, message: Message) -> None:
        """The next one."""
        if self._bridge.phase is Phase.CONNECTING:
            self._identifying.on_found(message)
            return
        was_armed = self._vehicle.armed
        changed = self._vehicle.take_heartbeat(message)
        taken_over = self._taken_over(changed, was_armed)
        if taken_over is not None:
            self._bridge.fire(Event.TAKEN_OVER, taken_over)
            return
        if self._bridge.phase in _BEFORE_THE_LAW:
            self._identifying.keep_streams()
        self._on_armed(changed) if self._vehicle.armed else self._on_disarmed(changed)

    def _taken_over(self, changed: Mode | None, was_armed: bool) -> FlightEnded | None:
        """Why the flight is not ours any more, if so."""
        vehicle, phase = self._vehicle, self._bridge.phase
        if changed is not None and self._modes.is_taken_over(changed):
            return reasons.taken_over(changed, phase, self._bridge.said())
        if changed is not None:
            self._bridge.note("mode", changed.name)
            self._going_down.on_mode()
        if phase is Phase.RESTORING and vehicle.armed and not was_armed:
            return reasons.armed_again(vehicle.mode_name)
        return None

    def _on_armed(self, changed: Mode | None) -> None:
        phase, mode_name = self._bridge.phase, self._vehicle.mode_name
        if phase in (Phase.ARMING, Phase.ENGAGING):
            self._going_up.on_armed()
        elif phase in _PROBE:
            self._bridge.fire(Event.TAKEN_OVER, reasons.armed_meanwhile(mode_name, phase))
        elif phase in _DISARMED:
            self._bridge.fire(Event.REFUSED, reasons.armed_already(mode_name))
        else:
            self._going_down.on_armed(changed)

    def _on_disarmed(self, changed: Mode | None) -> None:
        if self._bridge.phase is Phase.WAITING:
            self._waiting.on_heartbeat()
        elif self._bridge.phase in _PROBE:
            self._probing.on_heartbeat(changed)
        self._going_down.on_disarmed()
