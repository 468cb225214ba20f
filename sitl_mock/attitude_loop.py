"""The attitude P controller, tilt before yaw; after PX4's multicopter attitude control.

With q the attitude and q_d the one asked for (FRD to NED), q_d = q q_t q_y is split: the tilt q_t is the shortest
turn of the body, about an axis across its z, that brings its z axis to that of q_d; what remains is q_y, a turn by
the angle a about that axis. Thrust points where it should after q_t alone, so the weak yaw may lag:

    e = q_t q_y(w a),   rates = 2 (P_roll, P_pitch, P_yaw / w) * vec(e) sign(e_0),   w the yaw weight,

which for a small yaw error alone is P_yaw a. A yaw rate asked for besides, about the vertical, is added as
feed-forward: R(q)^T e3 times it. Each axis of the sum is then limited.
"""

from __future__ import annotations

import math

from sitl_mock.geometry import ZERO3, Quaternion, Vec3, conjugate, multiply, normalised, rotate

_OPPOSITE = 1e-5
"""Part of a half turn's cosine within which the shortest turn has no definite axis."""


def wanted_rates(
    attitude: Quaternion, wanted: Quaternion, yaw_rate_rad_s: float, gains: Vec3, yaw_weight: float, limits: Vec3
) -> Vec3:
    """Body rates in rad/s (FRD) towards a finite, non-zero quaternion; gains in 1/s, limits in rad/s."""
    back = conjugate(attitude)
    e = _weighted(multiply(back, normalised(wanted)), yaw_weight)
    twice = 2.0 if e[0] >= 0 else -2.0
    down = rotate(back, (0.0, 0.0, yaw_rate_rad_s)) if yaw_rate_rad_s else ZERO3
    return (
        _limited(twice * gains[0] * e[1] + down[0], limits[0]),
        _limited(twice * gains[1] * e[2] + down[1], limits[1]),
        _limited(twice * gains[2] / yaw_weight * e[3] + down[2], limits[2]),
    )


def _weighted(error: Quaternion, yaw_weight: float) -> Quaternion:
    """The error with its yaw part scaled.

    Of e = q_t q_y with q_t = (c, x, y, 0) and q_y = (cos a/2, 0, 0, sin a/2): c = hypot(e_0, e_3) and
    a/2 = atan2(e_3, e_0). For a half turn of tilt c is 0, the split is not defined, and the error stays whole.
    """
    w, _, _, z = error
    if math.hypot(w, z) < _OPPOSITE:
        return error
    half_rad = math.atan2(z, w) if w >= 0 else math.atan2(-z, -w)
    turn_back = (yaw_weight - 1.0) * half_rad
    return multiply(error, (math.cos(turn_back), 0.0, 0.0, math.sin(turn_back)))


def _limited(value: float, limit: float) -> float:
    return -limit if value < -limit else limit if value > limit else value
