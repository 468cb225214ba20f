"""Circle and eight: where they lead, and five derivatives; flown along, with the chain rule, and looked along."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from mavquad.control.trajectories.along import along, channels
from mavquad.control.trajectories.chain_rule import composed
from mavquad.control.trajectories.curves import Circle, Eight
from mavquad.control.trajectories.heading import NoHeading, unwound
from mavquad.control.trajectories.spline import spline

CURVES = {
    "clockwise": Circle(2.0, 9.0, True, 2),
    "counterclockwise": Circle(1.0, 7.0, False),
    "upright eight": Eight(1.25, 0.75, 8.0, True),
    "level eight": Eight(1.25, 0.75, 8.0, False, 2),
    "spline": spline([(t, math.sin(t), t * t * 0.1, 0.3 * t, 0.1 * t) for t in (0.0, 1.0, 2.2, 3.0, 4.5, 5.0)]),
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_each_derivative_is_that_of_the_one_before(curve):
    h = 1e-5
    for k in range(1, 40):
        phase = curve.length_s * (k + 0.1234) / 42.0
        before, now, after = (curve.at(phase + d) for d in (-h, 0.0, h))
        for a, b, c in zip(before, now, after, strict=True):
            for order in range(5):
                assert (c[order] - a[order]) / (2.0 * h) == pytest.approx(b[order + 1], abs=1e-5)


def test_the_circle_leaves_northwards_and_turns_to_its_side():
    for clockwise, west in ((True, -1.0), (False, 1.0)):
        curve = Circle(2.0, 8.0, clockwise)
        x, y, z, _ = curve.at(0.0)
        assert (x[0], y[0], z[0]) == (0.0, 0.0, 0.0)
        assert (x[1], y[1]) == pytest.approx((math.tau * 2.0 / 8.0, 0.0))
        x, y, _, _ = curve.at(2.0)
        assert (x[0], y[0]) == pytest.approx((2.0, west * 2.0))
        x, y, _, _ = curve.at(4.0)
        assert (x[0], y[0]) == pytest.approx((0.0, west * 4.0), abs=1e-12)


def test_the_eights_are_those_of_the_literature():
    upright, level = Eight(1.25, 0.75, math.tau, True), Eight(1.25, 0.75, math.tau, False)
    for t in (0.0, 0.4, 1.9, 5.0):
        x, y, z, _ = upright.at(t)
        assert (x[0], y[0], z[0]) == pytest.approx((1.25 * math.sin(t), 0.0, 0.75 * math.sin(2.0 * t)))
        x, y, z, _ = level.at(t)
        assert (x[0], -y[0], z[0]) == pytest.approx((1.25 * math.sin(t), 0.75 * math.sin(2.0 * t), 0.0))


def test_the_chain_rule_is_sympys():
    t, phase = sympy.symbols("t phase")
    inner = t**5 / 7 - 2 * t**3 + sympy.sin(t)
    outer = sympy.exp(phase / 3) + phase**6 / 50
    for moment in (0.3, 1.1):
        place = float(inner.subs(t, moment))
        g = [float(outer.diff(phase, k).subs(phase, place)) for k in range(5)]
        p = [float(inner.diff(t, k).subs(t, moment)) for k in range(5)]
        wanted = [float(outer.subs(phase, inner).diff(t, k).subs(t, moment)) for k in range(5)]
        assert composed(g, tuple(p)) == pytest.approx(wanted, rel=1e-12)


def test_the_heading_is_sympys():
    s = sympy.symbols("s", real=True)
    w = sympy.Rational(2, 8) * sympy.pi
    x, y = sympy.Rational(5, 4) * sympy.sin(w * s), -sympy.Rational(3, 4) * sympy.sin(2 * w * s)
    rate = (x.diff(s) * y.diff(s, 2) - y.diff(s) * x.diff(s, 2)) / (x.diff(s) ** 2 + y.diff(s) ** 2)
    curve = Eight(1.25, 0.75, 8.0, False)
    heading = unwound(curve)
    for phase in (0.0, 0.7, 1.9, 2.0, 3.3, 7.9):
        angle, *derivatives = heading.at(phase, curve.at(phase))
        x1, y1 = (float(c.diff(s).subs(s, phase)) for c in (x, y))
        assert math.cos(angle - math.atan2(y1, x1)) == pytest.approx(1.0)
        wanted = [float(rate.diff(s, k).subs(s, phase).evalf()) for k in range(4)]
        assert derivatives == pytest.approx(wanted, abs=1e-8, rel=1e-9)


@pytest.mark.parametrize("name", ["clockwise", "counterclockwise", "level eight", "spline"])
def test_flown_along_all_channels_have_four_derivatives(name):
    flight = along(1_000_000, CURVES[name], 2.0, True)
    h = 200
    for k in range(60):
        stamp = 1_000_000 + round(flight.duration_s * 1e6 * (k + 0.37) / 60.0)
        before, now, after = (channels(flight, stamp + d) for d in (-h, 0, h))
        for a, b, c in zip(before, now, after, strict=True):
            for order in range(4):
                assert (c[order] - a[order]) / (2e-6 * h) == pytest.approx(b[order + 1], abs=2e-3, rel=1e-4)


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_it_begins_and_ends_at_rest_where_the_curve_does(curve):
    flight = along(1_000_000, curve, 2.0, False)
    for edge, inside, phase in (
        (1_000_000, 50, 0.0),
        (1_000_000 + round(flight.duration_s * 1e6), -50, curve.length_s),
    ):
        x, y, z, yaw = curve.at(phase)
        for stamp in (edge - inside, edge + inside, edge - 5_000_000 * inside):
            for channel, place in zip(channels(flight, stamp), (z, yaw, x, y), strict=True):
                assert channel[0] == pytest.approx(place[0], abs=1e-9)
                assert channel[1:4] == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)
                assert channel[4] == pytest.approx(0.0, abs=0.02)


def test_after_the_ramp_it_flies_at_the_curves_own_pace():
    flight = along(0, Circle(2.0, 9.0, True, 2), 3.0, False)
    speeds = [math.hypot(x[1], y[1]) for _, _, x, y in (channels(flight, s * 500_000) for s in range(6, 36))]
    assert speeds == pytest.approx([math.tau * 2.0 / 9.0] * 30)


def test_yaw_grows_over_many_laps_and_never_jumps():
    laps = 7
    flight = along(0, Circle(1.0, 6.0, False, laps), 2.0, True)
    yaws = [channels(flight, k * 20_000)[1][0] for k in range(round(flight.duration_s * 50) + 2)]
    steps = [b - a for a, b in pairwise(yaws)]
    assert min(steps) >= 0.0
    assert max(steps) <= 0.02 * math.tau / 6.0 + 1e-9
    assert yaws[-1] == pytest.approx(math.tau * laps)
    assert channels(flight, 20_000_000)[1] == channels(flight, 20_000_000)[1]  # asked again, out of order


@given(st.floats(-50.0, 50.0))
def test_of_all_whole_turns_the_nearest_one(yaw):
    for curve, looks in ((Eight(1.25, 0.75, 8.0, False), True), (CURVES["spline"], False)):
        flight = along(0, curve, 2.0, looks, yaw)
        assert abs(channels(flight, 0)[1][0] - yaw) <= math.pi + 1e-9
        zero = along(0, curve, 2.0, looks, 0.0)
        turns = (channels(flight, 3_000_000)[1][0] - channels(zero, 3_000_000)[1][0]) / math.tau
        assert turns == pytest.approx(round(turns), abs=1e-9)


def test_the_yaw_of_a_path_looks_along_the_velocity():
    flight = along(0, CURVES["level eight"], 2.0, True)
    for k in range(50, 900):
        _, yaw, x, y = channels(flight, k * 20_000)
        if math.hypot(x[1], y[1]) > 1e-6:
            assert math.cos(yaw[0] - math.atan2(y[1], x[1])) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("curve", "at_s"),
    [
        (Eight(1.25, 0.75, 8.0, True), 2.0),
        (spline([(0.0, 0.0, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 1.0, 0.0)]), 0.0),
        (spline([(0.0, 0.0, 0.0, 0.0, 0.0), (2.0, 1.0, 0.0, 0.0, 0.0), (4.0, 0.0, 0.0, 0.0, 0.0)]), 2.0),
    ],
)
def test_a_curve_that_reverses_or_climbs_has_no_heading(curve, at_s):
    with pytest.raises(NoHeading) as caught:
        unwound(curve)
    assert caught.value.at_s == pytest.approx(at_s, abs=0.01)


def test_a_hairpin_is_unwound_as_it_is_flown():
    """Half a turn within 20 ms, on a grid of 125 ms."""
    curve = Eight(2.0, 0.01, 8.0, False)
    heading = unwound(curve)
    phases = np.linspace(0.0, 8.0, 80_001)
    velocities = [curve.at(phase)[:2] for phase in phases]
    wanted = np.unwrap([math.atan2(y[1], x[1]) for x, y in velocities])
    for phase, angle in list(zip(phases, wanted, strict=True))[::37]:
        assert heading.at(phase, curve.at(phase))[0] == pytest.approx(angle, abs=1e-9)
    assert max(wanted) - min(wanted) > math.pi
