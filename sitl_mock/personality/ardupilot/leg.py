"""A leg of a mission or of a return: from rest to rest on a straight line, in the shortest time within limits.

The speed v, the acceleration a and the jerk j (WPNAV_JERK) along the leg are limited. Speeding up to v takes

    v / a' + a' / j,   a' = min(a, sqrt(v j)),

and half of v times that of the way; so does slowing down. A leg too short for that reaches the speed at which both
together are the whole way: v^3 = d^2 j / 4 while the jerk alone limits it, else v^2 / a + v a / j = d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import ZERO3, Vec3

_PAUSING_PER_S = 0.4
"""How fast the pace along a leg goes down to 0 in a pause, and up again."""


@dataclass(frozen=True, slots=True)
class Leg:
    """From a place to another, NED; `speed_m_s`, `acceleration_m_s2` are those reached on the way."""

    start_ned_m: Vec3
    direction_ned: Vec3
    length_m: float
    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float

    @classmethod
    def between(
        cls, start_ned_m: Vec3, goal_ned_m: Vec3, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float
    ) -> Leg:
        """The leg within these limits, all above 0."""
        way = [goal - start for start, goal in zip(start_ned_m, goal_ned_m, strict=True)]
        length = math.hypot(*way)
        if length < 1e-6:
            return cls(goal_ned_m, ZERO3, 0.0, speed_m_s, acceleration_m_s2, jerk_m_s3)
        a, j = acceleration_m_s2, jerk_m_s3
        speed = math.cbrt(length * length * j / 4.0)
        if speed * j > a * a:
            speed = (math.sqrt((a * a / j) ** 2 + 4.0 * a * length) - a * a / j) / 2.0
        speed = min(speed, speed_m_s)
        direction = (way[0] / length, way[1] / length, way[2] / length)
        return cls(start_ned_m, direction, length, speed, min(a, math.sqrt(speed * j)), j)

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return self._ramp_s + self.length_m / self.speed_m_s if self.length_m > 0.0 else 0.0

    @property
    def _ramp_s(self) -> float:
        return self.speed_m_s / self.acceleration_m_s2 + self.acceleration_m_s2 / self.jerk_m_s3

    def remaining_m(self, time_s: float) -> float:
        """The way that is left."""
        return self.length_m - self._along(time_s)[0]

    def at(self, time_s: float) -> tuple[Vec3, Vec3, Vec3]:
        """(position, velocity, acceleration) so long after the start."""
        (n, e, d), (dn, de, dd) = self.start_ned_m, self.direction_ned
        s, v, a = self._along(time_s)
        return (n + s * dn, e + s * de, d + s * dd), (v * dn, v * de, v * dd), (a * dn, a * de, a * dd)

    def _along(self, time_s: float) -> tuple[float, float, float]:
        left_s = self.duration_s - time_s
        if left_s <= 0.0:
            return self.length_m, 0.0, 0.0
        if left_s < time_s:  # the second half is the first one backwards
            s, v, a = self._speeding_up(left_s)
            return self.length_m - s, v, -a
        return self._speeding_up(time_s)

    def _speeding_up(self, t: float) -> tuple[float, float, float]:
        v, a, j, ramp_s = self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3, self._ramp_s
        jerk_s = a / j
        if t >= ramp_s:
            return v * (t - ramp_s / 2.0), v, 0.0
        if t < jerk_s:
            return j * t**3 / 6.0, j * t * t / 2.0, j * t
        if t < ramp_s - jerk_s:
            since = t - jerk_s
            return (
                a * jerk_s**2 / 6.0 + a * jerk_s * since / 2.0 + a * since * since / 2.0,
                a * (jerk_s / 2.0 + since),
                a,
            )
        left = ramp_s - t
        return v * (t - ramp_s / 2.0) + j * left**3 / 6.0, v - j * left * left / 2.0, j * left


class Route:
    """Where the vehicle is on its leg, and the end of the leg before, which is still slowing down.

    Attributes:
        remaining_m: the way left on the leg.
        is_paused: it slows down, and stays.
    """

    def __init__(self, leg: Leg, before: Route | None = None) -> None:
        self._leg = leg
        self._before = before
        self._time_s = 0.0
        self._pace = 1.0
        self.is_paused = False

    @property
    def remaining_m(self) -> float:
        """The way left on the leg."""
        return self._leg.remaining_m(self._time_s)

    @property
    def is_over(self) -> bool:
        """Whether the target is at the leg's end."""
        return self._time_s >= self._leg.duration_s

    def go_on(self, dt_s: float) -> tuple[Vec3, Vec3, Vec3]:
        """(position, velocity, acceleration) of the target after one more tick."""
        step = _PAUSING_PER_S * dt_s
        self._pace = max(0.0, self._pace - step) if self.is_paused else min(1.0, self._pace + step)
        self._time_s += self._pace * dt_s
        place, velocity, acceleration = self._leg.at(self._time_s)
        velocity = _scaled(self._pace, velocity)
        if self._before is None:
            return place, velocity, acceleration
        before_place, before_velocity, before_acceleration = self._before.go_on(dt_s)
        if self._before.is_over:
            self._before = None
            return place, velocity, acceleration
        behind = tuple(here - end for here, end in zip(before_place, self._leg.start_ned_m, strict=True))
        return (
            _added(place, behind),
            _added(velocity, before_velocity),
            _added(acceleration, before_acceleration),
        )


def _scaled(factor: float, vector: Vec3) -> Vec3:
    return (factor * vector[0], factor * vector[1], factor * vector[2])


def _added(vector: Vec3, other: tuple[float, ...]) -> Vec3:
    return (vector[0] + other[0], vector[1] + other[1], vector[2] + other[2])
