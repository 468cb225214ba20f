"""Statistics of the estimator's errors with a fixed seed, and the age of its samples."""

import copy
import itertools
import math
import statistics
from functools import cache

import pytest

from sitl_mock.config.sensors import SensorsConfig
from sitl_mock.geometry import from_euler, to_euler, turned
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
    sds = {"velocity_noise_m_s": 0.01, "rates_noise_rad_s": 0.02, "accelerometer_noise_m_s2": 0.07}
    many = estimates(20.0, attitude_noise_deg=0.1, **sds)
    for axis in range(3):
        assert statistics.pstdev(e.velocity_ned_m_s[axis] for e in many) == pytest.approx(0.01, rel=0.05)
        assert statistics.pstdev(e.rates_frd_rad_s[axis] for e in many) == pytest.approx(0.02, rel=0.05)
        assert statistics.pstdev(e.specific_force_frd_m_s2[axis] for e in many) == pytest.approx(0.07, rel=0.05)
    # a turn about the body's y axis is cos(roll) of pitch; that about its x axis is all of the roll
    for axis in range(2):
        assert statistics.pstdev(e.euler_rad[axis] for e in many) == pytest.approx(math.radians(0.1), rel=0.06)


def errors(axis=0, **changes):
    """Of position, velocity, and body rates along one axis."""
    many = estimates(100.0, **changes)
    return (
        [e.position_ned_m[axis] - STILL.position_ned_m[axis] for e in many],
        [e.velocity_ned_m_s[axis] for e in many],
        [e.rates_frd_rad_s[axis] for e in many],
    )


def test_coloured_noise_keeps_its_size_and_forgets_in_its_time():
    noises = {"position_noise_m": 0.003, "velocity_noise_m_s": 0.01, "rates_noise_rad_s": 0.02}
    for series, sd in zip(errors(noise_time_s=0.04, **noises), noises.values(), strict=True):
        assert statistics.pstdev(series) == pytest.approx(sd, rel=0.05)
        assert statistics.correlation(series[:-10], series[10:]) == pytest.approx(math.exp(-1), abs=0.05)


@cache
def long_wander():
    """2000 s, twice."""
    return [sample for seed in (1, 2) for sample in estimates(2000.0, seed, dt_s=0.1, wander="sih")]


@pytest.mark.parametrize(("axis", "sd_m", "sd_m_s"), [(0, 0.10, 0.15), (1, 0.25, 0.36), (2, 0.20, 0.12)])
def test_wander_as_sih_has_it(axis, sd_m, sd_m_s):
    """Recorded beside the truth: 1/e after some 4 s, and a velocity that errs with the position, not with its slope."""
    wide = [e.position_ned_m[axis] - STILL.position_ned_m[axis] for e in long_wander()]
    speeds = [e.velocity_ned_m_s[axis] - STILL.velocity_ned_m_s[axis] for e in long_wander()]
    assert statistics.pstdev(wide) == pytest.approx(sd_m, rel=0.12)
    assert statistics.pstdev(speeds) == pytest.approx(sd_m_s, rel=0.12)
    assert statistics.correlation(wide[:-41], wide[41:]) == pytest.approx(math.exp(-1), abs=0.12)
    assert statistics.correlation(wide, speeds) == pytest.approx((0.86, 0.93, 0.73)[axis], abs=0.08)
    slopes = [(b - a) / 0.1 for a, b in itertools.pairwise(wide)]
    assert statistics.correlation(slopes, speeds[1:]) == pytest.approx((0.22, 0.28, 0.44)[axis], abs=0.15)


def test_one_noise_more_leaves_the_others_as_they_are():
    quiet, loud = errors(position_noise_m=0.003), errors(position_noise_m=0.003, rates_noise_rad_s=0.1)
    assert quiet[:2] == loud[:2]
    assert quiet[2] != loud[2]


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


def body_at(boot_us):
    """Speeding up and turning about each axis; its rates grow, its attitude is that of the first ones."""
    t = boot_us / 1e6
    return VehicleState(
        (1.5 * t * t, -t * t, 0.5 * t * t),
        (3.0 * t, -2.0 * t, t),
        turned((1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), t),
        (0.1 + 0.5 * t, 0.2 - 0.5 * t, 0.3 + t),
        on_ground=False,
        acceleration_ned_m_s2=(3.0, -2.0, 1.0),
    )


@pytest.mark.parametrize("age_ms", [0, 1, 4, 7, 22])
def test_an_old_sample_is_the_truth_of_its_time(age_ms):
    estimator = Estimator(SensorsConfig(**(ONLY | {"age_ms": age_ms})), 1)
    for k in range(20):
        estimate = estimator.step(body_at(k * 4000), k * 4000)
    then = body_at(19 * 4000 - 1000 * age_ms)
    assert estimate.position_ned_m == pytest.approx(then.position_ned_m, abs=1e-9)
    assert estimate.velocity_ned_m_s == pytest.approx(then.velocity_ned_m_s, abs=1e-9)
    assert estimate.rates_frd_rad_s == pytest.approx(then.rates_frd_rad_s, abs=1e-9)
    # within 4 ms at rates that are 0.08 rad/s off
    assert estimate.quaternion == pytest.approx(then.quaternion, abs=2e-4)
    assert estimate.euler_rad == pytest.approx(to_euler(then.quaternion), abs=4e-4)


@pytest.mark.parametrize(
    ("euler", "acceleration", "force"),
    [
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, -9.81)),  # at rest
        ((0.0, 0.0, 1.0), (0.0, 0.0, 9.81), (0.0, 0.0, 0.0)),  # in free fall
        ((math.pi / 2, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, -9.81, 0.0)),  # on its right side: up is to the left
        ((0.0, math.pi / 2, 0.0), (0.0, 0.0, 0.0), (9.81, 0.0, 0.0)),  # nose up
        ((0.0, 0.0, math.pi / 2), (0.0, 2.0, 0.0), (2.0, 0.0, -9.81)),  # faces east, and speeds up eastwards
        ((0.0, 0.0, math.pi / 2), (2.0, 0.0, -1.0), (0.0, -2.0, -10.81)),  # north is on its left
    ],
)
def test_specific_force(euler, acceleration, force):
    truth = VehicleState(quaternion=from_euler(*euler), acceleration_ned_m_s2=acceleration)
    estimate = Estimator(SensorsConfig(**ONLY), 1).step(truth, 0)
    assert estimate.specific_force_frd_m_s2 == pytest.approx(force, abs=1e-12)


def test_jumps_add_up():
    estimator = Estimator(SensorsConfig(**ONLY), 1)
    estimator.jump_position((1.0, 2.0, 3.0))
    estimator.jump_position((0.1, 0.2, 0.3))
    estimate = estimator.step(STILL, 0)
    assert estimate.position_ned_m == pytest.approx((2.1, 4.2, 0.3))
    assert estimate.reset_count == 2


def test_an_estimate_can_be_copied_and_has_no_other_fields():
    asked, unasked = estimates(0.008, position_noise_m=0.1)
    assert copy.deepcopy(asked) == asked
    assert asked != unasked
    with pytest.raises(AttributeError, match="altitude"):
        _ = asked.altitude
