"""The replica of the thrust behind its lag, against the exact solution."""

from __future__ import annotations

import math
import random

import pytest

from mavquad.control.thrust import ThrustReplica

LAG_S = 0.05


def _exact(start: float, commands: list[tuple[int, float]], until_us: int) -> float:
    """Superposition: every step of the command is answered by 1 - exp(-t / lag) from its own moment on."""
    total, before = start, start
    for arrive_us, thrust in commands:
        if arrive_us <= until_us:
            total += (thrust - before) * -math.expm1(-(until_us - arrive_us) * 1e-6 / LAG_S)
            before = thrust
    return total


def test_any_schedule_of_commands_and_looks_is_exact() -> None:
    rng = random.Random(3)
    for _ in range(20):
        replica, commands, arrive, now = ThrustReplica(LAG_S, 9.0, 0), [], 0, 0
        for _ in range(40):
            arrive += rng.choice((1_000, 7_000, 40_000))
            commands.append((arrive, rng.uniform(3.0, 18.0)))
            replica.command(*commands[-1])
            now = rng.randint(now, arrive)  # commands are in flight for a while
            replica.advance(now)
            assert replica.value_m_s2 == pytest.approx(_exact(9.0, commands, now), abs=1e-12)


@pytest.mark.parametrize("lag_s", [0.0, 0.005, 0.05])
@pytest.mark.parametrize("period_us", [4_000, 10_000])
def test_a_climb_in_steps_has_the_rate_of_its_line_whenever_one_looks(lag_s: float, period_us: int) -> None:
    """Commands 3 m/s^3 apart, looked at everywhere between two of them."""
    for phase in (0.0, 0.3, 0.6, 0.99):
        replica = ThrustReplica(lag_s, 9.0, 0)
        for k in range(1, 100):
            replica.command(k * period_us, 9.0 + 3.0 * k * period_us * 1e-6)
            replica.advance(round((k + phase) * period_us))
        assert replica.rate_m_s3 == pytest.approx(3.0, rel=0.09 if lag_s == 0.005 else 0.02)


def test_held_for_long_it_is_at_rest() -> None:
    replica = ThrustReplica(LAG_S, 9.0, 0)
    replica.command(10_000, 10.0)
    replica.command(20_000, 11.0)
    replica.advance(25_000)
    assert replica.rate_m_s3 > 0.0
    # The line through the middles is half a step above the last command; what is left of that is not a climb.
    replica.command(30_000, 11.0)
    replica.advance(1_000_000)
    assert replica.rate_m_s3 == pytest.approx(0.0, abs=1e-6)
    assert replica.value_m_s2 == pytest.approx(11.0, abs=1e-6)


def test_a_command_from_before_the_start_is_no_jump() -> None:
    replica = ThrustReplica(LAG_S, 9.0, 50_000)
    replica.command(40_000, 9.5)
    replica.advance(50_000)
    assert abs(replica.rate_m_s3) <= 0.5 / LAG_S


def test_at_rest_until_the_first_command_arrives() -> None:
    replica = ThrustReplica(LAG_S, 9.0, 5_000)
    replica.command(40_000, 12.0)
    replica.advance(39_999)
    assert (replica.value_m_s2, replica.rate_m_s3) == (9.0, 0.0)
    replica.advance(41_000)
    assert replica.value_m_s2 > 9.0
    assert replica.rate_m_s3 > 0.0


def test_a_command_for_the_same_moment_or_an_earlier_one_replaces_those_after_it() -> None:
    replica, wanted = ThrustReplica(LAG_S, 9.0, 0), ThrustReplica(LAG_S, 9.0, 0)
    for arrive, thrust in ((10_000, 12.0), (20_000, 15.0), (30_000, 1.0), (20_000, 11.0), (20_000, 10.0)):
        replica.command(arrive, thrust)
    for arrive, thrust in ((10_000, 12.0), (20_000, 10.0)):
        wanted.command(arrive, thrust)
    for each in (replica, wanted):
        each.advance(80_000)
    assert replica.value_m_s2 == wanted.value_m_s2


def test_without_a_lag_it_is_the_command() -> None:
    replica = ThrustReplica(0.0, 9.0, 0)
    replica.command(10_000, 12.0)
    replica.advance(9_999)
    assert (replica.value_m_s2, replica.rate_m_s3) == (9.0, 0.0)
    replica.advance(10_001)
    assert (replica.value_m_s2, replica.rate_m_s3) == (12.0, pytest.approx(300.0))
    replica.advance(30_000)
    assert (replica.value_m_s2, replica.rate_m_s3) == (12.0, 0.0)


def test_an_earlier_moment_changes_nothing() -> None:
    replica = ThrustReplica(LAG_S, 9.0, 0)
    replica.command(10_000, 12.0)
    replica.advance(50_000)
    before = replica.value_m_s2
    replica.advance(20_000)
    replica.advance(50_000)
    assert replica.value_m_s2 == before


def test_two_looks_are_one() -> None:
    one, two = ThrustReplica(LAG_S, 9.0, 0), ThrustReplica(LAG_S, 9.0, 0)
    for each in (one, two):
        each.command(10_000, 12.0)
        each.command(25_000, 6.0)
    one.advance(60_000)
    for stamp in (3_000, 10_000, 24_999, 26_000, 60_000):
        two.advance(stamp)
    assert one.value_m_s2 == pytest.approx(two.value_m_s2, abs=1e-12)
