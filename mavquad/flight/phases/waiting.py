"""WAITING: whether the vehicle is ready to be armed, and what it waits for."""

from __future__ import annotations

from mavquad.flight.bridge import Bridge
from mavquad.flight.control import Control
from mavquad.flight.vehicle import Vehicle
from mavquad.protocol import command as commands
from mavquad.protocol.command import CommandExchange
from mavquad.protocol.firmware import Mode
from mavquad.protocol.streams import StreamParams, shortfalls


class Waiting:
    """Looks at what the vehicle says of itself, and at what of it arrives here."""

    def __init__(
        self,
        bridge: Bridge,
        vehicle: Vehicle,
        control: Control,
        exchange: CommandExchange,
        streams: StreamParams,
        most_round_trip_s: float,
    ) -> None:
        self._bridge = bridge
        self._vehicle = vehicle
        self._control = control
        self._exchange = exchange
        self._streams = streams
        self._most_round_trip_s = most_round_trip_s
        self._told = ""

    def on_heartbeat(self) -> None:
        """HEARTBEAT while it is not ready: ask for the mode to arm in, and tell what it waits for."""
        if not self._arms_here() and not self._exchange.pending:
            self._bridge.request(commands.set_mode(self._mode_to_arm_in))
        waits_for = self.not_ready()
        kind = waits_for.split(" at ")[0]  # a rate that changes is no news
        if waits_for and kind != self._told:
            self._told = kind
            self._bridge.note("waiting", waits_for)

    def not_ready(self) -> str:
        """Why the vehicle cannot be armed yet; empty when it can."""
        vehicle, pose = self._vehicle, self._control.pose
        if not self._arms_here():
            return f"it is in mode {vehicle.mode_name} and not yet in {self._mode_to_arm_in.name}"
        if not vehicle.prearm_ok:
            return f"the autopilot's own pre-arm checks have not passed (mode {vehicle.mode_name})"
        if not vehicle.on_ground:
            return "EXTENDED_SYS_STATE does not show it on the ground"
        round_trip_s = vehicle.round_trip_s
        if round_trip_s is not None and round_trip_s > self._most_round_trip_s:
            return f"a round trip over the link takes {round_trip_s:.2f} s: too slow to fly on"
        if pose.attitude is None or pose.position is None:
            return "no pose"
        fault = self._control.guards.not_ready()
        return fault or "; ".join(shortfalls(self._streams, vehicle.streams, self._bridge.now_us))

    @property
    def _mode_to_arm_in(self) -> Mode:
        firmware = self._vehicle.firmware
        return firmware.arms_in or firmware.hold

    def _arms_here(self) -> bool:
        """PX4 1.16 goes back to OFFBOARD when it has landed and disarmed, and its checks fail there without setpoints."""
        firmware, mode = self._vehicle.firmware, self._vehicle.mode
        return mode != firmware.offboard if firmware.arms_in is None else mode == firmware.arms_in
