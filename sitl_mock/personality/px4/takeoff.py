"""AUTO.TAKEOFF: the rotors spool up, the thrust rises until it lifts off, then it climbs; timed as recorded.

Recorded on 1.13.3 and 1.16.2: 1 s after arming the thrust begins to rise, for 3 s (MPC_TKO_RAMP_T) until it carries the
weight; then the climb gains 0.7 m/s^2 up to MPC_TKO_SPEED, and brakes with 0.4 m/s^2. It is over within NAV_MC_ALT_RAD of
the height.
"""

from __future__ import annotations

import math

from sitl_mock.geometry import Vec3, from_euler, wrap_pi
from sitl_mock.inner_loops import AttitudeSetpoint, Setpoint
from sitl_mock.personality.px4.route import Pace, Route
from sitl_mock.personality.px4.view import IDLE, View

_SPOOL_UP_US = 1_000_000
_CLIMB_M_S2 = 0.7


class Takeoff:
    """Climbs to a place; `done` says that it is there."""

    def __init__(self, hover_thrust_norm: float) -> None:
        self._hover_thrust_norm = hover_thrust_norm
        self._route = Route()
        self._ramp_s = 0.0
        self._has_left = False
        self._to_ned_m: Vec3 | None = None
        self._yaw_rad = math.nan
        self.done = False

    def aim(self, to_ned_m: Vec3, yaw_rad: float) -> None:
        """Where the next takeoff goes; NaN: straight up, with the heading that it has."""
        self._to_ned_m, self._yaw_rad = to_ned_m, yaw_rad

    def aim_nowhere(self) -> None:
        """The next takeoff goes straight up by MIS_TAKEOFF_ALT, unless it is told otherwise."""
        self._to_ned_m, self._yaw_rad = None, math.nan

    @property
    def target_ned_m(self) -> Vec3:
        """Where it ends."""
        return self._route.target_ned_m

    @property
    def target_yaw_rad(self) -> float:
        """The heading that it turns to."""
        return self._route.target_yaw_rad

    def enter(self, view: View) -> None:
        """Begin the takeoff."""
        self.done = False
        self._ramp_s = 0.0
        self._has_left = not view.landed
        self._start_climb(view)

    def setpoint(self, view: View) -> Setpoint:
        """Idle, rising thrust, or the climb."""
        if not self._has_left:
            if view.boot_us - view.armed_us < _SPOOL_UP_US:
                return IDLE
            self._ramp_s += view.dt_s
            if view.on_ground:
                return self._rising_thrust(view)
            self._has_left = True
            self._start_climb(view)
        settings = view.settings
        pace = Pace(
            settings.mpc_xy_cruise,
            settings.mpc_tko_speed,
            settings.mpc_z_v_auto_dn,
            settings.mpc_acc_hor,
            math.radians(settings.mpc_yawrauto_max),
            _CLIMB_M_S2,
        )
        # the height alone counts, as with PX4
        self.done = view.estimate.position_ned_m[2] - self._route.target_ned_m[2] < settings.nav_mc_alt_rad
        return self._route.step(pace, view.dt_s)

    def _rising_thrust(self, view: View) -> AttitudeSetpoint:
        ramp_s = max(view.settings.mpc_tko_ramp_t, view.dt_s)
        thrust = min(1.0, self._hover_thrust_norm * self._ramp_s / ramp_s)
        return AttitudeSetpoint(from_euler(0.0, 0.0, view.estimate.euler_rad[2]), thrust)

    def _start_climb(self, view: View) -> None:
        estimate = view.estimate
        self._route.start(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        n, e, _ = estimate.position_ned_m
        up = (math.nan, math.nan, view.home_ned_m[2] - view.settings.mis_takeoff_alt)
        tn, te, td = self._to_ned_m or up
        self._route.target_ned_m = (n if math.isnan(tn) else tn, e if math.isnan(te) else te, td)
        if not math.isnan(self._yaw_rad):
            self._route.target_yaw_rad = wrap_pi(self._yaw_rad)
