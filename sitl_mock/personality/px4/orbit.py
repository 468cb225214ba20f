"""ORBIT (DO_ORBIT): circles round a place, looking at it."""

from __future__ import annotations

import math

from sitl_mock.geometry import Vec3
from sitl_mock.inner_loops import PositionSetpoint, Setpoint
from sitl_mock.personality.px4.hold import pace_of
from sitl_mock.personality.px4.route import Route
from sitl_mock.personality.px4.view import IDLE, View

_RADIUS_RANGE_M = (1.0, 100.0)
_MOST_M_S = 10.0
_ON_THE_CIRCLE_M = 1.0


class Orbit:
    """Flies to the nearest point of the circle and then along it; positive radii go clockwise."""

    def __init__(self) -> None:
        self._centre_ned_m: Vec3 = (math.nan, math.nan, math.nan)
        self._radius_m = 1.0
        self._rate_rad_s = 1.0
        self._route = Route()
        self._angle_rad: float | None = None

    def aim(self, centre_ned_m: Vec3, radius_m: float, speed_m_s: float) -> None:
        """The next circle; NaN: around where it is then, with PX4's own radius and speed."""
        self._centre_ned_m = centre_ned_m
        turn = -1.0 if radius_m < 0 else 1.0
        self._radius_m = min(_RADIUS_RANGE_M[1], max(_RADIUS_RANGE_M[0], _or(abs(radius_m), 1.0)))
        speed_m_s = max(-_MOST_M_S, min(_MOST_M_S, _or(speed_m_s, 1.0)))
        self._rate_rad_s = turn * speed_m_s / self._radius_m

    def enter(self, view: View) -> None:
        """Begin the circle."""
        estimate = view.estimate
        position = estimate.position_ned_m
        n, e, d = (_or(new, here) for new, here in zip(self._centre_ned_m, position, strict=True))
        self._centre_ned_m = (n, e, d)
        self._route.start(position, estimate.velocity_ned_m_s, estimate.euler_rad[2])
        away = math.atan2(position[1] - e, position[0] - n)
        self._route.target_ned_m = self._point(away)
        self._angle_rad = None

    def setpoint(self, view: View) -> Setpoint:
        """The way to the circle, then the circle."""
        if view.landed:
            return IDLE
        if self._angle_rad is None:
            n, e, _ = view.estimate.position_ned_m
            tn, te, _ = self._route.target_ned_m
            if math.hypot(n - tn, e - te) > _ON_THE_CIRCLE_M:
                return self._route.step(pace_of(view.settings), view.dt_s)
            self._angle_rad = math.atan2(te - self._centre_ned_m[1], tn - self._centre_ned_m[0])
        self._angle_rad += self._rate_rad_s * view.dt_s
        speed = self._rate_rad_s * self._radius_m
        sin, cos = math.sin(self._angle_rad), math.cos(self._angle_rad)
        return PositionSetpoint(
            self._point(self._angle_rad),
            (-speed * sin, speed * cos, 0.0),
            (-speed * self._rate_rad_s * cos, -speed * self._rate_rad_s * sin, 0.0),
            self._angle_rad + math.pi,
        )

    def _point(self, angle_rad: float) -> Vec3:
        n, e, d = self._centre_ned_m
        return (n + self._radius_m * math.cos(angle_rad), e + self._radius_m * math.sin(angle_rad), d)


def _or(value: float, default: float) -> float:
    return value if math.isfinite(value) else default
