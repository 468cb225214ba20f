"""The integrators before thrust and yaw: two, one or none, with limits that do not wind up."""

from __future__ import annotations

import math
import random

import pytest

from mavquad.control.integrators import BARRIER_RAD_S, Integrator, advanced, allowed_drive, driven

LOW, HIGH = -4.0, 5.0
H = 0.01
ORDERS = (1, 2)


def _drive(integrator: Integrator, wanted: float, seconds: float) -> tuple[Integrator, float]:
    """Where it is then, and the largest u on the way if nothing but the barrier had stopped it."""
    largest = integrator.value
    for _ in range(round(seconds / H)):
        integrator = driven(integrator, allowed_drive(integrator, wanted, LOW, HIGH))
        largest = max(largest, advanced(integrator, H, -math.inf, math.inf).value)
        integrator = advanced(integrator, H, LOW, HIGH)
    return integrator, largest


@pytest.mark.parametrize("order", ORDERS)
def test_an_integrator_comes_to_rest_at_its_limit_without_overshoot(order: int) -> None:
    end, largest = _drive(Integrator(order, 0.0), 40.0, 3.0)
    assert largest <= HIGH
    assert end.value == pytest.approx(HIGH, abs=1e-3)
    assert end.rate == pytest.approx(0.0, abs=1e-2)
    end, _ = _drive(Integrator(order, 0.0), -40.0, 3.0)
    assert end.value == pytest.approx(LOW, abs=1e-3)


@pytest.mark.parametrize("order", ORDERS)
def test_it_leaves_the_limit_at_once_however_long_it_was_pushed(order: int) -> None:
    short, _ = _drive(Integrator(order, 0.0), 40.0, 3.0)
    long, _ = _drive(Integrator(order, 0.0), 40.0, 60.0)
    back_short, _ = _drive(short, -40.0, 0.3)
    back_long, _ = _drive(long, -40.0, 0.3)
    assert back_long.value == pytest.approx(back_short.value, abs=1e-2)
    assert back_long.value < 4.0
    first, _ = _drive(long, -40.0, 2 * H)
    assert first.value < HIGH - 1e-3


@pytest.mark.parametrize("order", ORDERS)
def test_a_gap_cannot_carry_it_over_the_limit(order: int) -> None:
    up = advanced(Integrator(order, 4.9, 30.0, 100.0), 0.1, LOW, HIGH)
    assert up.value == HIGH
    down = advanced(Integrator(order, -3.9, -30.0, -100.0), 0.1, LOW, HIGH)
    assert down.value == LOW
    if order == 2:
        assert (up.rate, down.rate) == (0.0, 0.0)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_inside_the_limits_nothing_changes(order: int) -> None:
    assert allowed_drive(Integrator(order, 0.1, 0.2), 3.0, LOW, HIGH) == 3.0


def test_one_integrator_integrates_its_drive() -> None:
    end = advanced(driven(Integrator(1, 0.1), 3.0), 0.1, LOW, HIGH)
    assert (end.value, end.rate, end.drive) == pytest.approx((0.4, 3.0, 3.0))


def test_two_integrate_it_twice() -> None:
    end = advanced(driven(Integrator(2, 0.1, 0.2), 3.0), 0.1, LOW, HIGH)
    assert (end.value, end.rate, end.drive) == pytest.approx((0.1 + 0.02 + 0.015, 0.5, 3.0))


def test_without_an_integrator_the_drive_is_the_value() -> None:
    now = driven(Integrator(0, 1.0), 3.0)
    assert now.value == 3.0
    assert advanced(now, 10.0, LOW, HIGH) == now
    assert allowed_drive(now, 40.0, LOW, HIGH) == HIGH
    assert allowed_drive(now, -40.0, LOW, HIGH) == LOW


@pytest.mark.parametrize("order", ORDERS)
def test_nothing_that_is_asked_for_gets_it_out(order: int) -> None:
    """At any spacing of the commands that the barrier foresaw, whatever is asked for, the stop is never needed."""
    rng = random.Random(6)
    integrator = Integrator(order, 0.0)
    for _ in range(3000):
        wanted = rng.choice((-1e4, -20.0, 0.0, 3.0, 30.0, 1e4))
        integrator = driven(integrator, allowed_drive(integrator, wanted, LOW, HIGH))
        step_s = rng.uniform(0.0, 0.9 / BARRIER_RAD_S)
        free = integrator.value + step_s * integrator.rate * (order == 1)
        integrator = advanced(integrator, step_s, LOW, HIGH)
        assert LOW <= integrator.value <= HIGH
        if order == 1:
            assert integrator.value == pytest.approx(free)


@pytest.mark.parametrize("order", ORDERS)
def test_no_time_changes_nothing(order: int) -> None:
    now = Integrator(order, 0.4, 0.3, 2.0)
    after = advanced(now, 0.0, LOW, HIGH)
    assert after.value == now.value
    assert order == 1 or after.rate == now.rate
