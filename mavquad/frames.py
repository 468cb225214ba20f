"""NED/FRD <-> NWU/FLU: the only place where an axis changes sign.

Half a turn about x takes one pair of frames into the other: x = N, y = -E, z = -D; roll = roll, pitch = -pitch,
yaw = -yaw; p = p, q = -q, r = -r. Each flip is its own inverse.
"""

from __future__ import annotations

import math

from mavquad.types import Vec3


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
