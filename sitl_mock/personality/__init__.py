"""How a given autopilot behaves on the wire: what every personality is to the vehicle around it."""

from __future__ import annotations

from typing import Any, Protocol

from mavquad.protocol.codec import Message
from sitl_mock.geometry import Vec4
from sitl_mock.plant import VehicleState
from sitl_mock.port import Port
from sitl_mock.sensors import Estimate

Sender = tuple[int, int]
"""(system id, component id) of who sent a message."""


class Personality(Protocol):
    """An autopilot's software. Times count from its boot."""

    @property
    def mode(self) -> str:
        """The autopilot's own name of the mode in force."""

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""

    @property
    def crashed(self) -> bool:
        """Whether it came down hard or on its back."""

    @property
    def stored_parameters(self) -> dict[str, Any]:
        """The values of its parameters, by name; they outlive a reboot."""

    def handle(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """React to one message that came in on `port`; answers go out there."""

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of modes and inner loops; the motor commands until the next one."""

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due on each port."""

    def pilot_selects(self, mode: str) -> None:
        """The pilot moves the mode switch; `mode` is one of the autopilot's own names."""

    def breach_geofence(self) -> None:
        """The vehicle is found outside its geofence."""
