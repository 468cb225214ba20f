"""NED/FRD <-> NWU/FLU: the only place where an axis changes sign.

Half a turn about x takes one pair of frames into the other: x = N, y = -E, z = -D; roll = roll, pitch = -pitch,
yaw = -yaw; p = p, q = -q, r = -r. Each flip is its own inverse.
"""

from __future__ import annotations

import math

from mavquad.types import Vec3, Vec4


def ned_from_nwu(vector: Vec3) -> Vec3:
    """A position, velocity or acceleration, NWU to NED (or back)."""
    x, y, z = vector
    return (x, -y, -z)


nwu_from_ned = ned_from_nwu
frd_from_flu = ned_from_nwu
flu_from_frd = ned_from_nwu


def euler_flipped(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Vec3:
    """Euler angles (ZYX) of FRD-to-NED as those of FLU-to-NWU (or back)."""
    return (roll_rad, -pitch_rad, -yaw_rad)


def wrap_pi(angle_rad: float) -> float:
    """The angle in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def unwrap_near(angle_rad: float, near_rad: float) -> float:
    """The angle plus the whole turns that bring it within half a turn of `near_rad`."""
    return near_rad + wrap_pi(angle_rad - near_rad)


def unit(q: Vec4) -> Vec4 | None:
    """A quaternion of length 1; None for one that is no rotation (zeros, or not a number)."""
    length = math.sqrt(sum(part * part for part in q))
    if not 0.5 < length < 2.0:
        return None
    w, x, y, z = (part / length for part in q)
    return (w, x, y, z)


def euler_of(q: Vec4) -> Vec3:
    """Roll, pitch, yaw (ZYX) of a unit quaternion (w, x, y, z), in the frames of the quaternion."""
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
