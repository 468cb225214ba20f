"""The rigid body: direction first, then magnitude; outside numbers are PX4 SIH's (FRD moments, 20 N at full thrust)."""

import math

import pytest

from sitl_mock.geometry import from_euler, rotate, tilt_rad, to_euler
from sitl_mock.plant import VehicleParams, VehicleState
from sitl_mock.quadcopter import RigidBody, derivative, lag_decay, lagged, step, wrench

PARAMS = VehicleParams()
NO_DRAG = VehicleParams(linear_drag_n_s_m=0.0, angular_drag_nm_s_rad=0.0)
HOVER = PARAMS.hover_thrust_norm
CALM = (0.0, 0.0, 0.0)
DT_S = 0.004


def flying(motors=(HOVER,) * 4, **changes):
    return VehicleState(position_ned_m=(0.0, 0.0, -50.0), motors=motors, on_ground=False, **changes)


def fly(state, commands, seconds, params=PARAMS, wind=CALM):
    for _ in range(round(seconds / DT_S)):
        state = step(params, state, commands, wind, DT_S)
    return state


def test_hover_thrust_of_sih():
    assert pytest.approx(0.4905) == HOVER


def test_zero_in_zero_out():
    state = flying()
    after = fly(state, (HOVER,) * 4, 5.0)
    assert after.position_ned_m == pytest.approx(state.position_ned_m, abs=1e-9)
    assert after.velocity_ned_m_s == pytest.approx(CALM, abs=1e-9)
    assert after.rates_frd_rad_s == CALM


@pytest.mark.parametrize(
    ("levels", "axis", "sign"),
    [
        ((0.4, 0.6, 0.6, 0.4), 0, 1),  # left motors (2, 3) up: rolls right
        ((0.6, 0.4, 0.6, 0.4), 1, 1),  # front motors (1, 3) up: nose up
        ((0.6, 0.6, 0.4, 0.4), 2, 1),  # 1 and 2 up: nose right
    ],
)
def test_direction_of_each_moment(levels, axis, sign):
    after = fly(flying(levels), levels, 0.1)
    assert math.copysign(1, after.rates_frd_rad_s[axis]) == sign
    others = [rate for i, rate in enumerate(after.rates_frd_rad_s) if i != axis]
    assert others == pytest.approx([0.0, 0.0], abs=1e-12)


def test_size_of_each_moment():
    # SIH: M = [0.2*5*(-u1+u2+u3-u4), 0.2*5*(u1-u2+u3-u4), 0.1*(u1+u2-u3-u4)], F = 5 * sum(u)
    applied = wrench(PARAMS, (0.1, 0.2, 0.3, 0.5))
    assert applied.moment_nm == pytest.approx((-0.1, -0.3, -0.05))
    assert applied.thrust_n == pytest.approx(5.5)


def test_pitch_down_flies_north_and_roll_right_flies_east():
    nose_down = fly(flying(quaternion=from_euler(0.0, -0.1, 0.0)), (HOVER,) * 4, 0.2)
    assert nose_down.velocity_ned_m_s[0] > 0.1
    assert nose_down.velocity_ned_m_s[1] == pytest.approx(0.0, abs=1e-12)
    right_down = fly(flying(quaternion=from_euler(0.1, 0.0, 0.0)), (HOVER,) * 4, 0.2)
    assert right_down.velocity_ned_m_s[1] > 0.1
    facing_east = fly(flying(quaternion=from_euler(0.0, -0.1, math.pi / 2)), (HOVER,) * 4, 0.2)
    assert facing_east.velocity_ned_m_s[1] > 0.1


def test_free_fall_keeps_its_energy():
    after = fly(flying((0.0,) * 4), (0.0,) * 4, 2.0, NO_DRAG)
    assert after.velocity_ned_m_s[2] == pytest.approx(9.81 * 2.0)
    assert after.position_ned_m[2] == pytest.approx(-50.0 + 0.5 * 9.81 * 4.0)
    height_m = -after.position_ned_m[2]
    assert 0.5 * after.velocity_ned_m_s[2] ** 2 + 9.81 * height_m == pytest.approx(9.81 * 50.0)


def test_spin_without_moments_keeps_its_angular_momentum_and_energy():
    # Euler's equations with three different moments of inertia: L in the world and T are constant.
    params = VehicleParams(inertia_kg_m2=(0.02, 0.025, 0.04), linear_drag_n_s_m=0.0, angular_drag_nm_s_rad=0.0)
    start = flying((0.0,) * 4, rates_frd_rad_s=(1.0, 2.0, 3.0))
    after = fly(start, (0.0,) * 4, 3.0, params)

    def momentum(state):
        body = tuple(j * w for j, w in zip(params.inertia_kg_m2, state.rates_frd_rad_s, strict=True))
        return rotate(state.quaternion, body)

    assert momentum(after) == pytest.approx(momentum(start), rel=1e-6)
    assert after.rates_frd_rad_s != pytest.approx(start.rates_frd_rad_s, abs=0.1)
    assert math.hypot(*after.quaternion) == pytest.approx(1.0, abs=1e-12)


def test_rotor_lag_is_a_first_order_step_for_any_tick():
    # 63.2 % after one time constant, in one step or in twelve and a half
    once = lagged((0.0,) * 4, (1.0, 0.5, 0.2, 0.1), lag_decay(0.05, 0.05))
    assert once == pytest.approx(tuple(0.6321206 * c for c in (1.0, 0.5, 0.2, 0.1)), rel=1e-6)
    after = fly(flying((0.0,) * 4), (1.0,) * 4, 0.048)
    assert after.motors[0] == pytest.approx(1 - math.exp(-0.048 / 0.05))
    assert lag_decay(0.0, 0.004) == 0.0


def test_wind_carries_the_vehicle_along():
    wind = (3.0, -2.0, 0.0)
    after = fly(flying(), (HOVER,) * 4, 10.0, wind=wind)
    assert after.velocity_ned_m_s == pytest.approx(wind, abs=1e-3)  # time constant m / k_v = 1 s


def test_drag_and_tilt_balance():
    # steady speed g tan(tilt) m / k_v for a thrust that holds the height
    tilt = math.radians(10.0)
    thrust = HOVER / math.cos(tilt)
    after = fly(flying((thrust,) * 4, quaternion=from_euler(0.0, -tilt, 0.0)), (thrust,) * 4, 12.0)
    assert after.velocity_ned_m_s == pytest.approx((9.81 * math.tan(tilt), 0.0, 0.0), abs=1e-3)


def test_derivative_of_the_attitude_is_the_body_rate():
    rates = (0.1, 0.2, 0.3)
    motion = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *rates)
    rate = derivative(PARAMS, motion, wrench(PARAMS, (0.0,) * 4), CALM)
    assert rate[3:7] == pytest.approx((0.0, 0.05, 0.1, 0.15))


def test_rests_on_the_ground_until_thrust_exceeds_weight():
    still = fly(VehicleState(), (0.9 * HOVER, HOVER, HOVER, HOVER), 1.0, wind=(10.0, 0.0, 0.0))
    assert still.on_ground
    assert still.position_ned_m == CALM
    assert to_euler(still.quaternion) == CALM
    risen = fly(VehicleState(), (1.1 * HOVER,) * 4, 1.0)
    assert not risen.on_ground
    assert risen.position_ned_m[2] < -0.05


def test_comes_down_level_and_says_how():
    start = VehicleState((1.0, 2.0, -0.01), (0.0, 0.5, 1.0), from_euler(0.2, 0.1, 0.7), CALM, (0.0,) * 4, False)
    body = RigidBody(PARAMS, start)
    while not body.state.on_ground:
        body.step((0.0,) * 4, CALM, DT_S)
    down = body.state
    assert down.position_ned_m[2] == 0.0
    assert down.velocity_ned_m_s == CALM
    assert to_euler(down.quaternion) == pytest.approx((0.0, 0.0, 0.7), abs=1e-9)
    assert down.impact.speed_m_s == pytest.approx(math.hypot(0.5, 1.0), abs=0.15)
    assert down.impact.tilt_rad == pytest.approx(math.acos(math.cos(0.2) * math.cos(0.1)), abs=1e-6)
    body.step((0.0,) * 4, CALM, DT_S)
    assert body.state.impact is None


def test_a_flipped_vehicle_stays_flipped():
    start = VehicleState((0.0, 0.0, -0.01), (0.0, 0.0, 1.0), from_euler(2.5, 0.0, 0.0), CALM, (0.0,) * 4, False)
    down = fly(start, (1.0,) * 4, 0.5)
    assert down.on_ground
    assert tilt_rad(down.quaternion) == pytest.approx(2.5)
