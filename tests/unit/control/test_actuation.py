"""The replica of delay and lag against brute force."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.control.actuation import MAX_COMMANDS, advance, appended, interval

COMMANDS = tuple((t, (w, 2 * w, -w, 0.5)) for t, w in ((0, 1.0), (10_000, -3.0), (24_000, 5.0), (31_500, 2.0)))


def _brute(length: int, lag_s: float, state: list[float], lagged: float, channel: int, span: tuple[int, int]) -> list:
    """The chain with RK4 at 5 us; the command is constant in every step."""
    h_us = 5
    values = [*state, lagged]

    def slope(v: list[float], w: float) -> list[float]:
        a = v[-1] if lag_s > 0.0 else w
        rates = [*v[1:length], v[length] + a, 0.0]
        return [*rates, (w - v[-1]) / lag_s if lag_s > 0.0 else 0.0]

    for now in range(span[0], span[1], h_us):
        w = [c for t, c in COMMANDS if t <= now][-1][channel]
        h = h_us * 1e-6
        k1 = slope(values, w)
        k2 = slope([v + h / 2 * k for v, k in zip(values, k1, strict=True)], w)
        k3 = slope([v + h / 2 * k for v, k in zip(values, k2, strict=True)], w)
        k4 = slope([v + h * k for v, k in zip(values, k3, strict=True)], w)
        values = [v + h / 6 * (a + 2 * b + 2 * c + d) for v, a, b, c, d in zip(values, k1, k2, k3, k4, strict=True)]
    return values


@pytest.mark.parametrize("length", [1, 2, 3, 4])
@pytest.mark.parametrize("lag_s", [0.0, 0.03])
def test_every_interval_is_exact(length: int, lag_s: float) -> None:
    state = [*[0.3, -0.2, 0.5, 1.0, -0.7][:length], 2.0]
    span = (4_000, 36_000)
    for channel in (0, 2):
        over = interval(length, lag_s, COMMANDS, *span)
        ours, lagged = advance(list(state), 0.4, over, channel)
        expected = _brute(length, lag_s, state, 0.4, channel, span)
        assert ours == pytest.approx(expected[:-1], abs=1e-9)
        if lag_s > 0.0:
            assert lagged == pytest.approx(expected[-1], abs=1e-9)


@settings(max_examples=50)
@given(cut_us=st.integers(min_value=0, max_value=50_000), lag_s=st.sampled_from([0.0, 0.001, 0.05, 0.5]))
def test_two_steps_are_one(cut_us: int, lag_s: float) -> None:
    state = [0.3, -0.2, 0.5, 1.0, 2.0]
    whole, lagged = advance(state, 0.4, interval(4, lag_s, COMMANDS, 0, 50_000), 1)
    half, between = advance(state, 0.4, interval(4, lag_s, COMMANDS, 0, cut_us), 1)
    both, end = advance(half, between, interval(4, lag_s, COMMANDS, cut_us, 50_000), 1)
    assert both == pytest.approx(whole, abs=1e-10)
    assert end == pytest.approx(lagged, abs=1e-9)


def test_lag_settles_at_the_command() -> None:
    _, lagged = advance([0.0] * 5, 7.0, interval(4, 0.05, ((0, (3.0,) * 4),), 0, 2_000_000), 0)
    assert lagged == pytest.approx(3.0)
    _, soon = advance([0.0] * 5, 0.0, interval(4, 0.05, ((0, (1.0,) * 4),), 0, 50_000), 0)
    assert soon == pytest.approx(1.0 - math.exp(-1.0))


def test_only_what_is_still_needed_is_kept() -> None:
    kept = appended(COMMANDS, (40_000, (9.0,) * 4), 25_000)
    assert [t for t, _ in kept] == [24_000, 31_500, 40_000]
    again = appended(kept, (40_000, (8.0,) * 4), 25_000)
    assert [t for t, _ in again] == [24_000, 31_500, 40_000]
    assert again[-1][1] == (8.0,) * 4


def test_memory_is_bounded() -> None:
    commands = COMMANDS
    for k in range(500):
        commands = appended(commands, (50_000 + 10_000 * k, (0.0,) * 4), 0)
    assert len(commands) <= MAX_COMMANDS


def test_before_the_first_command_its_own_value_is_taken() -> None:
    late = ((20_000, (2.0,) * 4), (30_000, (5.0,) * 4))
    early = ((0, (2.0,) * 4), (30_000, (5.0,) * 4))
    ours, theirs = (advance([0.0] * 3, 0.0, interval(2, 0.05, c, 0, 40_000), 0) for c in (late, early))
    assert ours == theirs


def test_the_estimate_that_is_carried_on_is_not_touched() -> None:
    state = [0.3, -0.2, 2.0]
    advance(state, 0.4, interval(2, 0.05, COMMANDS, 0, 40_000), 0)
    assert state == [0.3, -0.2, 2.0]
