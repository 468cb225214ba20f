"""Guards of the motion: speed, and an estimate that jumps.

An estimator's reset moves the pose at once, by what the motion cannot explain. Between two samples dt apart, with the
velocities v0 and v1 and an acceleration of at most A, the trapezoid misses the way by

    |p1 - p0 - (v0 + v1) dt / 2| = |integral of (dt/2 - s) a(s) ds| <= A dt^2 / 4,       |v1 - v0| <= A dt

and what is beyond that and the limit is a jump. Yaw likewise, with the rate of the Euler angle that the body rates amount to.
"""

from __future__ import annotations

import math

from pydantic import Field

from mavquad.flight.guard_types import GuardSection, Tripped
from mavquad.frames import wrap_pi
from mavquad.types import Attitude, Position

_ACCELERATION_M_S2 = 25.0
"""No quadcopter that is flown by the law is accelerated more (2 g of thrust, less its weight, plus wind)."""
_LONGEST_GAP_S = 1.0
"""After a gap as long as this nothing is said about the motion in between."""
_YAW_ACCELERATION_RAD_S2 = 20.0
"""Nor does it begin to turn faster than this."""
_GIMBAL_LOCK = 0.2
"""Least cosine of the pitch that is divided by: near the vertical, yaw is not well defined."""


class SpeedParams(GuardSection):
    """[guards.speed]"""

    limit_m_s: float = Field(default=10.0, ge=0.0, le=100.0)
    """Speed that the autopilot estimates, m/s, three-dimensional; 0: off."""


def fast(params: SpeedParams, position: Position) -> Tripped | None:
    """The speed is beyond its limit.

    Args:
        params: the limit.
        position: with the velocity, as measured.
    """
    speed_m_s = math.hypot(*position.velocity_nwu_m_s)
    if not 0.0 < params.limit_m_s < speed_m_s:
        return None
    return Tripped("speed", f"{speed_m_s:.1f} m/s, {params.limit_m_s:g} allowed", params.reaction)


class JumpParams(GuardSection):
    """[guards.jump]"""

    position_m: float = Field(default=0.5, ge=0.0, le=100.0)
    """Jump of the position between two samples that the velocity does not explain, m; 0: off."""
    velocity_m_s: float = Field(default=3.0, ge=0.0, le=100.0)
    """Jump of the velocity that no acceleration of such a vehicle explains, m/s; 0: off."""
    yaw_deg: float = Field(default=20.0, ge=0.0, le=180.0)
    """Jump of the yaw that the body rates do not explain, deg; 0: off."""


class JumpMonitor:
    """Compares each sample with the one before it; the first says nothing."""

    def __init__(self, params: JumpParams) -> None:
        self._params = params
        self._position: Position | None = None
        self._attitude: Attitude | None = None
        self._yaw_rate_rad_s = 0.0

    def take_position(self, position: Position) -> Tripped | None:
        """The next sample of the position, newer than the last."""
        before, self._position = self._position, position
        dt_s = (position.stamp_us - before.stamp_us) * 1e-6 if before else 0.0
        if before is None or not 0.0 < dt_s < _LONGEST_GAP_S:
            return None
        slack_m = 0.25 * _ACCELERATION_M_S2 * dt_s * dt_s
        jump_m = max(0.0, _unexplained_m(before, position, dt_s) - slack_m)
        if 0.0 < self._params.position_m < jump_m:
            return self._tripped(f"the position jumped by {jump_m:.1f} m, {self._params.position_m:g} allowed")
        change_m_s = math.dist(position.velocity_nwu_m_s, before.velocity_nwu_m_s)
        jump_m_s = change_m_s - _ACCELERATION_M_S2 * dt_s
        if 0.0 < self._params.velocity_m_s < jump_m_s:
            return self._tripped(f"the velocity jumped by {jump_m_s:.1f} m/s, {self._params.velocity_m_s:g} allowed")
        return None

    def take_attitude(self, attitude: Attitude) -> Tripped | None:
        """The next sample of the attitude, newer than the last."""
        before, self._attitude = self._attitude, attitude
        rate_before_rad_s, self._yaw_rate_rad_s = self._yaw_rate_rad_s, _yaw_rate_rad_s(attitude)
        dt_s = (attitude.stamp_us - before.stamp_us) * 1e-6 if before else 0.0
        if before is None or not 0.0 < dt_s < _LONGEST_GAP_S:
            return None
        rate_rad_s = 0.5 * (rate_before_rad_s + self._yaw_rate_rad_s)
        slack_rad = 0.25 * _YAW_ACCELERATION_RAD_S2 * dt_s * dt_s
        unexplained_rad = wrap_pi(attitude.yaw_rad - before.yaw_rad - rate_rad_s * dt_s)
        jump_deg = math.degrees(abs(unexplained_rad) - slack_rad)
        if 0.0 < self._params.yaw_deg < jump_deg:
            return self._tripped(f"the yaw jumped by {jump_deg:.0f} degrees, {self._params.yaw_deg:g} allowed")
        return None

    def _tripped(self, words: str) -> Tripped:
        return Tripped("jump", f"the autopilot's estimate was reset: {words}", self._params.reaction)


def _unexplained_m(before: Position, after: Position, dt_s: float) -> float:
    """Distance from where the mean velocity leads."""
    p0, v0, p1, v1 = before.position_nwu_m, before.velocity_nwu_m_s, after.position_nwu_m, after.velocity_nwu_m_s
    half_s = 0.5 * dt_s
    return math.hypot(
        p1[0] - p0[0] - half_s * (v0[0] + v1[0]),
        p1[1] - p0[1] - half_s * (v0[1] + v1[1]),
        p1[2] - p0[2] - half_s * (v0[2] + v1[2]),
    )


def _yaw_rate_rad_s(attitude: Attitude) -> float:
    """Rate of the Euler angle: (q sin(roll) + r cos(roll)) / cos(pitch)."""
    _, q, r = attitude.rates_flu_rad_s
    cos_pitch = max(math.cos(attitude.pitch_rad), _GIMBAL_LOCK)
    return (q * math.sin(attitude.roll_rad) + r * math.cos(attitude.roll_rad)) / cos_pitch
