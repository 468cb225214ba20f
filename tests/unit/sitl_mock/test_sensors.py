"""Statistics of the estimator's errors with a fixed seed, and the age of its samples."""

import math
import statistics

import pytest

from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.geometry import from_euler
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimator

STILL = VehicleState((1.0, 2.0, -3.0), quaternion=from_euler(0.1, -0.2, 0.3))
ONLY = {
    "position_noise_m": 0.0,
    "position_wander_m": 0.0,
    "velocity_noise_m_s": 0.0,
    "attitude_noise_deg": 0.0,
    "rates_noise_rad_s": 0.0,
    "accelerometer_noise_m_s2": 0.0,
    "age_ms": 0,
}


def estimates(seconds, seed=1, dt_s=0.004, **changes):
    estimator = Estimator(SensorsConfig(**(ONLY | changes)), seed, dt_s)
    return [estimator.step(STILL, round(k * dt_s * 1e6)) for k in range(round(seconds / dt_s))]


def test_all_zero_is_the_truth():
    last = estimates(0.1)[-1]
    assert last.position_ned_m == STILL.position_ned_m
    assert last.euler_rad == pytest.approx((0.1, -0.2, 0.3))
    assert last.quaternion == pytest.approx(STILL.quaternion)


def test_white_position_noise():
    series = [e.position_ned_m[1] - 2.0 for e in estimates(40.0, position_noise_m=0.003)]
    assert statistics.pstdev(series) == pytest.approx(0.003, rel=0.05)
    assert statistics.fmean(series) == pytest.approx(0.0, abs=1e-4)
    neighbours = statistics.correlation(series[:-1], series[1:])
    assert abs(neighbours) < 0.05


def test_wander_has_its_size_and_its_memory():
    # 500 ms steps: the exact discretisation has the same statistics at any step
    walk = [e.position_ned_m for e in estimates(10000.0, dt_s=0.5, position_wander_m=0.05)]
    axes = [[position[i] - STILL.position_ned_m[i] for position in walk] for i in range(3)]
    assert math.sqrt(statistics.fmean(x * x for axis in axes for x in axis)) == pytest.approx(0.05, rel=0.1)
    lag = 40  # 20 s, one correlation time
    correlations = [statistics.correlation(axis[:-lag], axis[lag:]) for axis in axes]
    assert statistics.fmean(correlations) == pytest.approx(math.exp(-1), abs=0.1)


def test_wander_is_there_from_the_start():
    first = [estimates(0.004, seed=seed, position_wander_m=0.05)[0].position_ned_m[2] + 3.0 for seed in range(400)]
    assert statistics.pstdev(first) == pytest.approx(0.05, rel=0.1)


def test_other_noises():
    many = estimates(20.0, velocity_noise_m_s=0.01, attitude_noise_deg=0.1, rates_noise_rad_s=0.02)
    assert statistics.pstdev(e.velocity_ned_m_s[2] for e in many) == pytest.approx(0.01, rel=0.05)
    assert statistics.pstdev(e.euler_rad[1] for e in many) == pytest.approx(math.radians(0.1), rel=0.05)
    assert statistics.pstdev(e.rates_frd_rad_s[0] for e in many) == pytest.approx(0.02, rel=0.05)


def test_same_seed_same_estimates():
    changes = {"position_noise_m": 0.1, "position_wander_m": 0.1}
    assert estimates(1.0, **changes) == estimates(1.0, **changes)
    assert estimates(1.0, **changes) != estimates(1.0, seed=2, **changes)


@pytest.mark.parametrize("age_ms", [0, 4, 5, 23])
def test_the_stamp_is_the_time_of_the_sample(age_ms):
    # a vehicle at 2 m/s: the position says when it was sampled
    estimator = Estimator(SensorsConfig(**(ONLY | {"age_ms": age_ms})), 1)
    for k in range(100):
        boot_us = k * 4000
        truth = VehicleState((2.0 * boot_us / 1e6, 0.0, 0.0), (2.0, 0.0, 0.0))
        estimate = estimator.step(truth, boot_us)
    assert estimate.stamp_us == 99 * 4000 - 1000 * age_ms
    assert estimate.position_ned_m[0] == pytest.approx(2.0 * estimate.stamp_us / 1e6)


def test_old_attitudes_take_the_short_way():
    # q and -q are the same attitude; between them lies itself
    estimator = Estimator(SensorsConfig(**(ONLY | {"age_ms": 2})), 1)
    q = from_euler(0.1, 0.2, 0.3)
    estimator.step(VehicleState(quaternion=q), 0)
    estimate = estimator.step(VehicleState(quaternion=tuple(-part for part in q)), 4000)
    assert estimate.euler_rad == pytest.approx((0.1, 0.2, 0.3))
