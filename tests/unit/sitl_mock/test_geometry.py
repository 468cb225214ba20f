"""The mock's quaternions against textbook turns."""

import math

import pytest

from sitl_mock.geometry import conjugate, from_euler, multiply, normalised, rotate, tilt_rad, to_euler, wrap_pi, yaw_of


def test_quarter_turns_move_the_axes():
    east = rotate(from_euler(0.0, 0.0, math.pi / 2), (1.0, 0.0, 0.0))
    assert east == pytest.approx((0.0, 1.0, 0.0))
    up = rotate(from_euler(0.0, math.pi / 2, 0.0), (1.0, 0.0, 0.0))
    assert up == pytest.approx((0.0, 0.0, -1.0))
    down = rotate(from_euler(math.pi / 2, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert down == pytest.approx((0.0, 0.0, 1.0))


def test_euler_angles_go_there_and_back():
    angles = (0.1, -0.2, 0.3)
    assert to_euler(from_euler(*angles)) == pytest.approx(angles)
    assert yaw_of(from_euler(*angles)) == pytest.approx(0.3)


def test_yaw_is_applied_last():
    q = multiply(from_euler(0.0, 0.0, 0.3), multiply(from_euler(0.0, -0.2, 0.0), from_euler(0.1, 0.0, 0.0)))
    assert q == pytest.approx(from_euler(0.1, -0.2, 0.3))
    assert multiply(q, conjugate(q)) == pytest.approx((1.0, 0.0, 0.0, 0.0))


def test_tilt_is_the_angle_to_the_vertical():
    assert tilt_rad(from_euler(0.4, 0.0, 2.0)) == pytest.approx(0.4)
    assert tilt_rad(from_euler(math.pi, 0.0, 0.0)) == pytest.approx(math.pi)


def test_normalised_and_wrapped():
    assert normalised((2.0, 0.0, 0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0)
    assert normalised((0.0, 0.0, 0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0)
    assert wrap_pi(3.5) == pytest.approx(3.5 - math.tau)
    assert wrap_pi(-3.5) == pytest.approx(math.tau - 3.5)
