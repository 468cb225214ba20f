"""zeta, q4 and b4 against computer algebra."""

from __future__ import annotations

import math
import random

import pytest
import sympy as sp

from mavquad.control.euler import trig
from mavquad.control.normal_form import BodyState, Friction, apply_b0, apply_b4, b4, q4, solve_b0, solve_b4, zeta
from tests.unit.control import oracle

G = 9.81


def _draw(seed: int) -> tuple[list[float], list[float]]:
    rng = random.Random(seed)
    angles = [rng.uniform(-3.1, 3.1), rng.uniform(-1.2, 1.2), rng.uniform(-1.2, 1.2)]
    rates = [rng.uniform(-2.0, 2.0) for _ in range(3)]
    rest = [rng.uniform(3.0, 18.0), *(rng.uniform(-3.0, 3.0) for _ in range(4))]
    return angles + rates + rest, [rng.uniform(0.0, 1.0) for _ in range(4)]


def _ours(state: list[float]) -> tuple[object, BodyState]:
    yaw, pitch, roll, yaw_d, pitch_d, roll_d, thrust, thrust_d, u2, u2_d, _ = state
    return trig(roll, pitch, yaw), BodyState((roll_d, pitch_d, yaw_d), thrust, thrust_d, u2, u2_d)


@pytest.mark.parametrize("seed", range(20))
def test_b4_is_the_jacobian_of_the_fourth_derivatives(seed: int) -> None:
    state, _ = _draw(seed)
    t, body = _ours(state)
    expected = oracle.functions()[3](*state, 0.0, 0.0, 0.0, 0.0, G)
    for row, wanted in zip(b4(t, body.thrust_m_s2), expected, strict=True):
        assert row == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_q4_is_what_remains_without_inputs(seed: int) -> None:
    state, friction = _draw(seed)
    a_z, a_yaw, a_pitch, a_roll = friction
    t, body = _ours(state)
    _second, third, drift, _ = oracle.functions()
    jerk = third(*state, *friction, G)[0][0]
    ours = q4(t, body, Friction(a_z, (a_roll, a_pitch, a_yaw)), vertical_jerk_m_s3=jerk)
    assert ours == pytest.approx([row[0] for row in drift(*state, *friction, G)], abs=1e-10)


def test_q4_vanishes_at_rest_at_every_yaw() -> None:
    for yaw in (-3.0, -1.0, 0.0, 0.7, 2.0):
        assert q4(trig(0.0, 0.0, yaw), BodyState((0.0, 0.0, 0.0), G, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(10))
def test_zeta_3_and_4_are_the_derivatives(seed: int) -> None:
    state, _ = _draw(seed)
    t, body = _ours(state)
    chains = zeta(t, (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0), body, G)
    second, third, _, _ = oracle.functions()
    frictionless = (*state, 0.0, 0.0, 0.0, 0.0, G)
    assert [c[:2] for c in chains] == [(1.0, 5.0), (2.0, 6.0), (3.0, 7.0), (4.0, 8.0)]
    assert [c[2] for c in chains] == pytest.approx([row[0] for row in second(*frictionless)], abs=1e-12)
    assert [c[3] for c in chains] == pytest.approx([row[0] for row in third(*frictionless)], abs=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_solving_undoes_applying(seed: int) -> None:
    state, _ = _draw(seed)
    t, body = _ours(state)
    inputs = (1.0, -2.0, 3.0, 5.0)
    w = tuple(sum(a * u for a, u in zip(row, inputs, strict=True)) for row in b4(t, body.thrust_m_s2))
    assert apply_b4(t, body.thrust_m_s2, inputs) == pytest.approx(w, abs=1e-12)
    assert solve_b4(t, body.thrust_m_s2, w) == pytest.approx(inputs, abs=1e-12)
    assert solve_b0(t.s_yaw, t.c_yaw, G, apply_b0(t.s_yaw, t.c_yaw, G, inputs)) == pytest.approx(inputs, abs=1e-12)


def test_the_constant_form_is_b4_at_rest() -> None:
    t = trig(0.0, 0.0, 0.8)
    for k in range(4):
        unit = tuple(float(i == k) for i in range(4))
        assert apply_b0(t.s_yaw, t.c_yaw, G, unit) == pytest.approx([row[k] for row in b4(t, G)], abs=1e-12)


def test_solving_stays_finite_where_b4_is_singular() -> None:
    for t, thrust in ((trig(0.0, 0.0, 0.3), 0.0), (trig(math.pi / 2, 0.2, 0.3), G), (trig(0.3, 0.2, 0.1), -1.0)):
        assert all(abs(u) < 1e3 for u in solve_b4(t, thrust, (1.0, 2.0, 3.0, 4.0)))


def test_oracle_determinant() -> None:
    thrust, roll = oracle.STATE[6], oracle.STATE[2]
    assert sp.simplify(oracle.symbolic_b4().det() - thrust**2 * sp.cos(roll)) == 0
