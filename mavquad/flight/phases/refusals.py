"""What the vehicle says no to, or nothing at all."""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.guards import LAND, RETURN
from mavquad.flight.machine import Event, Phase
from mavquad.flight.mode_watch import ModeWatch
from mavquad.protocol.command import CommandExchange, Reply

REASON_US = 250_000
_KEEPS_ASKING = (Phase.WAITING, Phase.WITHDRAWING)
_HAS_TIME = (Phase.ARMING, Phase.TAKING_OFF, Phase.ENGAGING)


class Refusals:
    """What follows when the phase's command is refused, or never answered."""

    def __init__(self, bridge: Bridge, control: Control, exchange: CommandExchange, modes: ModeWatch) -> None:
        self._bridge = bridge
        self._control = control
        self._exchange = exchange
        self._modes = modes
        self._result = ""

    def on_deadline(self) -> None:
        """Send the command again, or give it up; act on a refusal that was explained by now, or will not be."""
        self._repeat()
        self._act_when_due()

    def _repeat(self) -> None:
        bridge, exchange = self._bridge, self._exchange
        repeated = exchange.on_deadline(bridge.target, bridge.now_us)
        if repeated is Reply.TIMEOUT and bridge.phase not in (Phase.LANDING, Phase.WITHDRAWING):
            bridge.fire(Event.TIMEOUT, reasons.unanswered(exchange, bridge.said(), bridge.now_us))
        elif repeated is not None and not isinstance(repeated, Reply):
            bridge.send_all([repeated])

    def on_refusal(self) -> None:
        """PX4 sends the text that says why right behind the ACK: wait for it, unless there is a vehicle to bring down."""
        bridge, phase = self._bridge, self._bridge.phase
        if phase in _KEEPS_ASKING:
            return  # the mode is asked for again
        if self._modes.reaction == RETURN:
            self._modes.reaction = LAND  # it cannot come back: down from where it is
        if phase is Phase.LANDING:
            bridge.blame(reasons.refused(self._exchange, self._exchange.result, bridge.said()))
            return
        if phase is Phase.ENGAGING:
            self._control.law.in_control = False
        if bridge.refusal_us == NEVER_US:
            self._result = self._exchange.result
            bridge.refusal_us = bridge.now_us + (REASON_US if phase in _HAS_TIME else 0)
        self._act_when_due()

    def _act_when_due(self) -> None:
        bridge = self._bridge
        if bridge.now_us >= bridge.refusal_us:
            bridge.fire(Event.REFUSED, reasons.refused(self._exchange, self._result, bridge.said()))
