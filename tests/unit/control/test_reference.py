"""Rest-to-rest legs: ends, limits, and four continuous derivatives."""

from __future__ import annotations

import math

import pytest

from mavquad.control.reference import Leg, Pose, ReferenceParams, end_us, hold, plan_leg, sample, shifted

ORIGIN = Pose((1.0, -2.0, 3.0), 0.5)
GOAL = Pose((3.0, -1.0, 2.0), 2.0)


def _leg() -> Leg:
    """Of 4 s: the limits allow less."""
    brisk = {"speed_max_m_s": 9.0, "acceleration_max_m_s2": 9.0, "jerk_max_m_s3": 90.0, "snap_max_m_s4": 900.0}
    turn = {"yaw_rate_max_deg_s": 360.0, "yaw_acceleration_max_deg_s2": 900.0, "yaw_jerk_max_deg_s3": 9e3}
    params = ReferenceParams(**brisk, **turn, yaw_snap_max_deg_s4=9e4, duration_min_s=4.0)
    leg = plan_leg(params, 1_000_000, ORIGIN, GOAL)
    assert leg.duration_s == 4.0
    return leg


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
            assert len(a) == len(b) == 5
            assert a == pytest.approx(b, abs=2e-3)


def _peaks(leg: Leg, channel: str) -> list[float]:
    """Largest magnitudes of the first to fourth derivative."""
    points = [getattr(sample(leg, leg.start_us + round(leg.duration_s * 1e6 * k / 4000)), channel) for k in range(4001)]
    return [max(abs(point[order]) for point in points) for order in (1, 2, 3, 4)]


@pytest.mark.parametrize("way_m", [1e-3, 0.02, 0.3, 1.0, 2.0, 4.0, 10.0, 50.0, 500.0])
def test_limits_are_met_and_one_of_them_reached(way_m: float) -> None:
    params = ReferenceParams(duration_min_s=0.1)
    leg = plan_leg(params, 0, ORIGIN, Pose((1.0 + way_m, -2.0, 3.0), 0.5))
    limits = (1.5, 1.2, 2.5, 8.0)
    shares = [peak / limit for peak, limit in zip(_peaks(leg, "x_m"), limits, strict=True)]
    assert max(shares) <= 1.0 + 1e-9
    assert max(shares) == pytest.approx(1.0, abs=0.02)


def test_a_long_way_is_cruised_at_the_largest_speed() -> None:
    leg = plan_leg(ReferenceParams(), 0, ORIGIN, Pose((31.0, -42.0, 3.0), 0.5))  # 50 m, 3 : -4
    assert leg.duration_s == pytest.approx(50.0 / 1.5 + 2.35, abs=0.05)
    for stamp in range(4_000_000, 32_000_000, 1_000_000):
        point = sample(leg, stamp)
        assert point.x_m[1:] == pytest.approx((0.9, 0.0, 0.0, 0.0), abs=1e-12)
        assert point.y_m[1:] == pytest.approx((-1.2, 0.0, 0.0, 0.0), abs=1e-12)
    assert sample(leg, end_us(leg) + 1) == hold(Pose((31.0, -42.0, 3.0), 0.5))


def test_a_leg_of_the_default_box_is_about_as_brisk_as_the_polynomial_of_degree_9() -> None:
    leg = plan_leg(ReferenceParams(), 0, ORIGIN, Pose((3.0, -2.0, 3.0), 0.5))
    assert leg.duration_s == pytest.approx(3.95, abs=0.1)  # that of the polynomial
    speed, acceleration, jerk, snap = _peaks(leg, "x_m")
    assert speed < 1.25
    assert acceleration < 1.20
    assert jerk < 2.55
    assert snap < 1.6 * 5.10


def test_yaw_limits_decide_a_turn_on_the_spot() -> None:
    here = Pose((0.0, 0.0, 0.0), 0.0)
    limits = {"yaw_rate_max_deg_s": 30.0, "yaw_acceleration_max_deg_s2": 200.0, "yaw_jerk_max_deg_s3": 900.0}
    params = ReferenceParams(**limits, yaw_snap_max_deg_s4=9000.0)
    rate, *_ = _peaks(plan_leg(params, 0, here, Pose((0.0, 0.0, 0.0), math.pi / 2)), "yaw_rad")
    assert rate == pytest.approx(math.radians(30.0), rel=1e-6)
    leg = plan_leg(ReferenceParams(), 0, here, Pose((0.0, 0.0, 0.0), 3.1))
    shares = [math.degrees(p) / q for p, q in zip(_peaks(leg, "yaw_rad"), (45.0, 45.0, 60.0, 120.0), strict=True)]
    assert max(shares) <= 1.0 + 1e-9
    assert shares[0] == pytest.approx(1.0)


def test_the_slower_of_way_and_turn_sets_the_time_of_both() -> None:
    turned = plan_leg(ReferenceParams(), 0, ORIGIN, Pose((1.2, -2.0, 3.0), 2.0))
    assert turned.duration_s == plan_leg(ReferenceParams(), 0, ORIGIN, Pose((1.0, -2.0, 3.0), 2.0)).duration_s
    before = sample(turned, end_us(turned) - 400_000)
    assert abs(before.x_m[1]) > 1e-6
    assert abs(before.yaw_rad[1]) > 1e-6


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
