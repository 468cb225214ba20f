"""The cascade: zero in zero out, the direction of every correction, limits, and what a missing setpoint means."""

import math

import pytest

from sitl_mock.geometry import from_euler, to_euler
from sitl_mock.inner_loops import (
    AttitudeSetpoint,
    Gains,
    LoopState,
    PositionSetpoint,
    RatesSetpoint,
    TorqueSetpoint,
    attitude_for,
    attitude_loop,
    step,
)
from sitl_mock.sensors import Estimate

GAINS = Gains()
LEVEL = (1.0, 0.0, 0.0, 0.0)
ZERO = (0.0, 0.0, 0.0)
HERE = PositionSetpoint(ZERO, yaw_rad=0.0)


def estimate(position=ZERO, velocity=ZERO, euler=ZERO, rates=ZERO):
    return Estimate(0, position, velocity, from_euler(*euler), euler, rates)


def test_at_rest_on_target_it_asks_for_hover_thrust_only():
    controls, _ = step(GAINS, LoopState(), HERE, estimate(), 0.004)
    assert controls.torque_frd_norm == pytest.approx(ZERO, abs=1e-12)
    assert controls.thrust_norm == pytest.approx(0.4905)


@pytest.mark.parametrize(
    ("seen", "axis", "sign"),
    [
        (estimate(euler=(0.1, 0.0, 0.0)), 0, -1),
        (estimate(euler=(0.0, 0.1, 0.0)), 1, -1),
        (estimate(euler=(0.0, 0.0, 0.1)), 2, -1),
        (estimate(rates=(0.1, 0.0, 0.0)), 0, -1),
        (estimate(rates=(0.0, 0.1, 0.0)), 1, -1),
        (estimate(rates=(0.0, 0.0, 0.1)), 2, -1),
        (estimate(position=(1.0, 0.0, 0.0)), 1, 1),  # too far north: nose up
        (estimate(position=(0.0, 1.0, 0.0)), 0, -1),  # too far east: roll left
        (estimate(velocity=(1.0, 0.0, 0.0)), 1, 1),
        (estimate(velocity=(0.0, 1.0, 0.0)), 0, -1),
    ],
)
def test_direction_of_each_correction(seen, axis, sign):
    controls, _ = step(GAINS, LoopState(), HERE, seen, 0.004)
    assert math.copysign(1, controls.torque_frd_norm[axis]) == sign
    assert abs(controls.torque_frd_norm[axis]) > 1e-3


def test_direction_of_thrust():
    assert step(GAINS, LoopState(), HERE, estimate(position=(0.0, 0.0, 1.0)), 0.004)[0].thrust_norm > 0.5
    assert step(GAINS, LoopState(), HERE, estimate(velocity=(0.0, 0.0, -1.0)), 0.004)[0].thrust_norm < 0.48


def test_attitude_for_an_acceleration():
    # 3 m/s^2 east, heading east: nose down by atan(3 / 9.81), thrust longer by the hypotenuse
    wanted, share = attitude_for(GAINS, (0.0, 3.0, 0.0), math.pi / 2)
    assert share == 1.0
    assert to_euler(wanted.quaternion) == pytest.approx((0.0, -math.atan2(3.0, 9.81), math.pi / 2))
    assert wanted.thrust_norm == pytest.approx(0.4905 * math.hypot(3.0, 9.81) / 9.81)
    right, _ = attitude_for(GAINS, (0.0, 3.0, 0.0), 0.0)
    assert to_euler(right.quaternion) == pytest.approx((math.atan2(3.0, 9.81), 0.0, 0.0))


def test_tilt_and_thrust_have_limits():
    steep, share = attitude_for(GAINS, (1000.0, 0.0, 0.0), 0.0)
    assert share == pytest.approx(9.81 * math.tan(GAINS.tilt_max_rad) / 1000.0)
    assert to_euler(steep.quaternion)[1] == pytest.approx(-GAINS.tilt_max_rad)
    assert attitude_for(GAINS, (0.0, 0.0, -100.0), 0.0)[0].thrust_norm == 1.0
    assert attitude_for(GAINS, (0.0, 0.0, 100.0), 0.0)[0].thrust_norm == GAINS.thrust_min_norm


def test_a_setpoint_enters_at_its_own_level():
    torque = TorqueSetpoint((0.1, 0.2, 0.3), 0.4)
    assert step(GAINS, LoopState(), torque, estimate(), 0.004) == (torque, LoopState())
    rates, _ = step(GAINS, LoopState(), RatesSetpoint((1.0, 0.0, 0.0), 0.4), estimate(), 0.004)
    assert rates.torque_frd_norm[0] == pytest.approx(0.11, rel=0.01)
    assert rates.thrust_norm == 0.4


@pytest.mark.parametrize("nothing", [(math.nan,) * 4, (1.0, 0.0, math.nan, 0.0), (0.0,) * 4, (math.inf, 0.0, 0.0, 0.0)])
def test_nan_attitude_and_missing_rates_ask_for_nothing(nothing):
    rates = attitude_loop(GAINS, AttitudeSetpoint(nothing, 0.5), estimate(rates=(1.0, 1.0, 1.0)))
    assert rates == RatesSetpoint((None, None, None), 0.5)
    controls, after = step(GAINS, LoopState(), rates, estimate(rates=(1.0, 1.0, 1.0)), 0.004)
    assert controls.torque_frd_norm == ZERO
    assert all(math.isnan(rate) for rate in after.rates_target_rad_s)


def test_the_error_quaternion_takes_the_short_way():
    near = AttitudeSetpoint(tuple(-part for part in from_euler(0.1, 0.0, 0.0)), 0.5)
    assert attitude_loop(GAINS, near, estimate()).rates_frd_rad_s[0] > 0


def test_the_attitude_loop_limits_its_rates_and_body_rates_from_outside_have_no_limit():
    for axis, (error_rad, limit_deg_s) in enumerate(((3.0, 220.0), (1.4, 220.0), (3.0, 200.0))):
        euler = [error_rad if i == axis else 0.0 for i in range(3)]
        rates = attitude_loop(GAINS, AttitudeSetpoint(from_euler(*euler), 0.5), estimate()).rates_frd_rad_s
        assert rates[axis] == pytest.approx(math.radians(limit_deg_s))
    fast = RatesSetpoint((9.0, 0.0, 0.0), 0.5)
    assert step(GAINS, LoopState(), fast, estimate(), 0.004)[0].torque_frd_norm[0] == pytest.approx(
        0.11 * 9.0, rel=0.01
    )
