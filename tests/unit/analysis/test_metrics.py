"""Metrics by cases small enough to be worked out by hand."""

from __future__ import annotations

import math

import pytest

from mavquad.analysis.metrics import ErrorSample, FlightMetrics, error_samples, flight_metrics, root_mean_square

ZERO = (0.0, 0.0, 0.0, 0.0)


def at_rate_10hz(errors):
    return [ErrorSample(index / 10, error) for index, error in enumerate(errors)]


def test_no_error_is_zero_everywhere():
    assert flight_metrics(at_rate_10hz([ZERO] * 100)) == FlightMetrics(0.0, 0.0, 0.0, 0.0)


def test_no_samples_and_too_few_samples_give_none():
    assert flight_metrics([]) == FlightMetrics(None, None, None, None)
    assert flight_metrics(at_rate_10hz([ZERO] * 50)) == FlightMetrics(None, None, None, 0.0)


def test_the_first_five_seconds_are_left_out_and_the_sample_at_five_counts():
    errors = [(9.0, 1.0, 9.0, 9.0)] * 50 + [(0.02, 0.01, 0.0, 0.0)]
    assert flight_metrics(at_rate_10hz(errors)) == FlightMetrics(0.02, 0.02, 0.01, None)


def test_the_norm_is_of_z_x_and_y_and_not_of_yaw():
    metrics = flight_metrics([ErrorSample(6.0, (0.02, 7.0, 0.03, 0.06))])
    assert metrics.position_rms_m == pytest.approx(0.07)
    assert metrics.yaw_rms_rad == pytest.approx(7.0)


def test_rms_and_maximum_of_different_errors():
    samples = [ErrorSample(5.0, (0.03, -0.3, 0.0, 0.04)), ErrorSample(6.0, (0.0, 0.1, -0.12, 0.05))]
    metrics = flight_metrics(samples)
    assert metrics.position_rms_m == pytest.approx(math.sqrt((0.05**2 + 0.13**2) / 2))
    assert metrics.position_max_m == pytest.approx(0.13)
    assert metrics.yaw_rms_rad == pytest.approx(math.sqrt((0.09 + 0.01) / 2))


@pytest.mark.parametrize(
    ("errors", "settle_s"),
    [
        ([(0.06, 0, 0, 0)] * 3 + [ZERO] * 31, 0.3),
        ([(0.06, 0, 0, 0)] * 3 + [ZERO] * 30, None),
        ([(0.05, math.radians(3.0), 0, 0)] * 31, 0.0),
        ([(0.04, 0, 0.04, 0)] * 2 + [ZERO] * 31, 0.2),
        ([(0.0, math.radians(-3.1), 0, 0)] + [ZERO] * 31, 0.1),
        ([ZERO] * 3 + [(0, 0, 0, -0.06)] + [ZERO] * 31, 0.4),
        ([ZERO] * 31 + [(0, 0, 0, -0.06)], 0.0),
        ([(math.nan, 0, 0, 0)] * 40, None),
    ],
)
def test_settling(errors, settle_s):
    assert flight_metrics(at_rate_10hz(errors)).settle_s == settle_s


def test_what_is_not_a_number_gives_none_and_never_nan():
    samples = [ErrorSample(6.0, ZERO), ErrorSample(7.0, (math.nan, math.inf, 0.0, 0.0))]
    assert flight_metrics(samples) == FlightMetrics(None, None, None, None)
    assert root_mean_square([1.0, math.inf]) is None


def test_errors_of_a_trace_start_at_zero_and_wrap_yaw(make_trace):
    rows = make_trace(0.05)[:3]
    rows = [
        row._replace(measured=(1.0, 7.0, 2.0, 3.0), reference=(0.5, 0.5, 2.5, 1.0), stamp_us=row.stamp_us)
        for row in rows
    ]
    samples = error_samples(rows)
    assert [round(sample.t_s, 9) for sample in samples] == [0.0, 0.01, 0.02]
    assert samples[0].error == pytest.approx((0.5, 6.5 - 2 * math.pi, -0.5, 2.0))


def test_errors_of_some_phases_only_count_their_own_time(make_trace):
    rows = make_trace(10.05)
    samples = error_samples(rows, phases={"mission"})
    assert len(samples) == 5
    assert samples[0].t_s == 0.0
    assert error_samples(rows, phases=()) == []


def test_json_has_the_names_of_the_summary():
    assert flight_metrics([]).to_json() == dict.fromkeys(
        ("position_rms_m", "position_max_m", "yaw_rms_rad", "settle_s")
    )
