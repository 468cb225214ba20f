"""Limits of the demand, and integrators that do not wind up."""

from __future__ import annotations

import math
import random

import pytest

from mavquad.control.gains import chain_gains
from mavquad.control.integrators import Integrator, advanced, allowed_drive
from mavquad.control.limits import ChannelLimits, DemandLimits, demand

GAMMA = chain_gains("binomial", 4, 2.0)
WIDE = ChannelLimits(1e9, -1e9, 1e9)
ALL_WIDE = DemandLimits(WIDE, WIDE, WIDE)


def _plain(reference: tuple[float, ...], zeta: tuple[float, ...]) -> float:
    return reference[4] - zeta[4] + sum(g * (r - e) for g, r, e in zip(GAMMA, reference, zeta[:4], strict=False))


def _draw(rng: random.Random) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(rng.uniform(-1, 1) for _ in range(5)) for _ in range(4))


def test_without_limits_it_is_the_law() -> None:
    rng = random.Random(4)
    for _ in range(20):
        references, estimates = _draw(rng), _draw(rng)
        got = demand((GAMMA,) * 4, references, estimates, ALL_WIDE)
        assert got.w == pytest.approx([_plain(r, e) for r, e in zip(references, estimates, strict=True)], abs=1e-9)
        assert got.active == ()


def test_a_far_goal_asks_for_no_more_than_the_tilt() -> None:
    limits = DemandLimits(WIDE, WIDE, ChannelLimits(1e9, -4.0, 4.0))
    still = (0.0,) * 5
    far = ((still), still, (30.0, 0.0, 0.0, 0.0, 0.0), (-40.0, 0.0, 0.0, 0.0, 0.0))
    got = demand((GAMMA,) * 4, far, (still,) * 4, limits)
    assert got.active == ("tilt",)
    assert got.w[2:] == pytest.approx((GAMMA[2] * 2.4, -GAMMA[2] * 3.2))
    leaning = (still, still, (0.0, 0.0, 2.4, 0.0, 0.0), (0.0, 0.0, -3.2, 0.0, 0.0))
    assert demand((GAMMA,) * 4, far, leaning, limits).w[2:] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_far_goal_asks_for_no_more_than_the_speed() -> None:
    channel = ChannelLimits(1.5, -1e9, 1e9)
    still = (0.0,) * 5
    far = ((30.0, 0.0, 0.0, 0.0, 0.0), (-9.0, 0.0, 0.0, 0.0, 0.0), (30.0, 0.0, 0.0, 0.0, 0.0), still)
    got = demand((GAMMA,) * 4, far, (still,) * 4, DemandLimits(channel, channel, channel))
    assert got.active == ("climb_speed", "yaw_speed", "horizontal_speed")
    assert got.w == pytest.approx((GAMMA[1] * 1.5, -GAMMA[1] * 1.5, GAMMA[1] * 1.5, 0.0))


def test_vertical_and_yaw_acceleration() -> None:
    limits = DemandLimits(ChannelLimits(1e9, -2.0, 3.0), ChannelLimits(1e9, -1.0, 1.0), WIDE)
    still = (0.0,) * 5
    far = ((-30.0, 0.0, 0.0, 0.0, 0.0), (9.0, 0.0, 0.0, 0.0, 0.0), still, still)
    got = demand((GAMMA,) * 4, far, (still,) * 4, limits)
    assert got.active == ("climb_acceleration", "yaw_acceleration")
    assert got.w[:2] == pytest.approx((-2.0 * GAMMA[2], GAMMA[2]))


def _drive(integrator: Integrator, wanted: float, seconds: float, low: float, high: float) -> tuple[Integrator, float]:
    largest = integrator.value
    for _ in range(round(seconds * 100)):
        drive = allowed_drive(integrator, wanted, low, high)
        integrator = advanced(Integrator(integrator.value, integrator.rate, drive), 0.01, low, high)
        largest = max(largest, integrator.value)
    return integrator, largest


def test_an_integrator_comes_to_rest_at_its_limit_without_overshoot() -> None:
    end, largest = _drive(Integrator(0.0, 0.0, 0.0), 40.0, 3.0, -4.0, 5.0)
    assert largest <= 5.0
    assert end.value == pytest.approx(5.0, abs=1e-3)
    assert end.rate == pytest.approx(0.0, abs=1e-2)
    end, _ = _drive(Integrator(0.0, 0.0, 0.0), -40.0, 3.0, -4.0, 5.0)
    assert end.value == pytest.approx(-4.0, abs=1e-3)


def test_it_leaves_the_limit_at_once_however_long_it_was_pushed() -> None:
    short, _ = _drive(Integrator(0.0, 0.0, 0.0), 40.0, 3.0, -4.0, 5.0)
    long, _ = _drive(Integrator(0.0, 0.0, 0.0), 40.0, 60.0, -4.0, 5.0)
    back_short, _ = _drive(short, -40.0, 0.3, -4.0, 5.0)
    back_long, _ = _drive(long, -40.0, 0.3, -4.0, 5.0)
    assert back_long.value == pytest.approx(back_short.value, abs=1e-2)
    assert back_long.value < 4.0


def test_a_gap_cannot_carry_it_over_the_limit() -> None:
    end = advanced(Integrator(4.9, 30.0, 100.0), 0.1, -4.0, 5.0)
    assert (end.value, end.rate) == (5.0, 0.0)
    end = advanced(Integrator(-3.9, -30.0, -100.0), 0.1, -4.0, 5.0)
    assert (end.value, end.rate) == (-4.0, 0.0)


def test_inside_the_limits_nothing_changes() -> None:
    assert allowed_drive(Integrator(0.1, 0.2, 0.0), 3.0, -4.0, 5.0) == 3.0
    end = advanced(Integrator(0.1, 0.2, 3.0), 0.1, -4.0, 5.0)
    assert (end.value, end.rate) == pytest.approx((0.1 + 0.02 + 0.015, 0.5))
    assert math.isfinite(end.value)
