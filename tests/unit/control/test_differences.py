"""One test for each difference from the printed paper (Kim, Pyrkin, Borisov, arXiv:2605.14945)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from mavquad.control.allocation import (
    PAPER_ROTORS,
    PX4_ROTORS,
    forces_from_inputs,
    inputs_from_forces,
    px4_order,
    x_frame_lever_arm_m,
)
from mavquad.control.controller import Controller
from mavquad.control.euler import body_acceleration, body_rates, euler_rates, trig
from mavquad.control.model import GRAVITY_M_S2, ModelParams, ModelState, derivative, thrust_direction_nwu
from mavquad.control.normal_form import apply_b0, b4
from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Attitude, Position, TorqueCommand
from tests.unit.control import oracle
from tests.unit.control.plant import Body, Link, Vehicle, advance, euler_matrix, fly, motor_commands
from tests.unit.control.printed import YAW_ANGLES_DEG, apply_printed, law_as_printed, solve_printed

PARAMS = ModelParams(mass_kg=1.5, inertia_kg_m2=(0.02, 0.025, 0.04), lever_arm_m=0.17, yaw_lever_m=0.016)
LEVEL = ModelState((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
PAPER = LawParams(depth="torque", measurements="position_yaw", decoupling="constant", yaw_padding=2)
"""The law as the paper has it, with its b4(0, yaw) put right."""
QUIET = Link(white_m=0.0, wander_m=0.0, yaw_white_rad=0.0, rate_white_rad_s=0.0)


def _accelerations(forces_n: tuple[float, float, float, float]) -> tuple[float, float, float]:
    return derivative(PARAMS, LEVEL, forces_n).euler_rates_rad_s


def test_e1_phi_is_the_yaw_and_psi_the_roll() -> None:
    """The row of phi has C and alternating signs: rotors of one spin turn the body about the vertical."""
    roll, pitch, yaw = _accelerations((1.0, 0.0, 1.0, 0.0))
    assert (roll, pitch) == (0.0, 0.0)
    assert yaw == pytest.approx(2.0 * PARAMS.yaw_lever_m / PARAMS.inertia_kg_m2[2])
    left = tuple(float("left" in place) for place in PAPER_ROTORS)
    roll, pitch, yaw = _accelerations(left)
    assert roll > 0.0  # left side lifted: right side down
    assert (pitch, yaw) == (0.0, 0.0)
    # And the angle called phi turns r3 about the vertical, as yaw does: r3z does not know it.
    assert thrust_direction_nwu((0.2, 0.3, 1.0))[2] == thrust_direction_nwu((0.2, 0.3, -2.0))[2]


@pytest.mark.parametrize("euler", [(0.3, 0.2, 0.5), (-0.7, 0.4, -2.5), (0.1, -1.0, 3.0)])
def test_e2_thrust_acts_along_the_third_column_of_the_rotation(euler: tuple[float, float, float]) -> None:
    roll, pitch, yaw = euler

    def about(axis: int, angle: float) -> np.ndarray:
        c, s = math.cos(angle), math.sin(angle)
        i, j = [k for k in range(3) if k != axis]
        m = np.eye(3)
        m[i, i] = m[j, j] = c
        m[i, j], m[j, i] = (s, -s) if axis == 1 else (-s, s)
        return m

    rotation = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    assert thrust_direction_nwu(euler) == pytest.approx(rotation[:, 2], abs=1e-12)


def test_e2_nose_down_accelerates_forward() -> None:
    weight = PARAMS.mass_kg * GRAVITY_M_S2 / 4.0
    tilted = replace(LEVEL, euler_rad=(0.0, 0.2, 0.0))
    ax, ay, _ = derivative(PARAMS, tilted, (weight,) * 4).velocity_nwu_m_s
    assert ax == pytest.approx(GRAVITY_M_S2 * math.sin(0.2))
    assert ay == 0.0


def test_e3_the_quarter_makes_the_rotors_lift_the_weight_once() -> None:
    forces = forces_from_inputs(PARAMS, GRAVITY_M_S2 + 0.7, 0.3, -2.0, 5.0)
    assert sum(forces) == pytest.approx(PARAMS.mass_kg * (GRAVITY_M_S2 + 0.7))
    assert _accelerations(forces) == pytest.approx((-2.0, 5.0, 0.3))
    assert inputs_from_forces(PARAMS, forces) == pytest.approx((GRAVITY_M_S2 + 0.7, 0.3, -2.0, 5.0))


def test_e3_px4_numbers_its_rotors_differently() -> None:
    named = dict(zip(PAPER_ROTORS, (1.0, 2.0, 3.0, 4.0), strict=True))
    ours = px4_order((1.0, 2.0, 3.0, 4.0))
    assert ours == tuple(named[place] for place in PX4_ROTORS)
    assert px4_order(ours) == (1.0, 2.0, 3.0, 4.0)


def test_e4_rotor_forces_give_second_derivatives_of_the_angles() -> None:
    """A torque changes the rates; the angles' first derivatives are the rates, whatever the torque."""
    moving = replace(LEVEL, euler_rates_rad_s=(0.1, 0.2, 0.3))
    rate = derivative(PARAMS, moving, (1.0, 2.0, 3.0, 5.0))
    assert rate.euler_rad == (0.1, 0.2, 0.3)
    assert rate.euler_rates_rad_s == pytest.approx(
        (
            PARAMS.lever_arm_m / 0.02 * (-1.0 + 2.0 + 3.0 - 5.0),
            PARAMS.lever_arm_m / 0.025 * (-1.0 - 2.0 + 3.0 + 5.0),
            PARAMS.yaw_lever_m / 0.04 * (1.0 - 2.0 + 3.0 - 5.0),
        )
    )


def test_e5_printed_block_has_the_wrong_sign_in_one_direction() -> None:
    """B_true B_printed^-1 has eigenvalues +1 and -1: one direction is pushed away from its goal."""
    for yaw in np.linspace(-3.0, 3.0, 7):
        s, c = math.sin(yaw), math.cos(yaw)
        columns = [apply_b0(s, c, 9.81, solve_printed(s, c, 9.81, (0.0, 0.0, *unit)))[2:] for unit in np.eye(2)]
        assert sorted(np.linalg.eigvals(np.array(columns).T).real) == pytest.approx([-1.0, 1.0])
        # It is minus the true one with its columns exchanged.
        true_roll = apply_b0(s, c, 9.81, (0.0, 0.0, 1.0, 0.0))[2:]
        printed_pitch = apply_printed(s, c, 9.81, (0.0, 0.0, 0.0, 1.0))[2:]
        assert printed_pitch == pytest.approx([-v for v in true_roll])


@pytest.mark.parametrize("yaw_deg", YAW_ANGLES_DEG)
def test_e5_printed_b0_diverges_at_six_yaw_angles(yaw_deg: int) -> None:
    yaw = math.radians(yaw_deg)
    goal = hold(Pose((0.3, 0.2, 0.0), yaw))
    right = fly(PAPER, lambda _: goal, 12.0, link=QUIET, start_yaw=yaw)
    assert not right.crashed
    assert right.max_m(10.0) < 0.02
    with law_as_printed():
        printed = fly(PAPER, lambda _: goal, 12.0, link=QUIET, start_yaw=yaw)
    assert printed.crashed


def test_e6_b4_is_singular_in_free_fall_and_at_a_right_angle_of_roll() -> None:
    thrust, roll = oracle.STATE[6], oracle.STATE[2]
    determinant = sp.simplify(oracle.symbolic_b4().det())
    assert sp.simplify(determinant - thrust**2 * sp.cos(roll)) == 0
    for t, specific_thrust in ((trig(0.0, 0.3, 0.4), 0.0), (trig(math.pi / 2, 0.3, 0.4), 9.81)):
        assert np.linalg.det(np.array(b4(t, specific_thrust))) == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.det(np.array(b4(trig(0.3, 0.3, 0.4), 9.81))) == pytest.approx(9.81**2 * math.cos(0.3))


def test_e7_thrust_is_the_double_integral_of_v1() -> None:
    """With one integrator, as printed after eq. (6), the thrust would follow v1 in proportion to t, not t^2 / 2."""
    law = Controller(PAPER.model_copy(update={"delay_s": 0.0}), "torque", _at_rest(0), _level(0), 9.81)
    value, rate, drive, far = 0.0, 0.0, 0.0, hold(Pose((0.0, 0.0, 0.2), 0.0))
    for k in range(20):
        law.observe_attitude(_level(10_000 * k))
        law.observe_position(_at_rest(10_000 * k))
        command = law.command(lambda _: far)
        if k:
            value, rate = value + 0.01 * rate + 0.5e-4 * drive, rate + 0.01 * drive
        assert command.specific_thrust_m_s2 == pytest.approx(9.81 + value, abs=1e-12)
        assert law.trace is not None
        drive = law.trace.inputs[0]
    assert value > 0.01


def _at_rest(stamp_us: int) -> Position:
    return Position(stamp_us, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _level(stamp_us: int) -> Attitude:
    return Attitude(stamp_us, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))


def test_e8_outputs_are_z_yaw_x_y_in_one_order_everywhere() -> None:
    """xi_1, xi_2 mean two things in print; here the chains have the order of zeta_1 = (z, yaw, x, y)."""
    attitude = Attitude(0, 0.0, 0.0, 0.2, (0.0, 0.0, 0.02))
    law = Controller(PAPER, "torque", Position(0, (3.0, 4.0, 1.0), (0.3, 0.4, 0.1)), attitude, 9.81)
    goal = hold(Pose((3.3, 4.4, 1.1), 0.22))
    law.command(lambda _: goal)
    trace = law.trace
    assert trace is not None
    assert [chain[:2] for chain in trace.zeta_hat] == [(1.0, 0.1), (0.2, 0.02), (3.0, 0.3), (4.0, 0.4)]
    assert trace.measured == pytest.approx((1.0, 0.2, 3.0, 4.0))
    assert trace.reference == pytest.approx((1.1, 0.22, 3.3, 4.4))


def _bare(params: LawParams) -> LawParams:
    """Without the limits of speed, tilt, jerk and thrust that the paper knows nothing of."""
    limits = {"approach_speed_max_m_s": 1e3, "climb_speed_max_m_s": 1e3, "tilt_max_deg": 89.9, "thrust_max_g": 100.0}
    return params.model_copy(
        update={
            "limits": params.limits.model_copy(update=limits),
            "saturation": params.saturation.model_copy(update={"roll_pitch_rad_s": 1e3}),
        }
    )


def _settles(params: LawParams, offset_m: float) -> bool:
    goal = hold(Pose((offset_m, offset_m, offset_m / 2), 0.0))
    flight = fly(params, lambda _: goal, 30.0, link=QUIET)
    return not flight.crashed and flight.max_m(28.0) < 0.05


def test_e9_stability_is_not_semi_global_for_given_gains() -> None:
    """The constant gain b4(0, yaw) serves while tilt is moderate: a start near settles, one far off does not."""
    assert _settles(_bare(PAPER), 0.3)
    assert not _settles(_bare(PAPER), 12.0)


@pytest.mark.parametrize("params", [PAPER, LawParams()])
def test_e9_limits_bring_a_start_from_afar_home(params: LawParams) -> None:
    goal = hold(Pose((12.0, 12.0, 6.0), 0.0))
    flight = fly(params, lambda _: goal, 30.0, link=QUIET)
    assert not flight.crashed
    assert flight.max_m(28.0) < 0.02
    assert max(flight.tilt) < math.radians(30.0)


def _body_acceleration_by_difference(euler: list[float], rates: list[float], second: list[float]) -> list[float]:
    h = 1e-5

    def at(time_s: float) -> tuple[float, float, float]:
        angles = [a + time_s * r + 0.5 * time_s * time_s * s for a, r, s in zip(euler, rates, second, strict=True)]
        slopes = [r + time_s * s for r, s in zip(rates, second, strict=True)]
        return body_rates(trig(*angles), tuple(slopes))

    return [(b - a) / (2 * h) for a, b in zip(at(-h), at(h), strict=True)]


def test_e10_euler_accelerations_are_not_the_bodys() -> None:
    euler, rates, second = [0.5, 0.4, 1.0], [0.3, -0.7, 0.9], [1.0, 2.0, 3.0]
    t = trig(*euler)
    ours = body_acceleration(t, tuple(rates), tuple(second))
    assert ours == pytest.approx(_body_acceleration_by_difference(euler, rates, second), abs=1e-6)
    assert max(abs(a - b) for a, b in zip(ours, second, strict=True)) > 0.5
    assert euler_rates(t, body_rates(t, tuple(rates))) == pytest.approx(rates)
    level = body_acceleration(trig(0.0, 0.0, 1.0), (0.0, 0.0, 0.0), tuple(second))
    assert level == pytest.approx(second)


def test_e10_a_tilted_rigid_body_obeys_the_converted_command() -> None:
    """30 degrees of pitch and roll: the plant's own Euler angles accelerate as the law's u2, u3, u4 asked."""
    vehicle = Vehicle(rotor_lag_s=0.0, angular_drag=0.0, drag_n_s_m=0.0)
    tilt, asked = math.radians(30.0), (1.0, -1.5, 0.8)
    for convert in (True, False):
        body = Body(rotation=euler_matrix(tilt, tilt, 0.4))
        before = body.euler()
        for _ in range(20):
            t = trig(*body.euler())
            rates = euler_rates(t, tuple(body.rates))
            turn = body_acceleration(t, rates, asked) if convert else asked
            advance(vehicle, body, motor_commands(vehicle, TorqueCommand(turn, 9.81)), (0.0, 0.0, 0.0))
        time_s = 20 * 0.0025
        moved = [2.0 * (b - a) / time_s / (time_s + 0.0025) for a, b in zip(before, body.euler(), strict=True)]
        error = max(abs(m - a) for m, a in zip(moved, asked, strict=True))
        assert error < 0.02 if convert else error > 0.3


def test_e11_the_lever_arm_is_about_the_axis() -> None:
    """Forces on an X frame at distance d from the centre: their moment about the roll axis is d / sqrt(2) times force."""
    arm = 0.25
    places = {
        "front right": (1, -1),
        "front left": (1, 1),
        "rear left": (-1, 1),
        "rear right": (-1, -1),
    }
    forces = forces_from_inputs(replace(PARAMS, lever_arm_m=x_frame_lever_arm_m(arm)), 9.81, 0.0, 2.0, -3.0)
    about_x = about_y = 0.0
    for place, force in zip(PAPER_ROTORS, forces, strict=True):
        x, y = (arm * s / math.sqrt(2.0) for s in places[place])
        assert math.hypot(x, y) == pytest.approx(arm)
        about_x += y * force
        about_y -= x * force
    assert about_x == pytest.approx(PARAMS.inertia_kg_m2[0] * 2.0)
    assert about_y == pytest.approx(PARAMS.inertia_kg_m2[1] * -3.0)
