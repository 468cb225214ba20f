"""What the autopilot's estimator says: the truth of a moment ago, with white noise and a slow position wander.

    estimate(t) = truth(t - age) + noise,   noise = white(sd) + wander(t)

The wander is an Ornstein-Uhlenbeck process of standard deviation s and correlation time T, discretised exactly:
w[k+1] = a w[k] + s sqrt(1 - a^2) n[k], a = exp(-dt / T); it starts from its stationary distribution.
"""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass

from sitl_mock.battery import FULL, Battery
from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.geometry import ZERO3, Quaternion, Vec3, from_euler, normalised, to_euler
from sitl_mock.plant import VehicleState


@dataclass(frozen=True, slots=True)
class Estimate:
    """The estimator's output, NED and FRD; `stamp_us` is the time of the sample since boot, not of its publication.

    Attributes:
        specific_force_frd_m_s2: what the accelerometer shows, (0, 0, -g) at rest on level ground.
        battery: what is measured of the battery.
        reset_count: how many times the position has jumped.
    """

    stamp_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    quaternion: Quaternion
    euler_rad: Vec3
    rates_frd_rad_s: Vec3
    specific_force_frd_m_s2: Vec3 = (0.0, 0.0, -9.81)
    battery: Battery = FULL
    reset_count: int = 0


class Estimator:
    """Turns the truth of each tick into an `Estimate`; draws from its own seeded generator, the same number each tick."""

    def __init__(self, config: SensorsConfig, seed: int) -> None:
        self._config = config
        self._random = random.Random(seed)
        self._history: deque[tuple[int, VehicleState]] = deque()
        self._wander_m = _noisy(ZERO3, config.position_wander_m, self._normals(), 0)
        self._attitude_noise_rad = math.radians(config.attitude_noise_deg)
        self._offset_m = ZERO3
        self._reset_count = 0
        self._battery = FULL

    def step(self, truth: VehicleState, boot_us: int, dt_s: float) -> Estimate:
        """The estimate published at `boot_us`, given the truth of that moment; `dt_s` is the time since the last."""
        config = self._config
        self._history.append((boot_us, truth))
        sample_us = max(0, boot_us - config.age_ms * 1000)
        position, velocity, quaternion, rates = self._truth_at(sample_us)
        normals = self._normals()
        self._drift(dt_s, normals)
        x, y, z = position
        dx, dy, dz = (a + b for a, b in zip(self._wander_m, self._offset_m, strict=True))
        euler = _noisy(to_euler(quaternion), self._attitude_noise_rad, normals, 3)
        return Estimate(
            sample_us,
            _noisy((x + dx, y + dy, z + dz), config.position_noise_m, normals, 6),
            _noisy(velocity, config.velocity_noise_m_s, normals, 9),
            from_euler(*euler),
            euler,
            _noisy(rates, config.rates_noise_rad_s, normals, 12),
            battery=self._battery,
            reset_count=self._reset_count,
        )

    def jump_position(self, offset_ned_m: Vec3) -> None:
        """From now on the position is off by this much more."""
        x, y, z = self._offset_m
        self._offset_m = (x + offset_ned_m[0], y + offset_ned_m[1], z + offset_ned_m[2])
        self._reset_count += 1

    def drain_battery(self, remaining: float) -> None:
        """Only so much charge, 0 to 1, is left."""
        self._battery = self._battery._replace(remaining=remaining)

    def _normals(self) -> list[float]:
        """Sixteen standard normal numbers (Box and Muller); twice as fast as fifteen calls of `gauss`."""
        uniform = self._random.random
        normals: list[float] = []
        for _ in range(8):
            angle = math.tau * uniform()
            radius = math.sqrt(-2.0 * math.log(1.0 - uniform()))
            normals += (radius * math.cos(angle), radius * math.sin(angle))
        return normals

    def _drift(self, dt_s: float, normals: list[float]) -> None:
        keep = math.exp(-dt_s / self._config.position_wander_time_s)
        fresh = self._config.position_wander_m * math.sqrt(1.0 - keep * keep)
        x, y, z = self._wander_m
        self._wander_m = _noisy((keep * x, keep * y, keep * z), fresh, normals, 0)

    def _truth_at(self, sample_us: int) -> tuple[Vec3, Vec3, Quaternion, Vec3]:
        """The truth between two ticks, linear in each component: within 2e-5 m for 4 ms at 10 m/s^2."""
        history = self._history
        while len(history) > 1 and history[1][0] <= sample_us:
            history.popleft()
        before_us, a = history[0]
        if len(history) == 1 or sample_us <= before_us:
            return a.position_ned_m, a.velocity_ned_m_s, a.quaternion, a.rates_frd_rad_s
        after_us, b = history[1]
        part = (sample_us - before_us) / (after_us - before_us)
        (aw, ax, ay, az), (bw, bx, by, bz) = a.quaternion, b.quaternion
        sign = part if aw * bw + ax * bx + ay * by + az * bz >= 0 else -part
        rest = 1 - part
        return (
            _mix(a.position_ned_m, b.position_ned_m, part),
            _mix(a.velocity_ned_m_s, b.velocity_ned_m_s, part),
            normalised((rest * aw + sign * bw, rest * ax + sign * bx, rest * ay + sign * by, rest * az + sign * bz)),
            _mix(a.rates_frd_rad_s, b.rates_frd_rad_s, part),
        )


def _noisy(value: Vec3, sd: float, normals: list[float], at: int) -> Vec3:
    return (value[0] + sd * normals[at], value[1] + sd * normals[at + 1], value[2] + sd * normals[at + 2])


def _mix(a: Vec3, b: Vec3, part: float) -> Vec3:
    return (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]))
