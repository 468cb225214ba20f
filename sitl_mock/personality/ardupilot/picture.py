"""All that one tick's telemetry tells, and where on the globe it happens."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import Quaternion, Vec3
from sitl_mock.personality.ardupilot.boot import Moments
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimate

HOME_LATITUDE_DEG = -35.3632620
HOME_LONGITUDE_DEG = 149.1652370
HOME_ALTITUDE_M = 584.09
"""Where ArduPilot's SITL starts by default (Canberra); altitude above mean sea level."""
_EARTH_RADIUS_M = 6378100.0
_PARALLEL_M = _EARTH_RADIUS_M * math.cos(math.radians(HOME_LATITUDE_DEG))


@dataclass(frozen=True, slots=True)
class Picture:
    """The autopilot's state at `boot_us`.

    Attributes:
        landed_state: MAV_LANDED_STATE.
        status: MAV_STATE.
        thrust_norm: the thrust asked for, on the scale of the field `thrust`, before the angle boost.
        outputs_us: PWM of the four motors.
        target_ned_m: where the position control steers, None while it does not.
        is_position_control, is_height_control: what the mode holds.
        fence_breaches: how many times the fence was left; `is_outside` whether it is now.
        mission: the fields of MISSION_CURRENT.
        stick_us: PWM of the throttle channel.
    """

    boot_us: int
    at: Moments
    truth: VehicleState
    estimate: Estimate
    mode: Mode
    armed: bool
    ready: bool
    landed_state: int
    status: int
    home_ned_m: Vec3
    attitude_target: Quaternion
    rates_target_rad_s: Vec3
    thrust_norm: float
    outputs_us: tuple[int, int, int, int]
    target_ned_m: Vec3 | None
    target_velocity_ned_m_s: Vec3
    is_position_control: bool
    is_height_control: bool
    fence_breaches: int
    is_outside: bool
    stick_us: int
    mission: tuple[int, int, int, int]

    @property
    def boot_ms(self) -> int:
        """Stamp of ArduPilot's messages: when they are made, not when was measured what they tell."""
        return (self.boot_us // 1000) & 0xFFFFFFFF


def geodetic(place_ned_m: Vec3) -> tuple[int, int]:
    """(latitude, longitude) of a place in degrees times 1e7, on a sphere around home."""
    latitude = HOME_LATITUDE_DEG + math.degrees(place_ned_m[0] / _EARTH_RADIUS_M)
    longitude = HOME_LONGITUDE_DEG + math.degrees(place_ned_m[1] / _PARALLEL_M)
    return int32(latitude * 1e7), int32(longitude * 1e7)


def north_east(latitude_e7: float, longitude_e7: float) -> tuple[float, float]:
    """(north, east) of home in m: the inverse of `geodetic`."""
    north = math.radians(latitude_e7 / 1e7 - HOME_LATITUDE_DEG) * _EARTH_RADIUS_M
    return north, math.radians(longitude_e7 / 1e7 - HOME_LONGITUDE_DEG) * _PARALLEL_M


def int32(value: float) -> int:
    """Rounded, and kept within four bytes."""
    return max(-(2**31), min(2**31 - 1, round(value)))


def int16(value: float) -> int:
    """Rounded, and kept within two bytes."""
    return max(-32768, min(32767, round(value)))


def uint16(value: float) -> int:
    """Rounded, and kept within two bytes without a sign."""
    return max(0, min(65535, round(value)))
