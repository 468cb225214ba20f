"""The step of five boxcars: against the convolution itself, its bounds, its time, and long ways."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.control.trajectories.step import (
    AFTER,
    BEFORE,
    Bounds,
    boxcars,
    phase_boxcars,
    rise_times,
    step,
    stretched,
)

limit = st.floats(0.05, 20.0)
bounds = st.builds(Bounds, limit, limit, limit, limit)


def truncated_powers(times, t_s):
    """The same spline in the textbook's form, with exact fractions: sum of +- (t - edge)^5 / (5! T1 .. T5)."""
    t, lengths = Fraction(t_s), [Fraction(length) for length in times]
    scale = math.prod(lengths)
    values = []
    for order in range(5):
        total = Fraction(0)
        for chosen in itertools.product((0, 1), repeat=5):
            since = t - sum((x for x, c in zip(lengths, chosen, strict=True) if c), Fraction(0))
            if since > 0:
                total += (-1) ** sum(chosen) * since ** (5 - order) / math.factorial(5 - order)
        values.append(float(total / scale))
    return values


@pytest.mark.parametrize(
    "times", [(1.3, 0.7, 0.31, 0.2, 0.1), (2.0, 1.0, 0.5, 0.25, 0.25), (700.0, 1.2, 0.5, 0.3, 0.3)]
)
@pytest.mark.parametrize("share", [0.001, 0.1, 0.3, 0.5, 0.77, 0.999])
def test_it_is_the_convolution(times, share):
    t_s = share * sum(times)
    scales = (1.0, times[0], times[0] * times[1], math.prod(times[:3]), math.prod(times[:4]))
    found = [value * scale for value, scale in zip(step(times).at(t_s), scales, strict=True)]
    wanted = [value * scale for value, scale in zip(truncated_powers(times, t_s), scales, strict=True)]
    assert found == pytest.approx(wanted, abs=1e-9)


@given(st.floats(1e-6, 1e4), bounds)
def test_no_bound_is_passed_and_one_is_reached(way, limits):
    times = boxcars(way, limits)
    reached = [way / math.prod(times[: k + 1]) for k in range(4)]
    shares = [r / b for r, b in zip(reached, (limits.first, limits.second, limits.third, limits.fourth), strict=True)]
    assert max(shares) == pytest.approx(1.0, rel=1e-9)
    for k in range(4):  # no two pulses of a derivative overlap
        assert times[k] >= sum(times[k + 1 :]) * (1.0 - 1e-9)


LIMITS = [
    Bounds(1.5, 1.2, 2.5, 8.0),
    Bounds(1.0, 4.0, 1.0, 9.0),
    Bounds(0.8, 0.8, 0.75, 2.1),
    Bounds(3.0, 1.0, 9.0, 1.0),
]


@pytest.mark.parametrize("limits", LIMITS, ids=str)
@pytest.mark.parametrize("way", [0.01, 0.3, 2.0, 7.0, 60.0])
def test_no_other_boxcars_of_this_shape_are_faster(way, limits):
    """All of a grid around the solution: T5 = T4, T1 as short as the bounds and the order of the boxcars allow."""
    times = boxcars(way, limits)
    factors = [1.15**k for k in range(-9, 10)]
    for f2, f3, f4 in itertools.product(factors, repeat=3):
        t2, t3, t4 = times[1] * f2, times[2] * f3, times[3] * f4
        if t3 < 2.0 * t4 or t2 < t3 + 2.0 * t4:
            continue
        t1 = max(
            way / limits.first,
            way / limits.second / t2,
            way / limits.third / t2 / t3,
            way / limits.fourth / t2 / t3 / t4,
            t2 + t3 + 2.0 * t4,
        )
        assert t1 + t2 + t3 + 2.0 * t4 >= sum(times) * (1.0 - 1e-9)


def test_where_only_the_fourth_bound_is_reached_each_boxcar_is_as_long_as_all_after_it():
    """D = s T1 T2 T3 T4 = 8 * 2 * 1 * 0.5 * 0.25."""
    assert boxcars(2.0, LIMITS[0]) == pytest.approx((2.0, 1.0, 0.5, 0.25, 0.25), rel=1e-12)


@given(st.floats(1e-3, 1e3), bounds, st.floats(0.0, 1.0))
def test_the_spline_keeps_to_the_bounds(way, limits, share):
    profile = step(boxcars(way, limits))
    value, *derivatives = profile.at(share * profile.duration_s)
    assert 0.0 <= value <= 1.0
    for derivative, bound in zip(derivatives, (limits.first, limits.second, limits.third, limits.fourth), strict=True):
        assert abs(derivative) * way <= bound * (1.0 + 1e-9)


@given(st.floats(1e-3, 1e3), bounds)
def test_a_longer_way_takes_longer_and_wider_bounds_take_less(way, limits):
    assert sum(boxcars(way * 1.01, limits)) > sum(boxcars(way, limits))
    wider = Bounds(limits.first * 1.1, limits.second * 1.1, limits.third * 1.1, limits.fourth * 1.1)
    assert sum(boxcars(way, wider)) < sum(boxcars(way, limits))


@given(bounds, st.floats(0.0, 1.0))
def test_the_two_halves_are_alike(limits, share):
    profile = step(boxcars(3.0, limits))
    t_s = share * profile.duration_s
    one, other = profile.at(t_s), profile.at(profile.duration_s - t_s)
    assert one[0] + other[0] == pytest.approx(1.0, abs=1e-12)
    assert one[1] == pytest.approx(other[1], abs=1e-9 * limits.first)
    assert one[2] == pytest.approx(-other[2], abs=1e-9 * limits.second)


def test_no_derivative_jumps_at_a_joint():
    profile = step(boxcars(2.0, Bounds(1.5, 1.2, 2.5, 8.0)))
    for joint in (*profile.starts_s[1:], profile.duration_s):
        before, after = profile.at(joint - 1e-9), profile.at(joint)
        assert before == pytest.approx(after, abs=1e-6)
    assert profile.at(0.0) == BEFORE
    assert profile.at(profile.duration_s) == AFTER


def test_a_cruise_of_kilometres_keeps_every_digit():
    limits = Bounds(1.5, 1.2, 2.5, 8.0)
    profile = step(boxcars(5000.0, limits))
    middle = profile.at(profile.duration_s / 2.0)
    assert middle[0] == pytest.approx(0.5, abs=1e-15)
    assert middle[1] * 5000.0 == pytest.approx(1.5, rel=1e-12)
    assert [abs(value) for value in middle[2:]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-20)
    assert profile.at(profile.duration_s - 1e-6)[0] == pytest.approx(1.0, abs=1e-15)


def test_a_phase_runs_at_a_rate_of_one_between_its_ramps():
    profile = step(phase_boxcars(20.0, 4.0))
    assert profile.duration_s == pytest.approx(24.0)
    for t_s in (4.0, 10.0, 20.0):
        value, rate, *rest = (20.0 * derivative for derivative in profile.at(t_s))
        assert (value, rate) == pytest.approx((t_s - 2.0, 1.0))
        assert rest == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert profile.at(3.0)[1] * 20.0 < 1.0


def test_a_phase_shorter_than_its_ramp_just_reaches_the_rate():
    profile = step(phase_boxcars(1.0, 4.0))
    assert profile.duration_s == pytest.approx(2.0)
    assert profile.at(1.0)[1] == pytest.approx(1.0)
    assert max(profile.at(0.001 * k)[1] for k in range(2000)) <= 1.0 + 1e-12


def test_the_rise_of_a_long_way():
    limits = Bounds(1.5, 1.2, 2.5, 8.0)
    assert rise_times(1.5, limits) == pytest.approx(boxcars(50.0, limits)[1:])


def test_stretching_never_shortens():
    times = (1.0, 0.5, 0.2, 0.1, 0.1)
    assert stretched(times, 1.0) == times
    assert sum(stretched(times, 5.0)) == pytest.approx(5.0)
