"""Measurements that come too seldom, and setpoints that leave too late."""

from __future__ import annotations

import pytest

from mavquad.flight.guard_timing import LatenessMonitor, LatenessParams, RateMonitor, RateParams


def rated(rate_hz, expected_hz=100.0, seconds=5.0, params=None):
    """What was said of a stream of this rate, without its Nones."""
    monitor = RateMonitor(params or RateParams(share=0.5, window_s=2.0), "ATTITUDE")
    monitor.start(expected_hz, 0)
    said = [
        (monitor.take(round(k * 1e6 / rate_hz)), round(k * 1e6 / rate_hz)) for k in range(1, round(seconds * rate_hz))
    ]
    return [(tripped, stamp_us) for tripped, stamp_us in said if tripped is not None]


def test_a_rate_that_is_enough():
    assert rated(100.0) == []
    assert rated(50.5) == []


def test_a_rate_that_is_not():
    (tripped, stamp_us), *_ = rated(40.0)
    assert tripped.words == "ATTITUDE comes at 40 Hz, 50 needed"
    assert stamp_us == 2_000_000  # not before a whole window


@pytest.mark.parametrize("expected_hz", [60.0, 124.0])
def test_what_is_needed_is_a_share_of_what_came_before(expected_hz):
    assert rated(0.51 * expected_hz, expected_hz) == []
    assert rated(0.47 * expected_hz, expected_hz) != []


def test_a_stream_that_slows_down():
    monitor = RateMonitor(RateParams(share=0.5, window_s=2.0), "ATTITUDE")
    monitor.start(100.0, 0)
    assert [monitor.take(k * 10_000) for k in range(1, 400)] == [None] * 399
    slow = [monitor.take(4_000_000 + k * 50_000) for k in range(41)]
    assert slow[0] is None
    assert slow[-1].words == "ATTITUDE comes at 20 Hz, 50 needed"


def test_before_the_law_takes_over_no_rate_is_too_low():
    monitor = RateMonitor(RateParams(), "ATTITUDE")
    assert [monitor.take(k * 1_000_000) for k in range(10)] == [None] * 10


def test_what_came_before_the_start_does_not_count():
    monitor = RateMonitor(RateParams(share=0.5, window_s=2.0), "ATTITUDE")
    for k in range(200):
        monitor.take(k * 10_000)
    monitor.start(100.0, 2_000_000)
    assert [monitor.take(2_000_000 + k * 50_000) for k in range(1, 40)] == [None] * 39
    assert monitor.take(4_000_000) is not None


def test_rate_zero_is_off():
    assert rated(3.0, params=RateParams(share=0.0)) == []


# ---------------------------------------------------------------------- lateness


def late(*lateness_ms_at_s, **keys):
    monitor = LatenessMonitor(LatenessParams(limit_ms=100.0, count=3, window_s=2.0, **keys))
    return [monitor.take(lateness_ms * 1000, round(at_s * 1e6)) for lateness_ms, at_s in lateness_ms_at_s]


def test_late_often_enough():
    said = late((101, 0.0), (150, 0.5), (180, 1.9), reaction="land")
    assert said[:2] == [None, None]
    assert said[2].words == "setpoints left more than 100 ms late 3 times in 2 s, the last one 180 ms"
    assert said[2].reaction == "land"


def test_not_late_enough_or_not_within_the_window():
    assert late((100, 0.0), (99, 0.5), (100, 1.0)) == [None] * 3
    assert late((150, 0.0), (150, 1.0), (150, 2.0), (150, 3.0)) == [None] * 4


def test_one_stall_is_one_however_many_setpoints_waited_in_it():
    assert late(*((150, 0.001 * k) for k in range(15))) == [None] * 15


def test_a_delay_that_stays_trips():
    assert any(late(*((150, 0.01 * k) for k in range(100))))


def test_lateness_zero_is_off():
    monitor = LatenessMonitor(LatenessParams(limit_ms=0.0, count=1))
    assert monitor.take(9_000_000, 0) is None
