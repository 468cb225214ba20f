"""HANDING_BACK, LANDING, DISARMING: the vehicle flies by itself again, comes down, and stands still."""

from __future__ import annotations

from mavquad.flight import reasons
from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.guards import HOLD, PILOT, RETURN, tilt_rad
from mavquad.flight.machine import IN_FLIGHT, Event, Phase
from mavquad.flight.mode_watch import ModeWatch
from mavquad.flight.modes import way_back
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message
from mavquad.protocol.command import CommandExchange
from mavquad.protocol.firmware import Mode

DISARM_PATIENCE_US = 5_000_000
LIES_RAD = 1.0
_LAW_MAY_ACT = (Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK)
_PROBE = (Phase.PROBING, Phase.WITHDRAWING)


class GoingDown:
    """The way from the law's control to the ground."""

    def __init__(
        self, bridge: Bridge, vehicle: Vehicle, control: Control, exchange: CommandExchange, modes: ModeWatch
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._control = control
        self._exchange = exchange
        self._modes = modes

    # ------------------------------------------------------------------ entering

    def hand_back(self) -> None:
        """Ask for the mode that it is handed back in."""
        self._bridge.request(commands.set_mode(way_back(self._vehicle.firmware, self._modes.reaction)))

    def land(self) -> None:
        """Ask for the landing, or for the return; not without safe setpoints where it may still heed setpoints."""
        firmware, mode = self._vehicle.firmware, self._vehicle.mode
        returns = self._modes.reaction == RETURN
        self._modes.seen_own |= mode == self._modes.asked_for
        self._bridge.request(commands.set_mode(firmware.home) if returns else commands.land(firmware))
        if self._control.sent and mode == firmware.offboard:
            # The hand-back did not work, and the firmware holds the last command.
            self._control.make_safe(self._bridge.now_us)
            self._bridge.stay_safe()
        else:
            self._control.stop()

    def disarm(self) -> None:
        """It is on the ground, or should never leave it."""
        self._control.stop()
        self._bridge.request(commands.disarm())

    # ------------------------------------------------------------------ what the vehicle says

    def on_mode(self) -> None:
        """HEARTBEAT shows another mode: no setpoint is needed once it has left the offboard mode."""
        if self._vehicle.mode != self._vehicle.firmware.offboard and self._bridge.phase is Phase.LANDING:
            self._control.stop()

    def on_armed(self, changed: Mode | None) -> None:
        """HEARTBEAT shows it armed; where it does not show what was asked for and acknowledged, that is asked again."""
        phase, is_there = self._bridge.phase, self._vehicle.mode == self._modes.asked_for
        if phase is Phase.HANDING_BACK and is_there and changed is not None:
            self._on_released()  # seen before its ACK: no setpoint may follow
        elif self._exchange.pending:
            return
        elif phase is Phase.HANDING_BACK:
            self._on_released() if is_there else self.hand_back()
        elif phase is Phase.LANDING and not is_there:
            self.land()

    def _on_released(self) -> None:
        """HEARTBEAT shows the mode that it was handed back in."""
        leaves = self._modes.reaction in (HOLD, PILOT)
        self._bridge.fire(Event.LEFT if leaves else Event.RELEASED)

    def on_extended_state(self, message: Message) -> None:
        """On the ground and still armed well after touch-down: the autopilot does not disarm by itself."""
        now_us = self._bridge.now_us
        self._vehicle.take_extended_state(message, now_us)
        since_us = max(self._vehicle.on_ground_since_us, self._bridge.phase_us)
        if self._bridge.phase is Phase.LANDING and now_us - since_us > DISARM_PATIENCE_US:
            self._bridge.fire(Event.LANDED)

    def on_disarmed(self) -> None:
        """HEARTBEAT shows it disarmed."""
        phase = self._bridge.phase
        if phase is Phase.DISARMING and self._exchange.pending:
            return  # this heartbeat may be from before an arming that we did not hear of
        expected = phase not in IN_FLIGHT or (phase is Phase.LANDING and self._is_down_well())
        self._bridge.fire(Event.DISARMED, None if expected else reasons.disarmed(phase, self._bridge.said()))

    def _is_down_well(self) -> bool:
        """A vehicle that has landed tells of it, upright; one that rebooted in the air, or fell, shows disarmed as well."""
        pose = self._control.pose
        upright = pose.attitude is None or tilt_rad(pose.attitude) < LIES_RAD
        return upright and pose.stale(self._bridge.now_us) is None

    def last_resort(self) -> list[Message]:
        """What to send when our own code has failed in flight: hold, and no rotation meanwhile."""
        phase, target = self._bridge.phase, self._bridge.target
        hold = commands.set_mode(self._vehicle.firmware.hold).message(target, 0)
        if phase in _PROBE:
            return [hold]
        if phase not in _LAW_MAY_ACT:
            return []  # the autopilot flies it, by itself
        return [hold, self._control.safe(target, self._bridge.now_us)]
