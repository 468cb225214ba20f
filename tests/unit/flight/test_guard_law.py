"""The law's own evidence: disturbance, innovation, and an output that is no number."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.guard_law import (
    InnovationMonitor,
    InnovationParams,
    NanParams,
    SigmaMonitor,
    SigmaParams,
    no_number,
)
from mavquad.flight_record import TraceRow

ZERO4 = (0.0, 0.0, 0.0, 0.0)
LENGTHS = {"attitude": 2, "rate": 3, "torque": 4}


def row(at_s=0.0, depth="rate", measured=ZERO4, estimated=ZERO4, sigma=ZERO4, wind=(0.0, 0.0, 0.0)):
    zeta_hat = tuple((each,) + (9.0,) * (LENGTHS[depth] - 1) for each in estimated)
    return TraceRow(round(at_s * 1e6), 0, "flying", measured, ZERO4, zeta_hat, sigma, wind, ZERO4, ZERO4, ZERO4, ())


def lasting(monitor, seconds=0.5, **values):
    """What comes of rows with these values that go on for so long."""
    tripped = [monitor.take(row(step * 0.01, **values)) for step in range(round(seconds * 100) + 1)]
    assert tripped[:-1] == [None] * (len(tripped) - 1)
    return tripped[-1]


@pytest.mark.parametrize("depth", LENGTHS)
def test_sigma_by_depth_has_its_own_limit_and_unit(depth):
    limits = {"attitude_m_s2": 2.0, "rate_m_s3": 3.0, "torque_m_s4": 4.0}
    limit = float(LENGTHS[depth])
    at_limit = lasting(SigmaMonitor(SigmaParams(**limits)), depth=depth, sigma=(0.0, 99.0, limit, 0.0))
    assert at_limit is None
    tripped = lasting(SigmaMonitor(SigmaParams(**limits)), depth=depth, sigma=(0.0, 0.0, 0.0, -limit - 0.1))
    assert tripped.words == f"the disturbance is {limit + 0.1} m/s^{LENGTHS[depth]}, {limit:g} allowed"


def test_sigma_is_that_of_all_three_directions():
    monitor = SigmaMonitor(SigmaParams(rate_m_s3=6.9))
    assert lasting(monitor, sigma=(2.0, 0.0, -3.0, 6.0)).words == "the disturbance is 7.0 m/s^3, 6.9 allowed"
    assert lasting(SigmaMonitor(SigmaParams(rate_m_s3=7.1)), sigma=(2.0, 0.0, -3.0, 6.0)) is None


def test_wind_beyond_its_limit():
    tripped = lasting(SigmaMonitor(SigmaParams(wind_m_s2=6.9, reaction="return")), wind=(2.0, -3.0, 6.0))
    assert (tripped.name, tripped.reaction) == ("sigma", "return")
    assert tripped.words == "the wind accelerates it by 7.0 m/s^2, 6.9 allowed"


def test_a_gust_shorter_than_allowed_is_none():
    monitor = SigmaMonitor(SigmaParams(wind_m_s2=5.0, for_s=0.5))
    for step in range(300):
        assert monitor.take(row(step * 0.01, wind=(6.0 if step % 50 else 4.0, 0.0, 0.0))) is None


def test_sigma_zero_is_off():
    off = SigmaParams(wind_m_s2=0.0, attitude_m_s2=0.0, rate_m_s3=0.0, torque_m_s4=0.0)
    for depth in LENGTHS:
        assert lasting(SigmaMonitor(off), depth=depth, sigma=(1e5,) * 4, wind=(1e5,) * 3) is None


@pytest.mark.parametrize("channel", [0, 2, 3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_innovation_of_the_position(channel, sign):
    def off_by(distance_m):
        measured = tuple(7.0 + sign * distance_m * (i == channel) for i in range(4))
        monitor = InnovationMonitor(InnovationParams(position_m=0.25, for_s=0.3))
        return lasting(monitor, 0.3, measured=measured, estimated=(7.0,) * 4)

    assert off_by(0.24) is None
    assert off_by(0.26).words == "the observer does not follow what is measured: by 0.26 m, 0.25 allowed"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_innovation_of_the_yaw(sign):
    def off_by(angle_deg):
        monitor = InnovationMonitor(InnovationParams(yaw_deg=20.0, for_s=0.3))
        return lasting(monitor, 0.3, measured=(0.0, sign * math.radians(angle_deg), 0.0, 0.0))

    assert off_by(19.9) is None
    assert off_by(21.0).words == "the observer does not follow what is measured: by 21 degrees of yaw, 20 allowed"


def test_innovation_zero_is_off():
    monitor = InnovationMonitor(InnovationParams(position_m=0.0, yaw_deg=0.0))
    assert lasting(monitor, 1.0, measured=(50.0, 3.0, 50.0, 50.0)) is None


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_in_any_place(place, value):
    controls = [0.1, -0.2, 0.3, 0.4]
    assert no_number(NanParams(), controls) is None
    controls[place] = value
    assert no_number(NanParams(reaction="pilot"), controls).reaction == "pilot"
