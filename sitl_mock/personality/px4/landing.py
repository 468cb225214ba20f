"""Going down: AUTO.LAND, and what POSCTL does in a failsafe when nobody holds the sticks."""

from __future__ import annotations

from sitl_mock.geometry import Vec3, wrap_pi
from sitl_mock.inner_loops import PositionSetpoint, Setpoint
from sitl_mock.personality.px4.settings import Settings
from sitl_mock.personality.px4.view import IDLE, View

_STOPPING_S = 0.5
_ACCELERATION_M_S2 = 1.0
_CONTACT_S = 0.35
"""PX4's ground contact: who leans into the wind hops as the ground levels it, and is not to fly off again."""
_WITHOUT_PILOT_M_S = 0.55
"""Recorded on 1.16.2: POSCTL sinks with this speed when there are no sticks."""


class Landing:
    """Sinks to the ground at its place; slowly near it, as the distance sensor of SIH lets PX4 do."""

    def __init__(self, without_pilot: bool = False) -> None:
        self._without_pilot = without_pilot
        self._at_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self._yaw_rad = 0.0
        self._speed_m_s = 0.0
        self._contact_left_s = 0.0

    def enter(self, view: View) -> None:
        """Land here, ahead by the way it takes to stop."""
        (n, e, d), (vn, ve, vd) = view.estimate.position_ned_m, view.estimate.velocity_ned_m_s
        self.begin_at((n + _STOPPING_S * vn, e + _STOPPING_S * ve, d), view.estimate.euler_rad[2])
        self._speed_m_s = max(0.0, vd)

    def begin_at(self, at_ned_m: Vec3, yaw_rad: float) -> None:
        """Land at this place."""
        self._at_ned_m, self._yaw_rad, self._speed_m_s = at_ned_m, wrap_pi(yaw_rad), 0.0
        self._contact_left_s = 0.0

    def setpoint(self, view: View) -> Setpoint:
        """Its place, and the speed for this height."""
        self._contact_left_s = _CONTACT_S if view.on_ground else self._contact_left_s - view.dt_s
        if self._contact_left_s > 0.0:
            return IDLE
        wanted = _WITHOUT_PILOT_M_S if self._without_pilot else sinking_speed_m_s(view.height_m, view.settings)
        most = _ACCELERATION_M_S2 * view.dt_s
        self._speed_m_s += max(-most, min(most, wanted - self._speed_m_s))
        n, e, _ = self._at_ned_m
        return PositionSetpoint((n, e, None), (0.0, 0.0, self._speed_m_s), yaw_rad=self._yaw_rad)


def sinking_speed_m_s(height_m: float, settings: Settings) -> float:
    """MPC_Z_V_AUTO_DN above MPC_LAND_ALT1, MPC_LAND_SPEED below MPC_LAND_ALT2, MPC_LAND_CRWL below MPC_LAND_ALT3."""
    high_m, low_m = settings.mpc_land_alt1, settings.mpc_land_alt2
    if height_m < settings.mpc_land_alt3:
        return settings.mpc_land_crwl
    if height_m >= high_m or not high_m > low_m:
        return settings.mpc_z_v_auto_dn if height_m >= high_m else settings.mpc_land_speed
    share = max(0.0, (height_m - low_m) / (high_m - low_m))
    return settings.mpc_land_speed + share * (settings.mpc_z_v_auto_dn - settings.mpc_land_speed)
