"""A smooth way to a place: limited speed and acceleration, horizontally and vertically on their own; and to a heading.

The speed towards the target is the cruise speed, or what still stops there, v = sqrt(2 a s); the velocity changes by no
more than a dt in one tick. Position and velocity are both given to the position control, which follows closely.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import ZERO3, Vec3, wrap_pi
from sitl_mock.inner_loops import PositionSetpoint

_BRAKING_SHARE = 0.6
"""Part of the acceleration that braking is planned with; the rest keeps it on time."""
_THERE_M = 0.01
_STOPPING_S = 0.5


@dataclass(frozen=True, slots=True)
class Pace:
    """Speeds in m/s, accelerations in m/s^2 (the one along the earth, the one up and down), yaw rate in rad/s."""

    cruise_m_s: float
    climb_m_s: float
    sink_m_s: float
    acceleration_m_s2: float
    yaw_rate_rad_s: float
    vertical_m_s2: float = 1.5


class Route:
    """Where the setpoint is on its way.

    Attributes:
        target_ned_m: where it goes.
        target_yaw_rad: the heading that it turns to.
    """

    def __init__(self) -> None:
        self._position: Vec3 = ZERO3
        self._velocity: Vec3 = ZERO3
        self._yaw_rad = 0.0
        self.target_ned_m: Vec3 = ZERO3
        self.target_yaw_rad = 0.0

    def start(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3, yaw_rad: float) -> None:
        """Begin here, with this velocity; the target is where it takes to stop."""
        self._position, self._velocity, self._yaw_rad = position_ned_m, velocity_ned_m_s, wrap_pi(yaw_rad)
        (n, e, d), (vn, ve, vd) = position_ned_m, velocity_ned_m_s
        self.target_ned_m = (n + _STOPPING_S * vn, e + _STOPPING_S * ve, d + _STOPPING_S * vd)
        self.target_yaw_rad = self._yaw_rad

    def hold(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3, yaw_rad: float) -> None:
        """Stay where it comes to rest from here."""
        self.start(position_ned_m, velocity_ned_m_s, yaw_rad)
        self._position, self._velocity = self.target_ned_m, ZERO3

    def face(self, from_ned_m: Vec3, least_m: float) -> None:
        """Look to where it goes, unless that is closer than `least_m`."""
        north, east = self.target_ned_m[0] - from_ned_m[0], self.target_ned_m[1] - from_ned_m[1]
        if math.hypot(north, east) > least_m:
            self.target_yaw_rad = math.atan2(east, north)

    def step(self, pace: Pace, dt_s: float) -> PositionSetpoint:
        """Go on for one tick."""
        if self._position != self.target_ned_m:
            self._advance(pace, dt_s)
        if self._yaw_rad != self.target_yaw_rad:
            turn = wrap_pi(self.target_yaw_rad - self._yaw_rad)
            most = pace.yaw_rate_rad_s * dt_s
            self._yaw_rad = self.target_yaw_rad if abs(turn) <= most else self._yaw_rad + math.copysign(most, turn)
        return PositionSetpoint(self._position, self._velocity, yaw_rad=self._yaw_rad)

    def _advance(self, pace: Pace, dt_s: float) -> None:
        (n, e, d), (vn, ve, vd) = self._position, self._velocity
        tn, te, td = self.target_ned_m
        left_m = math.hypot(tn - n, te - e)
        if left_m < _THERE_M and math.hypot(vn, ve) < 0.1:
            n, e, vn, ve = tn, te, 0.0, 0.0
        else:
            speed = min(pace.cruise_m_s, math.sqrt(2 * _BRAKING_SHARE * pace.acceleration_m_s2 * left_m))
            share = speed / left_m if left_m > 0 else 0.0
            vn, ve = _approached(vn, ve, share * (tn - n), share * (te - e), pace.acceleration_m_s2 * dt_s)
            n, e = n + vn * dt_s, e + ve * dt_s
        d, vd = _vertical(d, vd, td, pace, dt_s)
        self._position, self._velocity = (n, e, d), (vn, ve, vd)


def _approached(vn: float, ve: float, wanted_n: float, wanted_e: float, most: float) -> tuple[float, float]:
    dn, de = wanted_n - vn, wanted_e - ve
    change = math.hypot(dn, de)
    if change <= most:
        return wanted_n, wanted_e
    return vn + dn * most / change, ve + de * most / change


def _vertical(d: float, vd: float, target: float, pace: Pace, dt_s: float) -> tuple[float, float]:
    left_m = target - d
    if abs(left_m) < _THERE_M and abs(vd) < 0.1:
        return target, 0.0
    limit = pace.sink_m_s if left_m > 0 else pace.climb_m_s
    speed = min(limit, math.sqrt(2 * _BRAKING_SHARE * pace.vertical_m_s2 * abs(left_m)))
    change = math.copysign(speed, left_m) - vd
    most = pace.vertical_m_s2 * dt_s
    vd += max(-most, min(most, change))
    return d + vd * dt_s, vd
