"""Limits of the demand."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from mavquad.control.gains import chain_gains
from mavquad.control.limits import Demand, DemandLimits, demand, ratios

G = 9.81
GAMMA = chain_gains("binomial", 4, 2.0)
STILL = (0.0,) * 5
CALM = (0.0, 0.0, 0.0)
WIDE = DemandLimits(
    speed_m_s=1e9,
    climb_m_s=1e9,
    yaw_rate_rad_s=1e9,
    yaw_acceleration_rad_s2=1e9,
    thrust_low_m_s2=-1e9,
    thrust_high_m_s2=1e9,
    tilt_tangent=1e9,
    jerk_m_s3=1e9,
)


def _plain(gamma: tuple[float, ...], reference: tuple[float, ...], chain: tuple[float, ...]) -> float:
    """ref^(r) - sigma + sum gamma_i (ref^(i-1) - zeta_i)."""
    r = len(gamma)
    return reference[r] - chain[r] + sum(g * (a - e) for g, a, e in zip(gamma, reference, chain[:r], strict=False))


def _at(place: float) -> tuple[float, ...]:
    return (place, 0.0, 0.0, 0.0, 0.0)


def _demand(references: tuple, chains: tuple, limits: DemandLimits, winds: tuple = CALM, length: int = 4) -> Demand:
    gamma = chain_gains("binomial", length, 2.0)
    return demand((ratios(gamma),) * 4, references, chains, winds, limits)


@pytest.mark.parametrize("length", [2, 3, 4])
@pytest.mark.parametrize("yaw_length", [1, 2, 3, 4])
def test_without_limits_it_is_the_law(length: int, yaw_length: int) -> None:
    """Whatever is held for wind: it says where the thrust is limited, and cancels."""
    rng = random.Random(4)
    gamma, yaw_gamma = (chain_gains("butterworth", r, 2.0) for r in (length, yaw_length))
    for _ in range(20):
        references = tuple(tuple(rng.uniform(-1, 1) for _ in range(5)) for _ in range(4))
        chains = tuple(tuple(rng.uniform(-1, 1) for _ in range(r + 1)) for r in (length, yaw_length, length, length))
        winds = tuple(rng.uniform(-3, 3) for _ in range(3))
        gammas = (gamma, yaw_gamma, gamma, gamma)
        got = demand(tuple(map(ratios, gammas)), references, chains, winds, WIDE)
        plain = [_plain(g, r, c) for g, r, c in zip(gammas, references, chains, strict=True)]
        assert got.w == pytest.approx(plain, abs=1e-9)
        assert got.active == ()


def test_a_far_goal_asks_for_no_more_than_the_tilt() -> None:
    limits = replace(WIDE, tilt_tangent=4.0 / G)
    far = (STILL, STILL, _at(30.0), _at(-40.0))
    got = _demand(far, (STILL,) * 4, limits)
    assert got.active == ("tilt",)
    assert got.w[2:] == pytest.approx((GAMMA[2] * 2.4, -GAMMA[2] * 3.2))
    leaning = (STILL, STILL, (0.0, 0.0, 2.4, 0.0, 0.0), (0.0, 0.0, -3.2, 0.0, 0.0))
    assert _demand(far, leaning, limits).w[2:] == pytest.approx((0.0, 0.0), abs=1e-9)


def _thrust(got: Demand) -> tuple[float, float, float]:
    """The thrust per mass that a demand at depth attitude means: w = push + wind - sigma, and sigma is the wind there."""
    wz, _, wx, wy = got.w
    return wx, wy, wz + G


@pytest.mark.parametrize("wind_x", [-6.0, -3.0, 0.0, 3.0, 6.0])
@pytest.mark.parametrize("goal", [(50.0, 0.0), (-50.0, 20.0), (0.3, 0.0)])
def test_wind_does_not_count_as_tilt(wind_x: float, goal: tuple[float, float]) -> None:
    """However large the wind's acceleration, the thrust leans no more than the limit; and it may use all of it."""
    tilt = math.radians(35.0)
    limits = replace(WIDE, tilt_tangent=math.tan(tilt), thrust_low_m_s2=3.0, thrust_high_m_s2=20.0)
    blown = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, wind_x), (0.0, 0.0, 0.0)
    got = _demand((STILL, STILL, _at(goal[0]), _at(goal[1])), blown, limits, (0.0, wind_x, 0.0), length=2)
    tx, ty, tz = _thrust(got)
    lean = math.atan2(math.hypot(tx, ty), tz)
    assert lean <= tilt + 1e-9
    if max(map(abs, goal)) > 10.0:
        assert lean == pytest.approx(tilt)
        assert got.active == ("tilt",)


def test_the_limit_leans_against_the_wind_at_every_length() -> None:
    """v_2 is the wind's acceleration and the most of the thrust's: the same w as of a chain aimed there."""
    limits = replace(WIDE, tilt_tangent=4.0 / G)
    for length in (3, 4):
        gamma = chain_gains("binomial", length, 2.0)
        got = _demand((STILL, STILL, _at(99.0), STILL), (STILL,) * 4, limits, (0.0, -3.0, 0.0), length)
        aim = (4.0 - 3.0) * math.prod(gamma[i] / gamma[i + 1] for i in range(2, length - 1)) * gamma[length - 1]
        assert got.w[2] == pytest.approx(aim)


@pytest.mark.parametrize("climb", [-50.0, -0.5, 0.0, 2.0, 50.0])
def test_the_thrust_stays_within_its_shell(climb: float) -> None:
    low, high = 3.0, 15.0
    limits = replace(WIDE, thrust_low_m_s2=low, thrust_high_m_s2=high, tilt_tangent=math.tan(1.2))
    for wind in ((0.0, 0.0, 0.0), (2.0, -3.0, 4.0), (-4.0, 0.0, 0.0)):
        sigma = [(0.0, 0.0, wind[0]), (0.0, 0.0, 0.0), (0.0, 0.0, wind[1]), (0.0, 0.0, wind[2])]
        got = _demand((_at(climb), STILL, _at(80.0), _at(-90.0)), tuple(sigma), limits, wind, length=2)
        tx, ty, tz = _thrust(got)
        assert low - 1e-9 <= tz <= high + 1e-9
        assert math.hypot(tx, ty) <= math.sqrt(max(high**2 - tz**2, 0.01 * high**2)) + 1e-9


def test_a_far_goal_asks_for_no_more_than_the_speed() -> None:
    limits = replace(WIDE, speed_m_s=1.5, climb_m_s=1.5, yaw_rate_rad_s=1.5)
    far = (_at(30.0), _at(-9.0), _at(30.0), STILL)
    got = _demand(far, (STILL,) * 4, limits)
    assert got.active == ("climb_speed", "yaw_speed", "horizontal_speed")
    assert got.w == pytest.approx((GAMMA[1] * 1.5, -GAMMA[1] * 1.5, GAMMA[1] * 1.5, 0.0))


def test_the_speed_limit_keeps_the_direction_and_is_above_the_references_own() -> None:
    limits = replace(WIDE, speed_m_s=1.5)
    moving = (STILL, STILL, (30.0, 2.0, 0.0, 0.0, 0.0), (40.0, 0.0, 0.0, 0.0, 0.0))
    got = _demand(moving, (STILL,) * 4, limits)
    assert got.w[2:] == pytest.approx((GAMMA[1] * (2.0 + 0.9), GAMMA[1] * 1.2))


def test_vertical_and_yaw_acceleration() -> None:
    limits = replace(WIDE, thrust_low_m_s2=G - 2.0, thrust_high_m_s2=G + 3.0, yaw_acceleration_rad_s2=1.0)
    got = _demand((_at(-30.0), _at(9.0), STILL, STILL), (STILL,) * 4, limits)
    assert got.active == ("climb_acceleration", "yaw_acceleration")
    assert got.w[:2] == pytest.approx((-2.0 * GAMMA[2], GAMMA[2]))


def test_a_yaw_of_one_integrator_has_a_speed_limit_only() -> None:
    gammas = (GAMMA, chain_gains("binomial", 1, 2.0), GAMMA, GAMMA)
    limits = replace(WIDE, yaw_rate_rad_s=0.8, yaw_acceleration_rad_s2=0.1)
    got = demand(
        tuple(map(ratios, gammas)), (STILL, (9.0, 0.3, 0.0, 0.0, 0.0), STILL, STILL), (STILL,) * 4, CALM, limits
    )
    assert got.w[1] == pytest.approx(0.3 + 0.8)
    assert got.active == ("yaw_speed",)


def test_jerk_is_limited_as_a_vector_where_the_chain_has_one() -> None:
    limits = replace(WIDE, jerk_m_s3=10.0)
    far = (STILL, STILL, _at(30.0), _at(-40.0))
    got = _demand(far, (STILL,) * 4, limits)
    assert got.active == ("jerk",)
    assert got.w[2:] == pytest.approx((GAMMA[3] * 6.0, -GAMMA[3] * 8.0))
    for length in (2, 3):
        assert "jerk" not in _demand(far, (STILL,) * 4, limits, length=length).active


def test_the_vertical_demand_is_free_of_the_horizontal() -> None:
    """A tilt that is limited takes nothing from the climb."""
    limits = replace(WIDE, tilt_tangent=0.3, thrust_low_m_s2=3.0, thrust_high_m_s2=15.0)
    near, far = ((_at(0.5), STILL, _at(x), STILL) for x in (0.0, 60.0))
    assert _demand(near, (STILL,) * 4, limits).w[0] == _demand(far, (STILL,) * 4, limits).w[0]
