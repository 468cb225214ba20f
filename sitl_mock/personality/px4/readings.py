"""What PX4's SIH has of sensors that the mock does not simulate: GPS, barometer, magnetometer; drawn around the estimate.

Standard deviations as recorded from SIH: of the shaking in flight (an accelerometer's alone, not an estimator's), of the
others standing on the ground.
"""

from __future__ import annotations

import math
import random
from typing import NamedTuple

from sitl_mock.config import Px4Release
from sitl_mock.geodesy import Origin
from sitl_mock.geometry import Vec3, conjugate, rotate
from sitl_mock.sensors import Estimate

_GPS_HORIZONTAL_M, _GPS_VERTICAL_M, _GPS_SPEED_M_S = 0.2, 0.5, 0.067
_FIELD_NOISE_GAUSS: Vec3 = (0.012, 0.012, 0.021)
_SHAKING_M_S2: Vec3 = (0.3, 1.0, 0.85)
_USUAL_NOISE_M_S2 = 0.07
_PAIRS = 12


class Normals:
    """Standard normal numbers, made some at a time: those of Python's `Random.gauss` (Box and Muller, in pairs)."""

    def __init__(self, seed: str) -> None:
        self._random = random.Random(seed)
        self._ready: list[float] = []

    def take(self, count: int) -> list[float]:
        """The next ones, a few."""
        if len(self._ready) < count:
            self._ready += self._made()
        found, self._ready = self._ready[:count], self._ready[count:]
        return found

    def _made(self) -> list[float]:
        uniform, made = self._random.random, []
        for _ in range(_PAIRS):
            turn = uniform() * math.tau
            size = math.sqrt(-2.0 * math.log(1.0 - uniform()))
            made += [math.cos(turn) * size, math.sin(turn) * size]
        return made


class GpsFix(NamedTuple):
    """One fix; altitude above mean sea level."""

    stamp_us: int
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    velocity_ned_m_s: Vec3


class _Site(NamedTuple):
    """What depends on the release: its place on earth, and how its simulator publishes."""

    field_ned_gauss: Vec3
    barometer_noise_m: float
    barometer_us: int
    magnetometer_us: int
    gps_us: int


_LOCKSTEP = _Site((0.218, 0.012, 0.428), 0.06, 100_000, 70_000, 125_000)
_SITES: dict[Px4Release, _Site] = {
    "1.13": _Site((0.174, -0.043, 0.508), 0.147, 50_800, 73_000, 50_710),
    **dict.fromkeys(("1.14", "1.15", "1.16", "1.17"), _LOCKSTEP),
}


class Readings:
    """Draws the readings, from a generator of its own whose seed is the first estimate's position, noise included.

    The shaking goes with `accelerometer_noise_m_s2`, the configured noise of the accelerometer at rest.
    """

    def __init__(
        self, release: Px4Release, origin: Origin, estimate: Estimate, accelerometer_noise_m_s2: float
    ) -> None:
        self._shaking = accelerometer_noise_m_s2 / _USUAL_NOISE_M_S2
        self._site = _SITES[release]
        self._origin = origin
        self._normals = Normals(repr(estimate.position_ned_m))
        self._fix: GpsFix | None = None
        self._sample = self._last_barometer = self._last_magnetometer = -1

    def gps(self, estimate: Estimate, boot_us: int) -> GpsFix:
        """The latest fix."""
        sample = boot_us // self._site.gps_us
        if self._fix is None or sample != self._sample:
            self._sample = sample
            self._fix = self._new_fix(estimate, boot_us)
        return self._fix

    def _new_fix(self, estimate: Estimate, boot_us: int) -> GpsFix:
        n1, n2, n3, n4, n5, n6 = self._normals.take(6)
        north, east, down = estimate.position_ned_m
        noisy = (north + n1 * _GPS_HORIZONTAL_M, east + n2 * _GPS_HORIZONTAL_M, down + n3 * _GPS_VERTICAL_M)
        vn, ve, vd = estimate.velocity_ned_m_s
        velocity = (vn + n4 * _GPS_SPEED_M_S, ve + n5 * _GPS_SPEED_M_S, vd + n6 * _GPS_SPEED_M_S)
        return GpsFix(boot_us, *self._origin.geographic(noisy), velocity)

    def shaken(self, specific_force_frd_m_s2: Vec3, is_flying: bool) -> Vec3:
        """What the accelerometer measures."""
        if not is_flying:
            return specific_force_frd_m_s2
        (x, y, z), (sx, sy, sz) = specific_force_frd_m_s2, _SHAKING_M_S2
        (n1, n2, n3), share = self._normals.take(3), self._shaking
        return x + n1 * (share * sx), y + n2 * (share * sy), z + n3 * (share * sz)

    def pressure_altitude_m(self, estimate: Estimate) -> float:
        """What the barometer makes of the altitude."""
        [error] = self._normals.take(1)
        return self._origin.altitude_m - estimate.position_ned_m[2] + error * self._site.barometer_noise_m

    def magnetic_field_frd_gauss(self, estimate: Estimate) -> Vec3:
        """The earth's field as the body has it."""
        x, y, z = rotate(conjugate(estimate.quaternion), self._site.field_ned_gauss)
        (n1, n2, n3), (sx, sy, sz) = self._normals.take(3), _FIELD_NOISE_GAUSS
        return x + n1 * sx, y + n2 * sy, z + n3 * sz

    def is_new(self, boot_us: int) -> tuple[bool, bool]:
        """Whether barometer and magnetometer have measured since this was asked last."""
        barometer, magnetometer = boot_us // self._site.barometer_us, boot_us // self._site.magnetometer_us
        new = barometer != self._last_barometer, magnetometer != self._last_magnetometer
        self._last_barometer, self._last_magnetometer = barometer, magnetometer
        return new


def standard_pressure_pa(altitude_m: float) -> float:
    """The standard atmosphere's pressure, below 11 km: p = p0 (1 - L h / T0)^(g / (R L))."""
    share = 1.0 - 0.0065 * max(-5000.0, min(11_000.0, altitude_m)) / 288.15
    return 101_325.0 * math.pow(share, 5.25588)


def standard_temperature_c(altitude_m: float) -> float:
    """The standard atmosphere's temperature, below 11 km."""
    return 15.0 - 0.0065 * max(-5000.0, min(11_000.0, altitude_m))
