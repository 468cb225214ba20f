"""What the autopilot's estimator says of itself, as real PX4 and ArduCopter said it."""

from __future__ import annotations

import pytest

from mavquad.flight.guard_estimator import EstimatorMonitor, EstimatorParams, unfit
from mavquad.protocol.codec import mavlink

HEALTHY = 831
"""Of real ArduCopter and PX4 in the air."""
BITS = {1: "attitude", 2: "horizontal velocity", 4: "vertical velocity"}


def report(flags):
    return mavlink.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.1)


def status(flags):
    return mavlink.MAVLink_estimator_status_message(0, flags, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)


@pytest.mark.parametrize("flags", [831, 895, 831 | 1024, 831 - 16, 831 - 8, 831 - 32 + 64])
def test_fit_to_fly(flags):
    """With GPS, near the ground, during a glitch, with a relative or an absolute position alone, over its range finder."""
    assert unfit(flags) == ""


@pytest.mark.parametrize(("bit", "name"), BITS.items())
def test_each_thing_that_it_can_lose(bit, name):
    assert unfit(HEALTHY - bit) == f"has lost its {name}"


def test_position_and_height_need_one_of_two():
    assert unfit(HEALTHY - 8 - 16) == "has lost its horizontal position"
    assert unfit(HEALTHY - 32) == "has lost its height"
    assert unfit(0) == "has lost its attitude, horizontal velocity, vertical velocity, horizontal position, height"


def test_a_constant_position_is_none():
    assert unfit(1023) == "knows no position (constant-position mode)"  # PX4 1.16 just after its start


@pytest.mark.parametrize("message", [report, status])
def test_it_trips_once_it_has_lasted(message):
    monitor = EstimatorMonitor(EstimatorParams(for_s=0.4, reaction="land"))
    assert monitor.take(message(HEALTHY), 0) is None
    assert monitor.take(message(HEALTHY - 2), 200_000) is None
    assert monitor.take(message(HEALTHY - 2), 599_996) is None
    tripped = monitor.take(message(HEALTHY - 2), 600_000)
    assert (tripped.name, tripped.reaction) == ("estimator", "land")
    assert tripped.words == "the autopilot's estimator has lost its horizontal velocity"


def test_a_moment_of_health_begins_the_time_anew():
    monitor = EstimatorMonitor(EstimatorParams(for_s=0.4))
    for stamp_us, flags in ((0, 0), (300_000, HEALTHY), (400_000, 0), (700_000, 0)):
        assert monitor.take(report(flags), stamp_us) is None
    assert monitor.take(report(0), 800_000) is not None


def test_zero_is_off():
    monitor = EstimatorMonitor(EstimatorParams(for_s=0.0))
    assert [monitor.take(report(0), stamp_us) for stamp_us in (0, 10**9)] == [None, None]
