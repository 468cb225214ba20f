"""sat_N: identity near zero, bounded, smooth, odd."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.control.saturation import LINEAR_SHARE, is_saturated, smooth_saturation

LEVEL = st.floats(min_value=0.01, max_value=1e4)
VALUE = st.floats(min_value=-1e6, max_value=1e6)


@given(value=VALUE, level=LEVEL)
def test_bounded_odd_and_of_the_same_sign(value: float, level: float) -> None:
    out = smooth_saturation(value, level)
    assert abs(out) <= level * (1 + 1e-12)
    assert abs(out) <= abs(value) * (1 + 1e-12)
    assert out == -smooth_saturation(-value, level)
    assert out == 0.0 or math.copysign(1.0, out) == math.copysign(1.0, value)


@given(value=st.floats(min_value=-1.0, max_value=1.0), level=LEVEL)
def test_identity_near_zero(value: float, level: float) -> None:
    inside = value * LINEAR_SHARE * level
    assert smooth_saturation(inside, level) == inside


@given(a=VALUE, b=VALUE, level=LEVEL)
def test_never_decreases(a: float, b: float, level: float) -> None:
    low, high = sorted((a, b))
    assert smooth_saturation(low, level) <= smooth_saturation(high, level)


def test_reaches_the_level_far_out() -> None:
    assert smooth_saturation(100.0, 2.0) == pytest.approx(2.0)


def test_slope_and_curvature_are_continuous_at_the_knee() -> None:
    level, h = 3.0, 1e-4
    knee = LINEAR_SHARE * level

    def slope(x: float) -> float:
        return (smooth_saturation(x + h, level) - smooth_saturation(x - h, level)) / (2 * h)

    assert slope(knee) == pytest.approx(1.0, abs=1e-6)
    assert (slope(knee + 5 * h) - slope(knee - 5 * h)) / (10 * h) == pytest.approx(0.0, abs=5e-3)


def test_says_when_it_acts() -> None:
    assert not is_saturated(0.69, 1.0)
    assert is_saturated(-0.71, 1.0)
