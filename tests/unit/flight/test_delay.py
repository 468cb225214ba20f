"""The delay that the law bridges, as the link shows it."""

from __future__ import annotations

import pytest

from mavquad.flight.delay import ENOUGH, OUR_OWN_S, DelayMeter


def meter(*ages_us, times=ENOUGH):
    made = DelayMeter()
    for _ in range(times):
        for age_us in ages_us:
            made.take(age_us)
    return made


def test_it_is_the_usual_age_and_half_a_round_trip():
    assert meter(14_000, 15_000, 90_000).delay_s(0.020, 0.5) == pytest.approx(0.015 + 0.010 + OUR_OWN_S)


@pytest.mark.parametrize(("ages_us", "round_trip_s"), [((None,), 0.02), ((15_000,), None)])
def test_nothing_is_known_without_timesync(ages_us, round_trip_s):
    assert meter(*ages_us).delay_s(round_trip_s, 0.5) is None


def test_nor_by_a_few():
    assert meter(15_000, times=ENOUGH - 1).delay_s(0.02, 0.5) is None


def test_it_is_no_more_than_the_law_can_bridge():
    assert meter(400_000).delay_s(0.4, 0.2) == 0.2
    assert meter(400_000).delay_s(0.4, 9.0) == 0.3
    assert meter(0).delay_s(1e-6, 9.0) == 0.002
