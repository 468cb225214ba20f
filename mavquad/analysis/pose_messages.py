"""What a message says of a vehicle's pose: positions and attitudes of the kinds that logs have, as ours.

GLOBAL_POSITION_INT becomes metres north and west of an origin on a plane that touches the Earth there.
"""

from __future__ import annotations

import math

from mavquad.frames import euler_flipped, euler_of, flu_from_frd, nwu_from_ned, unit
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.messages import attitude_from
from mavquad.types import Attitude, Position, Vec3, Vec4

EARTH_RADIUS_M = 6_378_137.0
_FLU_WORLDS = (mavlink.MAV_FRAME_LOCAL_FLU,)
_BODY_FRD = (mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED)


def local_position(message: Message) -> Position | None:
    """LOCAL_POSITION_NED; None if a value is not finite."""
    ned = (message.x, message.y, message.z), (message.vx, message.vy, message.vz)
    return _position(message.time_boot_ms * 1000, *ned)


def odometry_position(message: Message) -> Position | None:
    """ODOMETRY: its velocity is the body's where its child frame says so, else the world's.

    None if a value is not finite. A world of FLU is flipped as one of FRD; where its x points is not known to a log.
    """
    place: Vec3 = (message.x, message.y, message.z)
    velocity: Vec3 = (message.vx, message.vy, message.vz)
    if message.child_frame_id in _BODY_FRD:
        velocity = rotated(_quaternion(message), velocity)
    if message.frame_id in _FLU_WORLDS:
        place, velocity = nwu_from_ned(place), nwu_from_ned(velocity)
    return _position(message.time_usec, place, velocity)


class Geodetic:
    """GLOBAL_POSITION_INT as metres from an origin (degrees east and north in 1e-7, altitude in mm); by default the first
    fix."""

    def __init__(self, origin: tuple[int, int, int] | None = None) -> None:
        self._origin = origin

    def __call__(self, message: Message) -> Position | None:
        """None for a fix at 0, 0."""
        if message.lat == 0 and message.lon == 0:
            return None
        if self._origin is None:
            self._origin = (message.lat, message.lon, message.alt)
        place = self.place_ned_m(message.lat, message.lon, message.alt)
        velocity = (message.vx * 0.01, message.vy * 0.01, message.vz * 0.01)
        return _position(message.time_boot_ms * 1000, place, velocity)

    def place_ned_m(self, lat: int, lon: int, alt_mm: float) -> Vec3:
        """North, east, down of a place; the origin must be known."""
        assert self._origin is not None
        lat0, lon0, alt0 = self._origin
        north_m = math.radians((lat - lat0) * 1e-7) * EARTH_RADIUS_M
        east_m = math.radians((lon - lon0) * 1e-7) * EARTH_RADIUS_M * math.cos(math.radians(lat0 * 1e-7))
        return (north_m, east_m, (alt0 - alt_mm) * 1e-3)


def quaternion_attitude(message: Message) -> Attitude | None:
    """ATTITUDE_QUATERNION; None if a value is not finite or it is no rotation."""
    q = (message.q1, message.q2, message.q3, message.q4)
    return _attitude(message.time_boot_ms * 1000, q, (message.rollspeed, message.pitchspeed, message.yawspeed))


def odometry_attitude(message: Message) -> Attitude | None:
    """ODOMETRY likewise."""
    rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
    return _attitude(message.time_usec, _quaternion(message), rates)


def euler_attitude(message: Message) -> Attitude | None:
    """ATTITUDE; None if a value is not finite."""
    return attitude_from(message)


def rotated(q: Vec4, vector: Vec3) -> Vec3:
    """A vector of the body's axes in the world's: v + 2 u x (u x v + w v), q = (w, u)."""
    w, x, y, z = q
    a, b, c = vector
    tx, ty, tz = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
    return (a + 2.0 * (y * tz - z * ty), b + 2.0 * (z * tx - x * tz), c + 2.0 * (x * ty - y * tx))


def _quaternion(message: Message) -> Vec4:
    w, x, y, z = message.q
    return (w, x, y, z)


def _attitude(stamp_us: int, q: Vec4, rates_frd_rad_s: Vec3) -> Attitude | None:
    turned = unit(q)
    if turned is None or not all(map(math.isfinite, rates_frd_rad_s)):
        return None
    return Attitude(stamp_us, *euler_flipped(*euler_of(turned)), flu_from_frd(rates_frd_rad_s))


def _position(stamp_us: int, place_ned_m: Vec3, velocity_ned_m_s: Vec3) -> Position | None:
    if not all(map(math.isfinite, (*place_ned_m, *velocity_ned_m_s))):
        return None
    return Position(stamp_us, nwu_from_ned(place_ned_m), nwu_from_ned(velocity_ned_m_s))
