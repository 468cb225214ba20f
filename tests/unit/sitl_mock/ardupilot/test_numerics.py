"""The mathematics of the ArduCopter personality: mixer, attitude target, square-root controller, position target."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_mock.config.vehicle import load_vehicle
from sitl_mock.geometry import IDENTITY, from_euler, to_euler
from sitl_mock.personality.ardupilot import attitude, motors
from sitl_mock.personality.ardupilot.demand import boosted
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.ardupilot.picture import geodetic, north_east
from sitl_mock.plant import VehicleParams
from sitl_mock.sensors import Estimate

SHARE = st.floats(0, 1)
TORQUE = st.floats(-1, 1)
STILL = Estimate(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("frame", ["plus", "x"])
@given(TORQUE, TORQUE, TORQUE, st.floats(-0.5, 1.5))
def test_a_mix_is_always_possible(frame, roll, pitch, yaw, thrust):
    assert all(0.0 <= share <= 1.0 for share in motors.mix(frame, (roll, pitch, yaw), thrust))


@pytest.mark.parametrize("frame", ["plus", "x"])
def test_a_small_mix_is_exact(frame):
    def torque(shares):
        a, b, c, d = shares
        if frame == "plus":
            return (b - a, c - d, (a + b - c - d) / 2)
        return ((b + c - a - d) * math.sqrt(0.5), (a + c - b - d) * math.sqrt(0.5), (a + b - c - d) / 2)

    shares = motors.mix(frame, (0.1, -0.2, 0.05), 0.4)
    assert sum(shares) == pytest.approx(1.6)
    assert torque(shares) == pytest.approx((0.1, -0.2, 0.05))


def test_roll_and_pitch_come_before_thrust_and_yaw():
    full = motors.mix("plus", (0.6, 0.0, 1.0), 1.0)
    assert full[1] - full[0] == pytest.approx(0.6)
    assert motors.mix("plus", (0.0, 0.0, 1.0), 1.0)[0] > motors.mix("plus", (0.0, 0.0, 0.0), 1.0)[2] - 0.2


@given(st.tuples(SHARE, SHARE, SHARE, SHARE), st.sampled_from([0.0, 0.3, 0.65, 1.0]))
def test_commands_undo_the_thrust_curve(shares, curve):
    vehicle = VehicleParams(thrust_curve=curve)
    back = [(1 - curve) * u + curve * u * u for u in motors.commands(vehicle, shares)]
    assert back == pytest.approx(shares, abs=1e-9)


def test_pwm_of_a_hover_as_recorded():
    vehicle = load_vehicle("arducopter").params()
    share = 1 / vehicle.thrust_to_weight
    assert motors.pwm(motors.commands(vehicle, (share,) * 4)[0]) == pytest.approx(1591, abs=2)


def test_the_square_root_controller_can_brake():
    """From any distance, the speed that it asks for shrinks no faster than the deceleration allows."""
    dt_s, gain, most = 0.001, 2.0, 3.0
    for start in (0.1, 1.0, 30.0):
        distance, before = start, attitude.sqrt_control(start, gain, most)
        while distance > 1e-3:
            distance -= before * dt_s
            now = attitude.sqrt_control(distance, gain, most)
            assert before - now <= most * dt_s * 1.01
            before = now
    assert attitude.sqrt_control(-2.0, gain, most) == -attitude.sqrt_control(2.0, gain, most)


def test_the_target_runs_to_an_attitude_within_its_limits():
    shape = attitude.Shape((10.0, 10.0, 4.0), 0.15)
    state, wanted = attitude.AttitudeState(), attitude.AttitudeInput(from_euler(0.4, -0.3, 1.0))
    for _ in range(750):
        after = attitude.move_target(shape, state, wanted, 0.004)
        for now, then, limit in zip(state.target_rates_rad_s, after.target_rates_rad_s, (10.0, 10.0, 4.0), strict=True):
            assert abs(then - now) <= limit * 0.004 + 1e-9
        state = after
    assert to_euler(state.target) == pytest.approx((0.4, -0.3, 1.0), abs=0.01)
    assert state.target_rates_rad_s == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_rates_turn_the_target():
    state = attitude.AttitudeState()
    for _ in range(250):
        state = attitude.move_target(
            attitude.Shape((0.0, 0.0, 0.0), 0.15), state, attitude.RatesInput((0.0, 0.5, 0.0)), 0.004
        )
    assert to_euler(state.target) == pytest.approx((0.0, 0.5, 0.0), abs=1e-3)


def test_slow_motors_get_gentler_gains():
    quick, slow = VehicleParams(motor_time_constant_s=0.0), VehicleParams(motor_time_constant_s=0.05)
    for a, b in zip(attitude.rate_gains(quick).p, attitude.rate_gains(slow).p, strict=True):
        assert 0 < b < a


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5))
def test_the_boost_is_never_negative_nor_upside_down(roll, pitch):
    lift = boosted(0.4, from_euler(roll, pitch, 0.3))
    cosine = math.cos(roll) * math.cos(pitch)
    assert lift >= 0.0
    assert lift == 0.0 if cosine <= 0 else lift <= 0.4 * 10.0 + 1e-9
    if cosine > 0.2:
        assert lift == pytest.approx(0.4 / cosine)


def test_the_position_target_keeps_its_limits_and_arrives():
    navigator = Navigator(0.389, 9.81, Parameters({}))
    navigator.start(STILL)
    fastest = [0.0, 0.0, 0.0]
    for _ in range(10_000):
        before = navigator.velocity_ned_m_s
        navigator.fly_to((40.0, -30.0, -20.0), 0.004)
        n, e, d = (now - then for now, then in zip(navigator.velocity_ned_m_s, before, strict=True))
        assert math.hypot(n, e) <= 2.5 * 0.004 + 1e-9
        assert abs(d) <= 1.0 * 0.004 + 1e-9
        speeds = (math.hypot(*navigator.velocity_ned_m_s[:2]), -navigator.velocity_ned_m_s[2], 0.0)
        fastest = [max(pair) for pair in zip(fastest, speeds, strict=True)]
    assert navigator.target_ned_m == pytest.approx((40.0, -30.0, -20.0), abs=0.01)
    assert fastest[0] <= 10.0 + 1e-9
    assert fastest[1] == pytest.approx(2.5, abs=1e-6)


def test_the_target_stays_near_a_vehicle_that_cannot_follow():
    navigator = Navigator(0.389, 9.81, Parameters({}))
    navigator.start(STILL)
    for _ in range(2000):
        navigator.follow_velocity((12.0, 0.0, 0.0), 0.004)
        navigator.control(STILL, 0.004)
    assert navigator.target_ned_m[0] <= 3.1


@given(st.floats(-5000, 5000), st.floats(-5000, 5000))
def test_the_globe_and_back(north, east):
    assert north_east(*geodetic((north, east, 0.0))) == pytest.approx((north, east), abs=0.02)
