"""A velocity that is the slope of the position, and one that is not."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.velocity_check import BELIEVED_M_S, VelocityCheck
from mavquad.types import Position


def flown(error_m_s=0.0, seconds=5.0, step_us=10_000, lost=lambda number: False, offset_m=0.0):
    """Along a circle; the velocity errs by `error_m_s` to the west."""
    check = VelocityCheck()
    for number in range(round(seconds * 1e6 / step_us)):
        t_s = number * step_us * 1e-6
        place = (math.cos(t_s) + offset_m * t_s, math.sin(t_s), 0.3 * t_s)
        velocity = (-math.sin(t_s) + offset_m, math.cos(t_s) + error_m_s, 0.3)
        if not lost(number):
            check.take(Position(number * step_us, place, velocity))
    return check


def test_the_slope_of_the_position_is_believed():
    assert flown().difference_m_s < 1e-3
    assert not flown().misleads


@pytest.mark.parametrize("error_m_s", [0.1, -0.2])
def test_another_velocity_is_not_and_by_how_much(error_m_s):
    assert flown(error_m_s).difference_m_s == pytest.approx(abs(error_m_s), rel=0.02)
    assert flown(error_m_s).misleads


def test_nothing_is_said_before_two_seconds():
    assert flown(1.0, seconds=1.5).difference_m_s == 0.0
    assert not flown(1.0, seconds=1.5).misleads


def test_frames_lost_here_and_there_are_no_difference():
    assert flown(lost=lambda number: number % 5 == 3).difference_m_s < 0.01


def test_over_a_gap_nothing_is_compared():
    check = flown(lost=lambda number: 150 <= number < 250)
    assert check.difference_m_s < 0.01
    assert flown(0.1, lost=lambda number: 150 <= number < 250).difference_m_s == pytest.approx(0.1, rel=0.02)


def test_the_limit_is_between_the_simulators():
    """ArduCopter 4.7: 0.02 m/s; PX4 1.13.3 in SIH: 0.13."""
    assert 0.03 < BELIEVED_M_S < 0.1
