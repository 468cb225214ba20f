"""The extended observer of one chain."""

from __future__ import annotations

import itertools
import math
import random

import pytest

from mavquad.control.actuation import advance, interval
from mavquad.control.observer import Estimate, ObserverGains, correct, update

NO_INPUT = ((0, (0.0, 0.0, 0.0, 0.0)),)


def _truth(length: int, start: list[float], time_s: float) -> float:
    """A chain with a constant disturbance, in closed form."""
    return sum(c * time_s**k / math.factorial(k) for k, c in enumerate(start[: length + 1]))


def _follow(length: int, start: list[float], guess: tuple[float, ...], seed: int, duration_s: float) -> Estimate:
    gains = ObserverGains(8.0, (1.0,) * (length + 1), 0.05)
    rng = random.Random(seed)
    estimate, now = Estimate(0, guess, 0.0), 0
    while now < duration_s * 1e6:
        now += rng.choice((4_000, 10_000, 12_000, 36_000))
        after = update(gains, estimate, 0, NO_INPUT, now, _truth(length, start, now * 1e-6))
        assert after is not None
        estimate = after
    return estimate


@pytest.mark.parametrize("length", [2, 3, 4, 5])
def test_converges_from_a_grid_of_starts_with_irregular_samples(length: int) -> None:
    start = [0.5, -0.3, 0.2, 0.1, -0.05, 0.02][: length + 1]
    for signs in itertools.product((-1.0, 1.0), repeat=length + 1):
        end = _follow(length, start, tuple(2.0 * s for s in signs), 3, 6.0)
        time_s = end.stamp_us * 1e-6
        assert end.values[0] == pytest.approx(_truth(length, start, time_s), abs=1e-6)
        assert end.values[-1] == pytest.approx(start[-1], abs=1e-6)


def test_learns_a_constant_disturbance_beside_a_known_input() -> None:
    commands = ((0, (3.0, 0.0, 0.0, 0.0)), (500_000, (-2.0, 0.0, 0.0, 0.0)))
    gains = ObserverGains(10.0, (0.8, 1.0, 1.0, 1.2, 1.5), 0.05)
    truth, lagged = (0.0, 0.0, 0.0, 0.0, 0.7), 0.0
    estimate = Estimate(0, (0.1, 0.0, 0.0, 0.0, 0.0), 0.0)
    for now in range(10_000, 4_000_000, 10_000):
        truth, lagged = advance(truth, lagged, interval(4, 0.05, commands, now - 10_000, now), 0)
        after = update(gains, estimate, 0, commands, now, truth[0])
        assert after is not None
        estimate = after
    assert estimate.values == pytest.approx(truth, abs=1e-6)


def test_a_second_look_at_the_same_moment_changes_nothing() -> None:
    gains = ObserverGains(8.0, (1.0,) * 5, 0.05)
    before = Estimate(10_000, (1.0, 2.0, 3.0, 4.0, 5.0), 0.5)
    assert update(gains, before, 0, NO_INPUT, 10_000, 1.7) == before


def test_an_older_measurement_is_refused() -> None:
    gains = ObserverGains(8.0, (1.0,) * 5, 0.05)
    assert update(gains, Estimate(10_000, (0.0,) * 5, 0.0), 0, NO_INPUT, 9_999, 1.0) is None


def test_zero_in_zero_out_and_signs() -> None:
    gains = ObserverGains(8.0, (1.0,) * 5, 0.05)
    zero = Estimate(0, (0.0,) * 5, 0.0)
    assert correct(gains, zero, 0.0, 10_000).values == (0.0,) * 5
    assert all(v > 0.0 for v in correct(gains, zero, 1.0, 10_000).values)


def test_a_gap_of_a_third_of_a_second_is_bridged() -> None:
    start = [0.5, -0.3, 0.2, 0.1, -0.05]
    gains = ObserverGains(8.0, (1.0,) * 5, 0.05)
    settled = _follow(4, start, (0.0,) * 5, 5, 5.0)
    now = settled.stamp_us + 300_000
    after = update(gains, settled, 0, NO_INPUT, now, _truth(4, start, now * 1e-6))
    assert after is not None
    assert after.values[0] == pytest.approx(_truth(4, start, now * 1e-6), abs=1e-6)
