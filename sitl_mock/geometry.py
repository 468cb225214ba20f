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
    sin_pitch = max(-1.0, min(1.0, 2 * (w * y - z * x)))
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(sin_pitch),
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


def tilt_rad(q: Quaternion) -> float:
    """Angle between the body's z axis and the vertical, 0 (level) to pi (upside down)."""
    return math.acos(max(-1.0, min(1.0, 1 - 2 * (q[1] * q[1] + q[2] * q[2]))))


def yaw_of(q: Quaternion) -> float:
    """Heading of `q` in rad, -pi to pi."""
    return math.atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))


def wrap_pi(angle_rad: float) -> float:
    """The same angle within [-pi, pi)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi
