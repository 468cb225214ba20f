"""Local and geographic positions: the azimuthal equidistant projection of a sphere, as PX4 and its SIH have it.

Distances and directions from the origin are true. With c the angle at the centre of the sphere between the origin
(latitude phi0, longitude lambda0) and a place, R c its distance and (north, east) = R c (cos az, sin az):
    sin phi = cos c sin phi0 + sin c cos phi0 cos az
    tan(lambda - lambda0) = sin c sin az / (cos phi0 cos c - sin phi0 sin c cos az)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from sitl_mock.geometry import Vec3

_EARTH_RADIUS_M = 6371000.0


@dataclass(frozen=True, slots=True)
class Origin:
    """The place of local position (0, 0, 0); its altitude is above mean sea level, which is taken for the ellipsoid."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    _sin_phi0: float = field(init=False, repr=False, compare=False)
    _cos_phi0: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        phi0 = math.radians(self.latitude_deg)
        object.__setattr__(self, "_sin_phi0", math.sin(phi0))
        object.__setattr__(self, "_cos_phi0", math.cos(phi0))

    def geographic(self, position_ned_m: Vec3) -> tuple[float, float, float]:
        """Latitude and longitude in degrees, and altitude in m."""
        north, east, down = position_ned_m
        angle = math.hypot(north, east) / _EARTH_RADIUS_M
        if angle == 0.0:
            return self.latitude_deg, self.longitude_deg, self.altitude_m - down
        azimuth = math.atan2(east, north)
        sin_phi0, cos_phi0 = self._sin_phi0, self._cos_phi0
        sin_c, cos_c, cos_azimuth = math.sin(angle), math.cos(angle), math.cos(azimuth)
        sin_phi = cos_c * sin_phi0 + sin_c * cos_phi0 * cos_azimuth
        turn = math.atan2(sin_c * math.sin(azimuth), cos_phi0 * cos_c - sin_phi0 * sin_c * cos_azimuth)
        latitude = math.asin(max(-1.0, min(1.0, sin_phi)))
        longitude = (self.longitude_deg + math.degrees(turn) + 180.0) % 360.0 - 180.0
        return math.degrees(latitude), longitude, self.altitude_m - down

    def local(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vec3:
        """Position NED in m; the inverse of `geographic`."""
        phi0, phi = math.radians(self.latitude_deg), math.radians(latitude_deg)
        turn = math.radians(longitude_deg - self.longitude_deg)
        # The direction of the place in the axes north, east, up of the origin.
        towards_north = math.cos(phi0) * math.sin(phi) - math.sin(phi0) * math.cos(phi) * math.cos(turn)
        towards_east = math.cos(phi) * math.sin(turn)
        towards_up = math.sin(phi0) * math.sin(phi) + math.cos(phi0) * math.cos(phi) * math.cos(turn)
        sin_c = math.hypot(towards_north, towards_east)
        down = self.altitude_m - altitude_m
        if sin_c == 0.0:
            return 0.0, 0.0, down
        reach_m = _EARTH_RADIUS_M * math.atan2(sin_c, towards_up) / sin_c
        return reach_m * towards_north, reach_m * towards_east, down
