"""AUTO.LOITER: stay where it stops, or go where DO_REPOSITION says and stay there; and the pace of PX4's own flying."""

from __future__ import annotations

import math

from sitl_mock.geometry import Vec3, wrap_pi
from sitl_mock.inner_loops import Setpoint
from sitl_mock.personality.px4.route import Pace, Route
from sitl_mock.personality.px4.settings import Settings
from sitl_mock.personality.px4.view import IDLE, View


def pace_of(settings: Settings, cruise_m_s: float | None = None) -> Pace:
    """How briskly PX4 flies by itself, at its own or at a given cruise speed."""
    return Pace(
        min(settings.mpc_xy_cruise if cruise_m_s is None else cruise_m_s, settings.mpc_xy_vel_max),
        settings.mpc_z_v_auto_up,
        settings.mpc_z_v_auto_dn,
        settings.mpc_acc_hor,
        math.radians(settings.mpc_yawrauto_max),
    )


class Hold:
    """Holds a place."""

    def __init__(self) -> None:
        self._route = Route()
        self._pace: Pace | None = None
        self.cruise_m_s: float | None = None

    def enter(self, view: View) -> None:
        """Stop and stay."""
        estimate = view.estimate
        self._route.hold(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        self._pace = None

    def go_to(self, to_ned_m: Vec3, yaw_rad: float, view: View) -> None:
        """Fly to a place; a coordinate that is NaN stays, a yaw that is NaN looks ahead."""
        estimate = view.estimate
        held = self._route.target_ned_m
        self._route.start(estimate.position_ned_m, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        n, e, d = (old if math.isnan(new) else new for old, new in zip(held, to_ned_m, strict=True))
        self._route.target_ned_m = (n, e, d)
        if math.isnan(yaw_rad):
            self._route.face(estimate.position_ned_m, view.settings.nav_acc_rad)
        else:
            self._route.target_yaw_rad = wrap_pi(yaw_rad)
        self._pace = pace_of(view.settings, self.cruise_m_s)

    def setpoint(self, view: View) -> Setpoint:
        """The place that is held, or the way there."""
        if view.landed:
            return IDLE
        if self._pace is None:
            self._pace = pace_of(view.settings, self.cruise_m_s)
        return self._route.step(self._pace, view.dt_s)
