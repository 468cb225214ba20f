"""The input gain of each depth: its inverse, the derivatives that it stands for, and the paper's b4 and q4."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from mavquad.control.euler import Trig, body_acceleration, euler_rates, trig
from mavquad.control.inversion import Gain, apply, solve, to_world
from mavquad.control.model import thrust_direction_nwu
from mavquad.control.normal_form import BodyState, apply_b4, q4, solve_b4
from mavquad.types import Vec3

G = 9.81
LENGTHS = (2, 3, 4)
SEEDS = range(12)


def _gain(seed: int, length: int, constant: bool = False, known: Vec3 = (0.3, -0.2, 0.5)) -> Gain:
    rng = random.Random(seed)
    t = trig(rng.uniform(-1.3, 1.3), rng.uniform(-1.3, 1.3), rng.uniform(-math.pi, math.pi))
    rates = tuple(rng.uniform(-2.0, 2.0) for _ in range(3))
    return Gain(length, constant, t, rng.uniform(4.0, 18.0), rng.uniform(-9.0, 9.0), rates, known)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("constant", [False, True])
def test_solving_undoes_applying(seed: int, length: int, constant: bool) -> None:
    gain, inputs = _gain(seed, length, constant), (8.0, 0.4, -0.7)
    assert solve(gain, apply(gain, inputs)) == pytest.approx(inputs, abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("constant", [False, True])
def test_applying_undoes_solving(seed: int, length: int, constant: bool) -> None:
    gain, demanded = _gain(seed, length, constant), (-1.0, 5.0, 3.0)
    assert apply(gain, solve(gain, demanded)) == pytest.approx(demanded, abs=1e-12)


# ---------------------------------------------------------------- derivatives along a motion


@dataclass(frozen=True)
class Motion:
    """Euler angles, and T, as functions of time; what the body feels of it by small differences."""

    roll: Callable[[float], float]
    pitch: Callable[[float], float]
    yaw: Callable[[float], float]
    thrust: Callable[[float], float]

    def euler(self, time_s: float) -> Vec3:
        return self.roll(time_s), self.pitch(time_s), self.yaw(time_s)

    def acceleration(self, time_s: float) -> Vec3:
        x, y, z = thrust_direction_nwu(self.euler(time_s))
        size = self.thrust(time_s)
        return (size * x, size * y, size * z - G)

    def body(self, time_s: float) -> tuple[Trig, Vec3, Vec3]:
        """Attitude, body rates and body accelerations."""
        t = trig(*self.euler(time_s))
        rates, second = (tuple(_slope(f, time_s, k) for f in (self.roll, self.pitch, self.yaw)) for k in (1, 2))
        turn = body_acceleration(t, rates, second)
        roll_d, pitch_d, yaw_d = rates
        p = roll_d - yaw_d * t.s_pitch
        q = pitch_d * t.c_roll + yaw_d * t.s_roll * t.c_pitch
        r = -pitch_d * t.s_roll + yaw_d * t.c_roll * t.c_pitch
        return t, (p, q, r), turn


def _slope(f: Callable[[float], float], time_s: float, order: int) -> float:
    h = 1e-3
    if order == 1:
        return (f(time_s - 2 * h) - 8 * f(time_s - h) + 8 * f(time_s + h) - f(time_s + 2 * h)) / (12 * h)
    return (-f(time_s - 2 * h) + 16 * f(time_s - h) - 30 * f(time_s) + 16 * f(time_s + h) - f(time_s + 2 * h)) / (
        12 * h * h
    )


def _wave(rng: random.Random, size: float, middle: float = 0.0) -> Callable[[float], float]:
    a, b, w, phase = rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(0.5, 2.5), rng.uniform(0, 6)
    return lambda time_s: middle + a * math.sin(w * time_s + phase) + b * math.cos(0.7 * w * time_s)


def _motion(seed: int) -> Motion:
    rng = random.Random(seed)
    return Motion(_wave(rng, 0.6), _wave(rng, 0.6), _wave(rng, 1.5), _wave(rng, 2.0, 11.0))


def _derivative(motion: Motion, time_s: float, order: int) -> Vec3:
    """Of the acceleration T r3 - g e3, in the order z, x, y."""
    x, y, z = (
        motion.acceleration(time_s)[i]
        if order == 0
        else _slope(lambda at, i=i: motion.acceleration(at)[i], time_s, order)
        for i in range(3)
    )
    return (z, x, y)


def _inputs(motion: Motion, time_s: float, length: int) -> tuple[Gain, Vec3]:
    """What a vehicle on this motion is given, in the law's terms."""
    t, rates, turn = motion.body(time_s)
    thrust, slope = motion.thrust(time_s), _slope(motion.thrust, time_s, 1)
    gain = Gain(length, False, t, thrust, slope, rates)
    if length == 2:
        roll, pitch, _ = motion.euler(time_s)
        return gain, (thrust, roll, pitch)
    if length == 3:
        return gain, (slope, rates[0], rates[1])
    return gain, (_slope(motion.thrust, time_s, 2), turn[0], turn[1])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("length", LENGTHS)
def test_applied_inputs_are_the_highest_derivative(seed: int, length: int) -> None:
    """Differences of T R e3 along a motion of all the angles; products of the rates included, the yaw's among them."""
    motion, time_s = _motion(seed), 0.37 * seed
    gain, inputs = _inputs(motion, time_s, length)
    assert apply(gain, inputs) == pytest.approx(_derivative(motion, time_s, length - 2), abs=2e-6)
    assert solve(gain, _derivative(motion, time_s, length - 2)) == pytest.approx(inputs, abs=2e-6)


def test_what_is_known_without_inputs_is_added() -> None:
    for length in LENGTHS:
        for constant in (False, True):
            bare = apply(_gain(3, length, constant, (0.0, 0.0, 0.0)), (8.0, 0.4, -0.7))
            with_it = apply(_gain(3, length, constant, (0.3, -0.2, 0.5)), (8.0, 0.4, -0.7))
            assert [b - a for a, b in zip(bare, with_it, strict=True)] == pytest.approx([0.3, -0.2, 0.5])


# ---------------------------------------------------------------- the paper's form is the same law


@pytest.mark.parametrize("seed", SEEDS)
def test_the_body_form_is_the_papers_b4_and_q4(seed: int) -> None:
    """U of the exact b4, q4 in Euler accelerations, turned into the body's: what `solve` finds directly.

    The two know nothing of each other's yaw input: b4 is given the one that makes its yaw what it is.
    """
    gain = _gain(seed, 4, known=(0.0, 0.0, 0.0))
    t, thrust = gain.t, gain.thrust_m_s2
    wz, wx, wy = demanded = (2.0, -3.0, 5.0)
    rates = euler_rates(t, gain.rates_flu_rad_s)
    u2 = 0.6
    body = BodyState(rates, thrust, gain.thrust_rate_m_s3, u2, 0.0)
    drift = q4(t, body)
    w = tuple(a - b for a, b in zip((wz, 0.0, wx, wy), drift, strict=True))
    v1, _, roll_dd, pitch_dd = solve_b4(t, thrust, w)
    p_d, q_d, _ = body_acceleration(t, rates, (roll_dd, pitch_dd, u2))
    assert solve(gain, demanded) == pytest.approx((v1, p_d, q_d), abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_papers_inputs_give_the_same_derivatives(seed: int) -> None:
    gain = _gain(seed, 4, known=(0.0, 0.0, 0.0))
    t, thrust = gain.t, gain.thrust_m_s2
    rates, u2 = euler_rates(t, gain.rates_flu_rad_s), -0.4
    drift = q4(t, BodyState(rates, thrust, gain.thrust_rate_m_s3, u2, 0.0))
    added = apply_b4(t, thrust, (3.0, 0.0, 1.5, -2.5))
    p_d, q_d, _ = body_acceleration(t, rates, (1.5, -2.5, u2))
    z, _, x, y = (a + b for a, b in zip(drift, added, strict=True))
    assert apply(gain, (3.0, p_d, q_d)) == pytest.approx((z, x, y), abs=1e-9)


def test_the_constant_form_is_the_other_at_level() -> None:
    """To first order of the angles at depth attitude, exactly at the others."""
    t = trig(0.0, 0.0, 0.8)
    for length in LENGTHS:
        level, constant = (Gain(length, c, t) for c in (False, True))
        demanded = (0.3, 0.001, -0.002) if length == 2 else (0.3, 1.0, -2.0)
        assert solve(level, demanded) == pytest.approx(solve(constant, demanded), abs=1e-4)


# ---------------------------------------------------------------- where the Euler form is singular


@pytest.mark.parametrize("length", [3, 4])
@pytest.mark.parametrize("roll", [math.pi / 2, -math.pi / 2, math.pi, 3.0])
@pytest.mark.parametrize("pitch", [0.0, 0.7, math.pi / 2])
def test_nothing_is_singular_at_any_attitude(length: int, roll: float, pitch: float) -> None:
    """At 90 degrees of roll b4 has no inverse; in the body's axes the inputs are as small as anywhere."""
    gain = Gain(length, False, trig(roll, pitch, 0.4), 9.0, 0.5, (0.3, -0.2, 0.1))
    demanded = (1.0, 2.0, -1.5)
    inputs = solve(gain, demanded)
    assert apply(gain, inputs) == pytest.approx(demanded, abs=1e-12)
    assert max(map(abs, inputs)) < 5.0


def test_the_papers_form_is_singular_there() -> None:
    t = trig(math.pi / 2, 0.0, 0.0)
    solved = solve_b4(t, 9.0, (1.0, 0.0, 2.0, -1.5))
    assert apply_b4(t, 9.0, solved) != pytest.approx((1.0, 0.0, 2.0, -1.5), abs=0.1)


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("constant", [False, True])
def test_finite_in_free_fall(length: int, constant: bool) -> None:
    for thrust in (0.0, -1.0, 1e-9):
        gain = Gain(length, constant, trig(0.4, -0.3, 2.0), thrust, 0.0, (0.1, 0.2, 0.3))
        for demanded in ((-G, 0.0, 0.0), (1.0, 2.0, 3.0), (-2 * G, 0.0, 0.1)):
            assert all(abs(u) < 1e3 for u in solve(gain, demanded))


@pytest.mark.parametrize("lean", [0.1, 0.6, 1.0, 1.4])
@pytest.mark.parametrize("toward", [-2.0, 0.0, 1.0, 3.0])
@pytest.mark.parametrize("yaw", [-2.5, 0.0, 2.0])
def test_attitude_of_a_thrust_vector(lean: float, toward: float, yaw: float) -> None:
    """Depth attitude: any direction of the upper half space, at any yaw."""
    size = 12.0
    fx, fy = size * math.sin(lean) * math.cos(toward), size * math.sin(lean) * math.sin(toward)
    fz = size * math.cos(lean)
    thrust, roll, pitch = solve(Gain(2, False, trig(0.0, 0.0, yaw)), (fz - G, fx, fy))
    assert thrust == pytest.approx(size)
    assert [size * c for c in thrust_direction_nwu((roll, pitch, yaw))] == pytest.approx([fx, fy, fz])


@pytest.mark.parametrize("seed", SEEDS)
def test_to_world_is_the_rotation(seed: int) -> None:
    rng = random.Random(seed)
    euler = tuple(rng.uniform(-3.0, 3.0) for _ in range(3))
    assert to_world(trig(*euler), (0.0, 0.0, 1.0)) == pytest.approx(thrust_direction_nwu(euler), abs=1e-12)
    assert to_world(trig(0.0, 0.0, euler[2]), (1.0, 0.0, 0.0)) == pytest.approx(
        (math.cos(euler[2]), math.sin(euler[2]), 0.0)
    )
    vector = tuple(rng.uniform(-1.0, 1.0) for _ in range(3))
    assert math.hypot(*to_world(trig(*euler), vector)) == pytest.approx(math.hypot(*vector))
