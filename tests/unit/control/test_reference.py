"""Rest-to-rest legs: ends, limits, and four continuous derivatives."""

from __future__ import annotations

import math

import pytest

from mavquad.control.reference import Leg, Pose, ReferenceParams, end_us, hold, plan_leg, sample, shifted

ORIGIN = Pose((1.0, -2.0, 3.0), 0.5)
GOAL = Pose((3.0, -1.0, 2.0), 2.0)


def _leg(duration_s: float = 4.0) -> Leg:
    return Leg(1_000_000, duration_s, ORIGIN, GOAL)


def test_ends_are_poses_at_rest() -> None:
    leg = _leg()
    for stamp, pose in ((0, ORIGIN), (1_000_000, ORIGIN), (5_000_000, GOAL), (60_000_000, GOAL)):
        assert sample(leg, stamp) == hold(pose)
    middle = sample(leg, 3_000_000)
    assert (middle.x_m[0], middle.y_m[0], middle.z_m[0]) == pytest.approx((2.0, -1.5, 2.5))
    assert middle.yaw_rad[0] == pytest.approx(1.25)


def test_each_derivative_is_that_of_the_one_before() -> None:
    leg, h = _leg(), 500
    for stamp in range(1_100_000, 5_000_000, 190_000):
        before, now, after = (sample(leg, stamp + d) for d in (-h, 0, h))
        for a, b, c in zip(before.channels(), now.channels(), after.channels(), strict=True):
            for k in range(4):
                assert (c[k] - a[k]) / (2e-6 * h) == pytest.approx(b[k + 1], abs=2e-4)


def test_four_derivatives_are_continuous_at_both_ends() -> None:
    leg = _leg()
    for edge in (1_000_000, 5_000_000):
        inside = sample(leg, edge + (40 if edge == 1_000_000 else -40))
        outside = sample(leg, edge)
        for a, b in zip(inside.channels(), outside.channels(), strict=True):
            assert a == pytest.approx(b, abs=2e-3)


def test_limits_are_met_and_one_of_them_reached() -> None:
    params = ReferenceParams(speed_max_m_s=1.0, acceleration_max_m_s2=0.5)
    leg = plan_leg(params, 0, ORIGIN, Pose((21.0, -2.0, 3.0), 0.5))
    points = [sample(leg, t) for t in range(0, end_us(leg), 10_000)]
    assert max(abs(p.x_m[1]) for p in points) == pytest.approx(1.0, rel=1e-3)
    assert max(abs(p.x_m[2]) for p in points) <= 0.5 + 1e-9
    short = plan_leg(params, 0, ORIGIN, Pose((2.0, -2.0, 3.0), 0.5))
    points = [sample(short, t) for t in range(0, end_us(short), 5_000)]
    assert max(abs(p.x_m[2]) for p in points) == pytest.approx(0.5, rel=1e-3)


def test_yaw_limits_decide_a_turn_on_the_spot() -> None:
    params = ReferenceParams(yaw_rate_max_deg_s=30.0, yaw_acceleration_max_deg_s2=200.0)
    leg = plan_leg(params, 0, Pose((0.0, 0.0, 0.0), 0.0), Pose((0.0, 0.0, 0.0), math.pi / 2))
    rates = [sample(leg, t).yaw_rad[1] for t in range(0, end_us(leg), 5_000)]
    assert max(rates) == pytest.approx(math.radians(30.0), rel=1e-3)


def test_yaw_goes_the_shorter_way_and_stays_continuous() -> None:
    leg = plan_leg(ReferenceParams(), 0, Pose((0.0, 0.0, 0.0), 3.0), Pose((0.0, 0.0, 0.0), -3.0))
    assert leg.goal.yaw_rad == pytest.approx(2 * math.pi - 3.0)


def test_nowhere_to_go_takes_the_least_time() -> None:
    leg = plan_leg(ReferenceParams(duration_min_s=0.7), 5, ORIGIN, ORIGIN)
    assert leg.duration_s == 0.7
    assert sample(leg, 300_000) == hold(ORIGIN)


def test_taylor_shift() -> None:
    assert shifted((1.0, 2.0, 3.0, 4.0, 5.0), 2.0) == pytest.approx(
        (1 + 4 + 6 + 4 * 8 / 6 + 5 * 16 / 24, 2 + 6 + 8 + 5 * 8 / 6, 3 + 8 + 10, 14.0, 5.0)
    )
    leg = _leg()
    now, later = sample(leg, 3_000_000), sample(leg, 3_050_000)
    assert shifted(now.x_m, 0.05)[0] == pytest.approx(later.x_m[0], abs=1e-6)
