"""When a takeoff is over."""

from __future__ import annotations

import pytest

from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.takeoff import TakeoffWatch
from mavquad.types import Position

SETTLE_S = 2.0


def watched(speed_m_s: float, height_m: float = 2.5, seconds: float = 3.0) -> bool:
    """Whether it is over after some seconds of a known hover thrust at this speed and height, in the hold mode."""
    watch = TakeoffWatch(HoverThrust(AirframeParams(hover_thrust_norm=0.5)), SETTLE_S, floor_m=0.5)
    watch.altitude_m = 2.5
    over = False
    for now_us in range(0, round(seconds * 1e6) + 1, 100_000):
        over = watch.is_over(Position(now_us, (0.0, 0.0, height_m), (speed_m_s, 0.0, 0.0)), 0.0, True, now_us)
    return over


@pytest.mark.parametrize(("speed_m_s", "over"), [(0.0, True), (0.75, True), (0.85, False), (1.5, False)])
def test_a_vehicle_that_moves_faster_than_gusts_push_it_does_not_hover_yet(speed_m_s: float, over: bool) -> None:
    assert watched(speed_m_s) is over


@pytest.mark.parametrize(("seconds", "over"), [(SETTLE_S - 0.1, False), (SETTLE_S, True)])
def test_it_hovers_for_a_while(seconds: float, over: bool) -> None:
    assert watched(0.0, seconds=seconds) is over


@pytest.mark.parametrize(("height_m", "over"), [(1.2, False), (1.3, True)])
def test_it_hovers_high_enough(height_m: float, over: bool) -> None:
    assert watched(0.0, height_m) is over


def test_a_moment_of_speed_begins_the_while_again() -> None:
    watch = TakeoffWatch(HoverThrust(AirframeParams(hover_thrust_norm=0.5)), SETTLE_S, floor_m=0.5)
    speeds = [0.0] * 15 + [1.0] + [0.0] * 15
    for k, speed in enumerate(speeds):
        assert not watch.is_over(Position(k, (0.0, 0.0, 2.5), (speed, 0.0, 0.0)), 0.0, True, 100_000 * k)
