"""The rigid body: direction first, then magnitude; outside numbers are PX4 SIH's (FRD moments, 20 N at full thrust)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sitl_mock.geometry import from_euler, rotate, tilt_rad, to_euler
from sitl_mock.plant import VehicleParams, VehicleState
from sitl_mock.quadcopter import RigidBody, lag_shares, lagged
from tests.unit.sitl_mock import rk4

PARAMS = VehicleParams()
NO_DRAG = VehicleParams(linear_drag_n_s_m=0.0, angular_drag_nm_s_rad=0.0)
HOVER = PARAMS.hover_thrust_norm
CALM = (0.0, 0.0, 0.0)
DT_S = 0.004


def flying(motors=(HOVER,) * 4, **changes):
    return VehicleState(position_ned_m=(0.0, 0.0, -50.0), motors=motors, on_ground=False, **changes)


def fly(state, commands, seconds, params=PARAMS, wind=CALM):
    body = RigidBody(params, state)
    for _ in range(round(seconds / DT_S)):
        body.step(commands, wind)
    return body.state


def accelerations(levels, params=PARAMS):
    """Angular (FRD) and along NED, of a vehicle that starts level and at rest with its motors at these levels."""
    after = fly(flying(levels), levels, DT_S, params)
    return [rate / DT_S for rate in after.rates_frd_rad_s], after.acceleration_ned_m_s2


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
    turning, moving = accelerations((0.1, 0.2, 0.3, 0.5), NO_DRAG)
    assert turning == pytest.approx((-0.1 / 0.025, -0.3 / 0.025, -0.05 / 0.03), rel=1e-3)
    assert moving[2] == pytest.approx(9.81 - 5.5, rel=1e-3)


PLUS = replace(NO_DRAG, frame="plus")


@pytest.mark.parametrize(
    ("motor", "turning"),
    [
        (0, (-1, 0, 1)),  # right: rolls left, nose right
        (1, (1, 0, 1)),  # left: rolls right, nose right
        (2, (0, 1, -1)),  # front: nose up, nose left
        (3, (0, -1, -1)),  # rear: nose down, nose left
    ],
)
def test_what_each_motor_of_a_plus_does(motor, turning):
    levels = [0.2] * 4
    levels[motor] += 0.1
    found, _ = accelerations(tuple(levels), PLUS)
    # 0.1 of 5 N on 0.2 m over 0.025 kg m^2, and 0.1 of 0.1 Nm over 0.03 kg m^2
    expected = [turning[0] * 4.0, turning[1] * 4.0, turning[2] / 3.0]
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_thrust_curve():
    # 5 N (0.35 u + 0.65 u^2) at u = 0.1, 0.2, 0.3, 0.5: 0.2075, 0.48, 0.8175, 1.6875 N
    params = replace(NO_DRAG, thrust_curve=0.65)
    turning, moving = accelerations((0.1, 0.2, 0.3, 0.5), params)
    assert moving[2] == pytest.approx(9.81 - 3.1925, rel=1e-3)
    assert turning[0] == pytest.approx(0.2 * (-0.2075 + 0.48 + 0.8175 - 1.6875) / 0.025, rel=1e-3)
    assert turning[2] == pytest.approx(0.02 * (0.2075 + 0.48 - 0.8175 - 1.6875) / 0.03, rel=1e-3)


@pytest.mark.parametrize("curve", [0.0, 0.3, 0.65, 1.0])
def test_hover_thrust_of_a_curve_holds_it(curve):
    params = replace(PARAMS, thrust_curve=curve)
    hover = params.hover_thrust_norm
    assert 5.0 * 4 * ((1 - curve) * hover + curve * hover * hover) == pytest.approx(9.81)
    still = fly(flying((hover,) * 4), (hover,) * 4, 2.0, params)
    assert still.velocity_ned_m_s == pytest.approx(CALM, abs=1e-9)


def test_a_weak_rotor_gives_its_share_of_thrust_and_torque():
    turning, moving = accelerations((0.4,) * 4, replace(NO_DRAG, rotor_strengths=(1.0, 1.0, 0.75, 1.0)))
    # front left lacks 0.25 of 2 N and of 0.04 Nm
    assert turning == pytest.approx((-0.1 / 0.025, -0.1 / 0.025, 0.01 / 0.03), rel=1e-3)
    assert moving[2] == pytest.approx(9.81 - 7.5, rel=1e-3)


def test_a_change_of_the_constants_acts_from_then_on():
    body = RigidBody(PARAMS, flying())
    body.step((HOVER,) * 4, CALM)
    body.change(replace(PARAMS, mass_kg=0.8))
    body.step((HOVER,) * 4, CALM)
    assert body.state.acceleration_ned_m_s2[2] == pytest.approx(9.81 - 9.81 / 0.8, rel=1e-2)


def sinking_speed(**drag):
    """Steady speed of free fall."""
    params = replace(NO_DRAG, **drag)
    high = flying((0.0,) * 4)._replace(position_ned_m=(0.0, 0.0, -1000.0))
    return fly(high, (0.0,) * 4, 30.0, params, wind=(0.0, 0.0, 2.0)).velocity_ned_m_s[2]


def test_quadratic_drag_ends_a_fall():
    assert sinking_speed(quadratic_drag_n_s2_m2=0.1) == pytest.approx(2.0 + math.sqrt(9.81 / 0.1))
    both = 2.0 + (-1.0 + math.sqrt(1.0 + 4 * 0.1 * 9.81)) / (2 * 0.1)  # 1.0 v + 0.1 v^2 = 9.81
    assert sinking_speed(quadratic_drag_n_s2_m2=0.1, linear_drag_n_s_m=1.0) == pytest.approx(both)


@pytest.mark.parametrize("share", [1.0, 0.49])
def test_rotor_drag_goes_with_the_square_root_of_the_thrust(share):
    params = replace(NO_DRAG, rotor_drag_n_s_m=0.5)
    level = share * HOVER
    after = fly(flying((level,) * 4), (level,) * 4, DT_S, params, wind=(4.0, -2.0, 0.0))
    force = [0.5 * math.sqrt(share) * speed for speed in (4.0, -2.0)]
    assert after.acceleration_ned_m_s2[:2] == pytest.approx(force, rel=2e-3)


ARDUCOPTER = VehicleParams(
    mass_kg=3.0,
    inertia_kg_m2=(0.023, 0.025, 0.046),
    motor_thrust_max_n=18.87,
    motor_torque_max_nm=0.303,
    arm_m=0.35,
    linear_drag_n_s_m=0.0,
    angular_drag_nm_s_rad=0.0013,
    motor_time_constant_s=0.02,
    frame="plus",
    thrust_curve=0.65,
    quadratic_drag_n_s2_m2=0.101,
    rotor_drag_n_s_m=0.346,
    rotor_strengths=(1.0, 0.999, 1.0, 1.0),
)


@pytest.mark.parametrize(("params", "swing"), [(PARAMS, 0.05), (ARDUCOPTER, 0.003)], ids=["SIH", "ArduCopter"])
def test_one_step_is_as_good_as_rk4_in_steps_of_1_ms(params, swing):
    """Six seconds of tumbling (more than 140 degrees of tilt, 14 m/s): 0.1 mm, 0.05 mm/s, 10 urad, 10 urad/s."""
    hover, wind = params.hover_thrust_norm, (2.0, 1.0, 0.5)
    phases = [(k / 20, k / 25, k / 30, k / 40) for k in range(1500)]
    commands = [tuple(hover * (1 + swing * math.sin(i + phase)) for i, phase in enumerate(row)) for row in phases]
    body = RigidBody(
        params, flying((hover,) * 4, quaternion=from_euler(0.2, -0.1, 0.5), rates_frd_rad_s=(0.5, -0.3, 1))
    )
    errors = []
    for command, exact in zip(commands, rk4.fly(params, body.state, commands, np.array(wind)), strict=True):
        body.step(command, wind)
        now = np.concatenate(body.state[:5])
        errors.append(
            [np.linalg.norm((now - exact)[part]) for part in (slice(3), slice(3, 6), slice(6, 10), slice(10, 13))]
        )
    assert all(np.max(errors, axis=0) < [1e-4, 5e-5, 1e-5, 1e-5])
    assert now[13:] == pytest.approx(exact[13:], abs=1e-9)


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

    assert momentum(after) == pytest.approx(momentum(start), rel=1e-4)
    assert after.rates_frd_rad_s != pytest.approx(start.rates_frd_rad_s, abs=0.1)
    assert math.hypot(*after.quaternion) == pytest.approx(1.0, abs=1e-12)


def test_rotor_lag_is_a_first_order_step_for_any_tick():
    # 63.2 % after one time constant, in one step or in twelve
    mean, end = lag_shares(0.05, 0.05)
    once = lagged((0.0,) * 4, (1.0, 0.5, 0.2, 0.1), end)
    assert once == pytest.approx(tuple(0.6321206 * c for c in (1.0, 0.5, 0.2, 0.1)), rel=1e-6)
    assert mean == pytest.approx(1 - math.exp(-1))  # mean of exp(-t) over 0..1
    after = fly(flying((0.0,) * 4), (1.0,) * 4, 0.048)
    assert after.motors[0] == pytest.approx(1 - math.exp(-0.048 / 0.05))
    assert lag_shares(0.0, 0.004) == (0.0, 0.0)


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


def test_the_attitude_turns_by_the_body_rates():
    # 0.1, 0.2, 0.3 rad/s for one tick, from an attitude of its own: q changes by q (0, w) / 2
    q = from_euler(0.3, -0.2, 1.0)
    after = fly(flying((0.0,) * 4, quaternion=q, rates_frd_rad_s=(0.1, 0.2, 0.3)), (0.0,) * 4, DT_S, NO_DRAG)
    w, x, y, z = q
    p, r, s = 0.05 * DT_S, 0.1 * DT_S, 0.15 * DT_S
    turn = (-x * p - y * r - z * s, w * p + y * s - z * r, w * r - x * s + z * p, w * s + x * r - y * p)
    assert [b - a for a, b in zip(q, after.quaternion, strict=True)] == pytest.approx(turn, abs=1e-6)


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
        body.step((0.0,) * 4, CALM)
    down = body.state
    assert down.position_ned_m[2] == 0.0
    assert down.velocity_ned_m_s == CALM
    assert to_euler(down.quaternion) == pytest.approx((0.0, 0.0, 0.7), abs=1e-9)
    assert down.impact.speed_m_s == pytest.approx(math.hypot(0.5, 1.0), abs=0.15)
    assert down.impact.tilt_rad == pytest.approx(math.acos(math.cos(0.2) * math.cos(0.1)), abs=1e-6)
    body.step((0.0,) * 4, CALM)
    assert body.state.impact is None
    # and it takes off again straight up
    for _ in range(100):
        body.step((1.01 * HOVER,) * 4, CALM)
    assert not body.state.on_ground
    assert body.state.velocity_ned_m_s[:2] == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_flipped_vehicle_stays_flipped():
    start = VehicleState((0.0, 0.0, -0.01), (0.0, 0.0, 1.0), from_euler(2.5, 0.0, 0.0), CALM, (0.0,) * 4, False)
    down = fly(start, (1.0,) * 4, 0.5)
    assert down.on_ground
    assert tilt_rad(down.quaternion) == pytest.approx(2.5)
