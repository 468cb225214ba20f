"""PX4's own modes as setpoints of the inner loops: which of the ways to fly belongs to which mode."""

from __future__ import annotations

from collections.abc import Callable

from sitl_mock.geodesy import Origin
from sitl_mock.inner_loops import Setpoint
from sitl_mock.personality.px4.hold import Hold
from sitl_mock.personality.px4.homeward import Homeward
from sitl_mock.personality.px4.landing import Landing
from sitl_mock.personality.px4.manual import Manual, Sticks
from sitl_mock.personality.px4.mission_flight import MissionFlight
from sitl_mock.personality.px4.mission_plan import MissionPlan
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.orbit import Orbit
from sitl_mock.personality.px4.takeoff import Takeoff
from sitl_mock.personality.px4.view import FlightMode, View


class Guidance:
    """Follows the autopilot's own modes.

    Attributes:
        takeoff, hold, orbit, mission: to be told where to.
        sticks: the pilot's, or None if there is no pilot.
    """

    def __init__(
        self, hover_thrust_norm: float, mission: MissionPlan, origin: Origin, say: Callable[[int, str], None]
    ) -> None:
        self.takeoff = Takeoff(hover_thrust_norm)
        self.hold = Hold()
        self.orbit = Orbit()
        self.mission = MissionFlight(mission, origin, hover_thrust_norm, say)
        self.sticks: Sticks | None = None
        self._manual = Manual(hover_thrust_norm)
        self._sinking = Landing(without_pilot=True)
        self._by_mode: dict[Mode, FlightMode] = {
            Mode.TAKEOFF: self.takeoff,
            Mode.VTOL_TAKEOFF: self.takeoff,
            Mode.LAND: Landing(),
            Mode.PRECLAND: Landing(),
            Mode.RTL: Homeward(say, origin.altitude_m),
            Mode.ORBIT: self.orbit,
            Mode.MISSION: self.mission,
        }
        self._mode = Mode.LOITER
        self._is_manual = False
        self._flying: FlightMode = self.hold

    def enter(self, mode: Mode, view: View) -> None:
        """Fly this mode from here on."""
        self._mode, self._is_manual = mode, mode.needs_sticks
        self._manual.mode = mode
        self._flying = self._flight_mode()
        if self._flying is not self.takeoff:
            self.takeoff.aim_nowhere()
        self._flying.enter(view)

    def _flight_mode(self) -> FlightMode:
        if not self._is_manual:
            return self._by_mode.get(self._mode, self.hold)
        return self._sinking if self.sticks is None else self._manual

    def setpoint(self, view: View) -> Setpoint:
        """What the mode asks of the inner loops now."""
        if self._is_manual:
            if self.sticks is not None:
                self._manual.sticks = self.sticks
            if self._flying is not self._flight_mode():
                self.enter(self._mode, view)
        return self._flying.setpoint(view)
