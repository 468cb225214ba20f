"""The echo of our setpoints in ATTITUDE_TARGET: after the wire's 32-bit floats, and never somebody else's."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.echo import LATEST, Echo
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.firmware.setpoints import setpoint

RATES = (0.123, -0.045, 0.067, 0.5)
LEAN = (0.05, -0.02, 2.0, 0.5)


def through_the_wire(message):
    return decode(Encoder(1, 1).encode(message))


def shown(rates=(0.0, 0.0, 0.0), q=(1.0, 0.0, 0.0, 0.0), thrust=0.5):
    return through_the_wire(mavlink.MAVLink_attitude_target_message(1, 0, list(q), *rates, thrust))


def echo_of(depth, *controls):
    echo = Echo()
    echo.restart(wanted=True)
    for each in controls:
        echo.sent(setpoint(0, depth, each, 1, 1))
    return echo


def test_rates_are_known_again_behind_later_ones():
    echo = echo_of("rate", RATES, *[(0.2, 0.3, 0.01 * n, 0.5) for n in range(LATEST - 1)])
    assert echo.shows(shown(RATES[:3]))
    echo.sent(setpoint(0, "rate", (0.3, 0.3, 0.3, 0.5), 1, 1))
    assert not echo.shows(shown(RATES[:3]))


@pytest.mark.parametrize("axis", range(3))
def test_rates_of_which_one_differs_are_somebody_elses(axis):
    rates = list(RATES[:3])
    rates[axis] += 1e-3
    assert not echo_of("rate", RATES).shows(shown(rates))


def test_rates_of_nothing_are_anybodys():
    assert not echo_of("rate", (1e-5, 0.0, 0.0, 0.5)).shows(shown((1e-5, 0.0, 0.0)))
    assert not echo_of("rate", (0.0, 0.0, 0.0, 0.5)).shows(shown())


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_attitude_is_known_again_in_either_sign(sign):
    [q] = echo_of("attitude", LEAN)._sent
    assert echo_of("attitude", LEAN).shows(shown((0.1, 0.2, 0.3), [sign * each for each in q]))
    assert not echo_of("attitude", LEAN).shows(shown((0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0)))


def test_nan_is_no_echo():
    assert not echo_of("rate", RATES).shows(shown((math.nan, *RATES[1:3])))
    assert not echo_of("attitude", LEAN).shows(shown(q=(math.nan,) * 4))


def test_a_torque_has_no_echo_and_a_restart_forgets():
    assert not echo_of("torque", RATES).shows(shown(RATES[:3]))
    echo = echo_of("rate", RATES)
    echo.restart(wanted=True)
    assert not echo.shows(shown(RATES[:3]))


def test_where_nobody_wants_to_know_nothing_is_kept():
    echo = Echo()
    echo.restart(wanted=False)
    echo.sent(setpoint(0, "rate", RATES, 1, 1))
    assert not echo.shows(shown(RATES[:3]))
