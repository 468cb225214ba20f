"""The attitude law against its own definition, written another way: tilt first, yaw by its weight."""

import math
import random

import pytest

from sitl_mock.attitude_loop import wanted_rates
from sitl_mock.geometry import conjugate, from_euler, multiply, normalised, rotate

GAINS = (6.5, 6.5, 2.8)
FREE = (1e3, 1e3, 1e3)
LEVEL = (1.0, 0.0, 0.0, 0.0)


def rates(attitude, wanted, yaw_rate=0.0, weight=0.4, limits=FREE):
    return wanted_rates(attitude, wanted, yaw_rate, GAINS, weight, limits)


def turn(axis, angle_rad):
    half = angle_rad / 2
    return (math.cos(half), *(math.sin(half) * part for part in axis))


def by_vectors(attitude, wanted, weight):
    """The same law from the two z axes in the world: the shortest turn between them, then a part of the rest."""
    down, wanted_down = rotate(attitude, (0.0, 0.0, 1.0)), rotate(wanted, (0.0, 0.0, 1.0))
    cross = (
        down[1] * wanted_down[2] - down[2] * wanted_down[1],
        down[2] * wanted_down[0] - down[0] * wanted_down[2],
        down[0] * wanted_down[1] - down[1] * wanted_down[0],
    )
    sine = math.hypot(*cross)
    angle = math.atan2(sine, sum(a * b for a, b in zip(down, wanted_down, strict=True)))
    tilted = multiply(turn(tuple(part / sine for part in cross), angle), attitude)
    rest = multiply(conjugate(tilted), wanted)
    rest_rad = 2 * math.atan2(rest[3], rest[0])
    rest_rad = (rest_rad + math.pi) % math.tau - math.pi
    goal = multiply(tilted, turn((0.0, 0.0, 1.0), weight * rest_rad))
    error = multiply(conjugate(attitude), goal)
    twice = math.copysign(2.0, error[0])
    return (6.5 * twice * error[1], 6.5 * twice * error[2], 2.8 / weight * twice * error[3])


def test_it_is_the_law_with_reduced_yaw():
    draw = random.Random(4)
    for _ in range(300):
        attitude, wanted = (normalised(tuple(draw.gauss(0, 1) for _ in range(4))) for _ in range(2))
        weight = draw.uniform(0.1, 1.0)
        assert rates(attitude, wanted, weight=weight) == pytest.approx(by_vectors(attitude, wanted, weight), abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_small_errors_are_answered_by_the_gains(axis):
    wanted = [0.0, 0.0, 0.0]
    wanted[axis] = 0.01
    expected = [GAINS[i] * 0.01 if i == axis else 0.0 for i in range(3)]
    assert rates(LEVEL, from_euler(*wanted)) == pytest.approx(expected, rel=1e-4, abs=1e-9)


def test_a_large_yaw_error_does_not_bend_the_way_of_the_tilt():
    # level, heading 2 rad off, 0.2 rad of roll asked for at that heading: the turn must be about that horizontal axis
    p, q, _ = rates(LEVEL, from_euler(0.2, 0.0, 2.0))
    assert math.atan2(q, p) == pytest.approx(2.0, abs=0.7)
    whole = rates(LEVEL, from_euler(0.2, 0.0, 2.0), weight=1.0)
    assert abs(math.atan2(q, p) - 2.0) < abs(math.atan2(whole[1], whole[0]) - 2.0)


def test_both_signs_of_a_quaternion_and_any_length_are_the_same_attitude():
    wanted = from_euler(0.3, -0.4, 2.0)
    assert rates(LEVEL, tuple(-2 * part for part in wanted)) == pytest.approx(rates(LEVEL, wanted))


def test_a_half_turn_of_tilt_is_answered_by_something_finite():
    assert rates(LEVEL, from_euler(math.pi, 0.0, 0.0))[0] == pytest.approx(13.0)


def test_the_yaw_rate_is_about_the_vertical():
    assert rates(LEVEL, LEVEL, yaw_rate=0.5) == pytest.approx((0.0, 0.0, 0.5))
    rolled = from_euler(math.radians(30.0), 0.0, 0.0)
    assert rates(rolled, rolled, yaw_rate=0.5) == pytest.approx((0.0, 0.25, 0.5 * math.cos(math.radians(30.0))))


def test_each_axis_is_limited():
    wanted = from_euler(-1.0, 1.0, 0.0)
    p, q, _ = rates(LEVEL, wanted, limits=(1.0, 2.0, 3.0))
    assert (p, q) == (-1.0, 2.0)
    assert rates(LEVEL, LEVEL, yaw_rate=9.0, limits=(1.0, 2.0, 3.0)) == (0.0, 0.0, 3.0)
