"""Splines through points: met, smooth, the smoothest; and near them where they are close together."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.control.trajectories.spline import NoCurve, misses_m, spline, thinned

place = st.floats(-10.0, 10.0)


@given(st.lists(st.tuples(st.floats(0.1, 5.0), place, place, place, place), min_size=2, max_size=25))
def test_points_apart_are_met_and_six_derivatives_are_continuous(rows):
    time, samples = 7.0, []
    for dt, *point in rows:
        time += dt
        samples.append((time, *point))
    curve = spline(samples)
    assert curve.length_s == pytest.approx(samples[-1][0] - samples[0][0])
    assert max(misses_m(curve, samples)) < 1e-6
    for joint in curve.starts_s[1:]:
        for before, after in zip(curve.at(joint - 1e-9), curve.at(joint), strict=True):
            for order in range(5):
                scale = 1.0 + abs(after[order]) + abs(after[order + 1])
                assert before[order] == pytest.approx(after[order], abs=1e-4 * scale)


def test_the_yaw_goes_through_its_values_too():
    samples = [(float(t), 0.0, 0.0, 0.0, math.sin(t)) for t in range(8)]
    curve = spline(samples)
    assert [curve.at(t)[3][0] for t, *_ in samples] == pytest.approx([s[4] for s in samples])


def test_it_has_the_least_snap_of_all_curves_through_the_points():
    """Any other one is this plus a bump that is zero at the points; the squared snap must grow with it."""
    times = [0.0, 1.0, 2.5, 3.0, 4.0, 6.0]
    samples = [(t, math.cos(1.3 * t), 0.0, 0.0, 0.0) for t in times]
    curve = spline(samples)
    grid = np.linspace(1e-9, 6.0 - 1e-9, 60_001)
    snap = np.array([curve.at(t)[0][4] for t in grid])
    bump = np.polynomial.Polynomial.fromroots(times)
    for factor in (np.polynomial.Polynomial([1.0]), np.polynomial.Polynomial([0.0, 1.0])):
        other = (bump * factor).deriv(4)(grid)
        assert abs(np.sum(snap * other)) < 1e-3 * np.sqrt(np.sum(snap**2) * np.sum(other**2))


def test_two_points_make_a_line_and_three_a_parabola():
    line = spline([(0.0, 0.0, 0.0, 0.0, 0.0), (4.0, 2.0, 0.0, 0.0, 0.0)])
    assert line.at(1.0)[0] == pytest.approx((0.5, 0.5, 0.0, 0.0, 0.0, 0.0), abs=1e-12)
    parabola = spline([(float(t), t * t, 0.0, 0.0, 0.0) for t in range(3)])
    assert parabola.at(1.5)[0] == pytest.approx((2.25, 3.0, 2.0, 0.0, 0.0, 0.0), abs=1e-12)


def test_rounded_rows_close_in_time_are_smoothed():
    rows = [(k * 0.01, round(math.sin(k * 0.01), 3), round(0.2 * k * 0.01, 3), 0.0, 0.0) for k in range(1000)]
    curve = spline(rows, 0.5)
    assert max(misses_m(curve, rows)) < 0.002
    for t in np.linspace(0.5, 9.4, 200):
        assert curve.at(t)[0][:5] == pytest.approx(
            (math.sin(t), math.cos(t), -math.sin(t), -math.cos(t), math.sin(t)), abs=0.3
        )
    assert max(abs(spline(rows).at(t)[0][4]) for t in np.linspace(0.5, 9.4, 200)) > 1000.0


@given(st.lists(st.floats(0.01, 2.0), min_size=1, max_size=60), st.floats(0.0, 3.0))
def test_knots_are_kept_apart(gaps, least):
    times = [0.0]
    for gap in gaps:
        times.append(times[-1] + gap)
    kept = thinned(times, least)
    assert kept[0] == 0
    assert kept[-1] == len(times) - 1
    assert all(times[b] - times[a] >= least for a, b in pairwise(kept)) or len(kept) == 2
    assert least > 0.0 or len(kept) == len(times)


def test_times_that_are_too_uneven_are_refused_and_not_guessed():
    rng = random.Random(3)
    times = [0.0]
    for k in range(30):
        times.append(times[-1] + (1e-4 if k % 3 else 900.0))
    with pytest.raises(NoCurve):
        spline([(t, rng.uniform(-5, 5), rng.uniform(-5, 5), 0.0, 0.0) for t in times])
