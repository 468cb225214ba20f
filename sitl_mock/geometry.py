"""The mock's own rotations: unit quaternions (w, x, y, z) that turn body FRD into world NED.

Written independently of the agent's frames, so that a sign error in one of them cannot cancel itself in the other.
"""

from __future__ import annotations

import math

Vec3 = tuple[float, float, float]
Vec4 = tuple[float, float, float, float]
Quaternion = tuple[float, float, float, float]

ZERO3: Vec3 = (0.0, 0.0, 0.0)
IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)


def from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """The attitude Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def to_euler(q: Quaternion) -> Vec3:
    """(roll, pitch, yaw) in rad of R = Rz(yaw) Ry(pitch) Rx(roll); pitch within +-pi/2."""
    w, x, y, z = q
    sin_pitch = 2 * (w * y - z * x)
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(sin_pitch) if -1.0 <= sin_pitch <= 1.0 else math.copysign(math.pi / 2, sin_pitch),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def normalised(q: Quaternion) -> Quaternion:
    """The unit quaternion along `q`; identity for zero."""
    w, x, y, z = q
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm) if norm > 0 else IDENTITY


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product: first `b`, then `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """The inverse turn of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


def rotate(q: Quaternion, v_frd: Vec3) -> Vec3:
    """A body vector in NED: v + 2 w (u x v) + 2 u x (u x v), u the vector part of `q`."""
    w, x, y, z = q
    a, b, c = v_frd
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)


def down_axis(q: Quaternion) -> Vec3:
    """The body's z axis in NED: R e3."""
    w, x, y, z = q
    return (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))


def turned(q: Quaternion, rates_frd_rad_s: Vec3, dt_s: float) -> Quaternion:
    """The attitude after turning at constant body rates: q exp(a), a = w dt / 2.

    Cosine and sine of |a| by their series, to 1e-9 for 50 rad/s and 4 ms; one Newton step back to unit length.
    """
    (w, x, y, z), (a, b, c) = q, rates_frd_rad_s
    half = 0.5 * dt_s
    a, b, c = half * a, half * b, half * c
    s = a * a + b * b + c * c
    k = 1.0 - s * (1 / 6 - s / 120)
    a, b, c, k = k * a, k * b, k * c, 1.0 - s * (0.5 - s / 24)
    w, x, y, z = (
        k * w - a * x - b * y - c * z,
        k * x + a * w + c * y - b * z,
        k * y + b * w + a * z - c * x,
        k * z + c * w + b * x - a * y,
    )
    k = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return (k * w, k * x, k * y, k * z)


def tilt_rad(q: Quaternion) -> float:
    """Angle between the body's z axis and the vertical, 0 (level) to pi (upside down)."""
    return math.acos(max(-1.0, min(1.0, 1 - 2 * (q[1] * q[1] + q[2] * q[2]))))


def yaw_of(q: Quaternion) -> float:
    """Heading of `q` in rad, -pi to pi."""
    return math.atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))


def wrap_pi(angle_rad: float) -> float:
    """The same angle within [-pi, pi)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi
