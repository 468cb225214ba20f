"""The meter of the inner loop's answer, on loops whose delay is known."""

import math
import random

import pytest

from mavquad.control.response import Late, ResponseMeter

STEP_US = 10_000
FINE = 10


def second_order(
    delay_s: float,
    damping: float,
    noise: float = 0.01,
    seconds: float = 2.0,
    gap_at: int = -1,
    expected_s: float = 0.09,
    swing_rad_s: float = 0.0,
) -> list[Late]:
    """What the meter tells of a loop 1 / (s^2/w^2 + 2 z s/w + 1), w = 2 z / delay, that is shaken by coloured commands."""
    rng = random.Random(3)
    meter, told = ResponseMeter(expected_s), []
    w, commands = 2.0 * damping / delay_s, (0.0, 0.0)
    states = [[0.0, 0.0], [0.0, 0.0]]
    dt_s = STEP_US * 1e-6 / FINE
    for k in range(round(seconds * 1e6) // STEP_US):
        stamp_us = 1_000_000 + k * STEP_US + (200_000 if 0 <= gap_at <= k else 0)
        commands = (0.8 * commands[0] + rng.gauss(0.0, 0.15), 0.8 * commands[1] + rng.gauss(0.0, 0.15))
        if swing_rad_s:
            angle = swing_rad_s * k * STEP_US * 1e-6
            commands = (math.sin(angle) + rng.gauss(0.0, 0.02), math.cos(angle) + rng.gauss(0.0, 0.02))
        late = meter.answer(stamp_us, *(state[0] + rng.gauss(0.0, noise) for state in states))
        if late is not None:
            told.append(late)
        meter.command(stamp_us, *commands)
        for state, command in zip(states, commands, strict=True):
            for _ in range(FINE):
                state[1] += dt_s * w * (w * (command - state[0]) - 2.0 * damping * state[1])
                state[0] += dt_s * state[1]
    return told


@pytest.mark.parametrize("delay_s", [0.05, 0.09, 0.15])
def test_the_delay_of_the_answer_is_found(delay_s: float) -> None:
    late = second_order(delay_s, 0.8)[-1]
    assert late.delay_s == pytest.approx(delay_s, rel=0.15, abs=0.006)
    assert late.deviation_s < 0.01
    assert late.unexplained < 0.2


def test_a_peak_is_found_where_the_loop_swings() -> None:
    """1 / (2 z sqrt(1 - z^2)) = 1.36 at the damping 0.4, none at 1."""
    assert second_order(0.1, 1.0, expected_s=0.2, swing_rad_s=6.6, seconds=4.0)[-1].peak < 1.1
    assert second_order(0.1, 0.4, expected_s=0.2, swing_rad_s=6.6, seconds=4.0)[-1].peak == pytest.approx(
        1.36, abs=0.15
    )


def test_noise_explains_itself() -> None:
    """Answers that are not the commands' doing are told to be so."""
    assert second_order(0.09, 0.8, noise=1.0)[-1].unexplained > 0.5


def test_the_first_word_comes_after_three_quarters_of_a_second_then_four_a_second() -> None:
    assert len(second_order(0.09, 0.8, seconds=0.74)) == 0
    assert len(second_order(0.09, 0.8, seconds=1.78)) == 5


def test_after_a_gap_it_begins_anew() -> None:
    assert len(second_order(0.09, 0.8, seconds=1.5, gap_at=70)) == 1


def test_where_nothing_moves_nothing_is_told() -> None:
    meter = ResponseMeter(0.09)
    for k in range(200):
        meter.command(k * STEP_US, 0.1, -0.1)
        assert meter.answer(k * STEP_US + 5_000, 0.1, -0.1) is None


def test_a_command_that_is_replaced_before_it_acts_is_forgotten() -> None:
    """The same late answer, whether or not another command was there for a moment."""
    found = []
    for replaced in (False, True):
        rng, meter, value, late = random.Random(5), ResponseMeter(0.09), 0.0, None
        for k in range(150):
            stamp_us, command = k * STEP_US, rng.gauss(0.0, 0.2)
            late = meter.answer(stamp_us, value + rng.gauss(0.0, 1e-3), value) or late
            if replaced:
                meter.command(stamp_us + 1, 5.0, -5.0)
            meter.command(stamp_us + 1, command, command)
            value += (command - value) * -math.expm1(-0.01 / 0.05)
        found.append(late)
    assert found[0] == found[1]
    assert found[0] is not None
    assert found[0].delay_s == pytest.approx(0.05, abs=0.005)
