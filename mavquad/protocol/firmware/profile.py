"""What the agent must know of a firmware: its modes, what it takes, and how it is brought into the air and down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mavquad.types import Depth

Version = tuple[int, int, int]
"""Major, minor, patch."""


@dataclass(frozen=True, slots=True)
class Mode:
    """A flight mode.

    Attributes:
        name: as the firmware's users know it, e.g. AUTO.LOITER or GUIDED.
        custom_mode: the number in HEARTBEAT.custom_mode.
        command: parameters 2 and on of MAV_CMD_DO_SET_MODE (176).
    """

    name: str
    custom_mode: int
    command: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Firmware:
    """One family of autopilots.

    Attributes:
        name: of the family, "PX4" or "ArduCopter".
        autopilot: MAV_AUTOPILOT.
        mode: the mode that a HEARTBEAT.custom_mode shows.
        offboard: takes our setpoints.
        takeoff: climbs after MAV_CMD_NAV_TAKEOFF.
        hover: stays where the takeoff ended.
        hold: stops and stays, without setpoints and without a pilot's sticks.
        land: comes down here.
        home: comes back and lands.
        pilot: the pilot flies by the sticks.
        arms_in: the mode that it must be in to be armed and to take off; None where any will do.
        depths: what a release takes, the deepest first.
        takeoff_parameter: the parameter that is the height of a takeoff; "" where the command says it.
        takeoff_m: height of the takeoff where nothing else says it.
        hover_parameter: the autopilot's own hover thrust.
        estimator: name and id of the message that tells how its estimator does.
        high_share: the share of the takeoff's height above which a steady hover is the takeoff's end.
        parameters: read besides those, for the explanations.
    """

    name: str
    autopilot: int
    mode: Callable[[int], Mode]
    offboard: Mode
    takeoff: Mode
    hover: Mode
    hold: Mode
    land: Mode
    home: Mode
    pilot: Mode
    arms_in: Mode | None
    depths: Callable[[Version], tuple[Depth, ...]]
    takeoff_parameter: str
    takeoff_m: float
    hover_parameter: str
    estimator: tuple[str, int]
    high_share: float
    parameters: tuple[str, ...] = ()

    @property
    def acts_at_once(self) -> bool:
        """Whether setpoints act from the first on, since the vehicle is in the mode that takes them already."""
        return self.hover == self.offboard
