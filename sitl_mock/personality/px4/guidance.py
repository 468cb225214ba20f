"""PX4's own modes as setpoints of the inner loops: takeoff, hold, return, land, and the sinking POSCTL without RC."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import ZERO3, Vec3, wrap_pi
from sitl_mock.inner_loops import PositionSetpoint, Setpoint, TorqueSetpoint
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.sensors import Estimate

IDLE = TorqueSetpoint(ZERO3, 0.0)

_RAMP_M_S2 = 1.0
_FAST_SINK_M_S = 1.0
_SLOW_BELOW_M = 10.0
_POSCTL_SINK_M_S = 0.55
_REACHED_M = 0.3
_STOPPING_S = 0.5


@dataclass(frozen=True, slots=True)
class Speeds:
    """Vertical speeds of takeoff and landing in m/s (MPC_TKO_SPEED, MPC_LAND_SPEED)."""

    takeoff_m_s: float
    land_m_s: float


class Guidance:
    """Follows one of the autopilot's own modes; `done` says that a mode has reached its end."""

    def __init__(self) -> None:
        self._hold_ned_m: Vec3 = ZERO3
        self._yaw_rad = 0.0
        self._climb_to_m = 0.0
        self._speed_m_s = 0.0
        self.done = False

    def enter(self, estimate: Estimate) -> None:
        """Hold from here on, ahead by the way it takes to stop."""
        n, e, d = estimate.position_ned_m
        vn, ve, vd = estimate.velocity_ned_m_s
        self._hold_ned_m = (n + _STOPPING_S * vn, e + _STOPPING_S * ve, d + _STOPPING_S * vd)
        self._yaw_rad = wrap_pi(estimate.euler_rad[2])
        self._speed_m_s = 0.0
        self.done = False

    def stay(self) -> None:
        """Hold where the mode that is done has led to."""
        self.done = False

    def climb_to(self, down_m: float) -> None:
        """Set the height, as z in NED, at which a takeoff ends."""
        self._climb_to_m = down_m

    def setpoint(
        self, mode: Mode, estimate: Estimate, home_ned_m: Vec3, on_ground: bool, speeds: Speeds, dt_s: float
    ) -> Setpoint:
        """What the mode asks of the inner loops now."""
        if mode is Mode.TAKEOFF:
            return self._takeoff(estimate, speeds, dt_s)
        if on_ground:
            return IDLE
        if mode is Mode.LAND:
            high = home_ned_m[2] - estimate.position_ned_m[2] > _SLOW_BELOW_M
            return self._sink(_FAST_SINK_M_S if high else speeds.land_m_s)
        if mode is Mode.POSCTL or mode is Mode.MANUAL:
            return self._sink(_POSCTL_SINK_M_S)
        if mode is Mode.RTL:
            self._return(estimate, home_ned_m)
        return PositionSetpoint(self._hold_ned_m, yaw_rad=self._yaw_rad)

    def _sink(self, speed_m_s: float) -> PositionSetpoint:
        n, e, _ = self._hold_ned_m
        return PositionSetpoint((n, e, None), (0.0, 0.0, speed_m_s), yaw_rad=self._yaw_rad)

    def _takeoff(self, estimate: Estimate, speeds: Speeds, dt_s: float) -> PositionSetpoint:
        n, e, down_m = self._hold_ned_m
        left_m = self._climb_to_m - down_m
        speed_limit = min(speeds.takeoff_m_s, math.sqrt(2 * _RAMP_M_S2 * abs(left_m)))
        self._speed_m_s = min(self._speed_m_s + _RAMP_M_S2 * dt_s, speed_limit)
        move_m = math.copysign(min(self._speed_m_s * dt_s, abs(left_m)), left_m)
        self._hold_ned_m = (n, e, down_m + move_m)
        self.done = left_m == move_m and abs(estimate.position_ned_m[2] - self._climb_to_m) < _REACHED_M
        return PositionSetpoint(self._hold_ned_m, (0.0, 0.0, move_m / dt_s), yaw_rad=self._yaw_rad)

    def _return(self, estimate: Estimate, home_ned_m: Vec3) -> None:
        self._hold_ned_m = (home_ned_m[0], home_ned_m[1], self._hold_ned_m[2])
        n, e, _ = estimate.position_ned_m
        self.done = math.hypot(n - home_ned_m[0], e - home_ned_m[1]) < _REACHED_M
