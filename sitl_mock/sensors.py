"""What the autopilot's estimator says: the truth of a moment ago, with noise and a slow wander of the position.

    estimate(t) = truth(t - age) + noise + wander(t) + jumps

Noise and wander come from `EstimateErrors`; the noise of the attitude is a small turn about the body's axes. A jump is
what a reset of the estimator does to the position: it stays.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sitl_mock.battery import FULL, Battery
from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.estimate_errors import EstimateErrors
from sitl_mock.geometry import ZERO3, Quaternion, Vec3, conjugate, rotate, to_euler, turned
from sitl_mock.plant import GRAVITY_M_S2, TICK_S, VehicleState


@dataclass(slots=True)
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
    specific_force_frd_m_s2: Vec3 = (0.0, 0.0, -GRAVITY_M_S2)
    battery: Battery = FULL
    reset_count: int = 0


def _position_ned_m(sample: _Sample) -> Vec3:
    state, errors, back = sample._after, sample._errors, sample._back_s
    (x, y, z), (vx, vy, vz), (ax, ay, az) = state.position_ned_m, state.velocity_ned_m_s, state.acceleration_ned_m_s2
    dx, dy, dz = sample._offset_m
    half = 0.5 * back
    return (
        x - back * (vx - half * ax) + dx + errors[0],
        y - back * (vy - half * ay) + dy + errors[1],
        z - back * (vz - half * az) + dz + errors[2],
    )


def _velocity_ned_m_s(sample: _Sample) -> Vec3:
    state, errors, back = sample._after, sample._errors, sample._back_s
    (vx, vy, vz), (ax, ay, az) = state.velocity_ned_m_s, state.acceleration_ned_m_s2
    return (vx - back * ax + errors[3], vy - back * ay + errors[4], vz - back * az + errors[5])


def _quaternion(sample: _Sample) -> Quaternion:
    state, errors, back = sample._after, sample._errors, sample._back_s
    p, q, r = state.rates_frd_rad_s
    return turned(state.quaternion, (errors[6] - back * p, errors[7] - back * q, errors[8] - back * r), 1.0)


def _euler_rad(sample: _Sample) -> Vec3:
    return to_euler(sample.quaternion)


def _rates_frd_rad_s(sample: _Sample) -> Vec3:
    (p, q, r), (p0, q0, r0) = sample._after.rates_frd_rad_s, sample._before.rates_frd_rad_s
    errors, part = sample._errors, sample._back_s / TICK_S
    return (p - part * (p - p0) + errors[9], q - part * (q - q0) + errors[10], r - part * (r - r0) + errors[11])


def _specific_force_frd_m_s2(sample: _Sample) -> Vec3:
    state, errors = sample._after, sample._errors
    an, ae, ad = state.acceleration_ned_m_s2
    x, y, z = rotate(conjugate(state.quaternion), (an, ae, ad - GRAVITY_M_S2))
    return (x + errors[12], y + errors[13], z + errors[14])


class _WhenAsked:
    """A field that is worked out when it is first asked for, and is from then on an attribute like any other."""

    def __init__(self, work_out: Callable[[_Sample], Any]) -> None:
        self._work_out = work_out

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, sample: _Sample, owner: type) -> Any:
        value = sample.__dict__[self._name] = self._work_out(sample)
        return value


class _Sample(Estimate):
    """An estimate that works each field out when it is first asked for: at most ticks nobody asks for most of them.

    The sample lies `back_s` before the state `after` a tick, less than a tick: position, velocity and attitude are
    followed back from there, the body rates are linear between the ticks.
    """

    position_ned_m: Any = _WhenAsked(_position_ned_m)
    velocity_ned_m_s: Any = _WhenAsked(_velocity_ned_m_s)
    quaternion: Any = _WhenAsked(_quaternion)
    euler_rad: Any = _WhenAsked(_euler_rad)
    rates_frd_rad_s: Any = _WhenAsked(_rates_frd_rad_s)
    specific_force_frd_m_s2: Any = _WhenAsked(_specific_force_frd_m_s2)

    def __init__(
        self,
        stamp_us: int,
        before: VehicleState,
        after: VehicleState,
        back_s: float,
        errors: list[float],
        offset: tuple[Vec3, int],
        battery: Battery,
    ) -> None:
        self.stamp_us = stamp_us
        self._before, self._after, self._back_s = before, after, back_s
        self._errors = errors
        self._offset_m, self.reset_count = offset
        self.battery = battery


class Estimator:
    """Turns the truth of each tick into an `Estimate`."""

    def __init__(self, config: SensorsConfig, seed: int, dt_s: float = TICK_S) -> None:
        self._age_us = config.age_ms * 1000
        self._errors = EstimateErrors(config, seed, dt_s)
        self._history: deque[tuple[int, VehicleState]] = deque()
        self._offset: tuple[Vec3, int] = (ZERO3, 0)

    def step(self, truth: VehicleState, boot_us: int, battery: Battery = FULL) -> Estimate:
        """The estimate published at `boot_us`, given the truth of that moment; to be called at every tick."""
        history = self._history
        history.append((boot_us, truth))
        sample_us = boot_us - self._age_us if boot_us > self._age_us else 0
        while len(history) > 1 and history[1][0] <= sample_us:
            history.popleft()
        before_us, before = history[0]
        if sample_us <= before_us or len(history) == 1:
            return _Sample(sample_us, before, before, 0.0, self._errors.step(), self._offset, battery)
        after_us, after = history[1]
        back_s = (after_us - sample_us) * 1e-6
        return _Sample(sample_us, before, after, back_s, self._errors.step(), self._offset, battery)

    def jump_position(self, offset_ned_m: Vec3) -> None:
        """From now on the position is off by this much more."""
        (x, y, z), count = self._offset
        self._offset = (x + offset_ned_m[0], y + offset_ned_m[1], z + offset_ned_m[2]), count + 1
