"""The vehicle's clock on the log's, by exchanges and by arrivals."""

import numpy as np
import pytest

from mavquad.analysis.identification_clock import Exchange, clock_of

OFFSET_S = 1000.0
STAMPS_S = np.arange(0.0, 20.0, 0.01)


def arrivals(down_s: float, drift: float = 0.0, seed: int = 1) -> np.ndarray:
    """Log times of arrival: the way down takes `down_s` and up to 5 ms more."""
    late_s = np.random.default_rng(seed).uniform(0.0, 0.005, len(STAMPS_S))
    return STAMPS_S * (1.0 + drift) + OFFSET_S + down_s + late_s


def exchanges(up_s: float, down_s: float, drift: float = 0.0, offset_s: float = OFFSET_S) -> list[Exchange]:
    late_s = np.random.default_rng(2).uniform(0.0, 0.05, 200)
    moments = [(t_s, t_s * (1.0 + drift) + offset_s) for t_s in np.arange(0.0, 20.0, 0.1)]
    return [
        Exchange(log_s - up_s, log_s + down_s + late, t_s) for (t_s, log_s), late in zip(moments, late_s, strict=True)
    ]


@pytest.mark.parametrize("drift", [0.0, 0.013, -0.02])
def test_exchanges_give_the_offset_of_a_symmetric_link(drift: float) -> None:
    clock = clock_of(STAMPS_S, arrivals(0.02, drift), exchanges(0.02, 0.02, drift))
    error_s = clock.log_time_s(STAMPS_S) - (STAMPS_S * (1.0 + drift) + OFFSET_S)
    # The shortest of ten exchanges each second is at most some 10 ms late, half of which is the offset's error.
    assert np.abs(np.median(error_s)) < 0.004
    assert np.abs(error_s[:-100]).max() < 0.012
    assert clock.round_trip_s == pytest.approx(0.065, abs=0.005)


@pytest.mark.parametrize("drift", [0.0, 0.013, -0.02])
def test_arrivals_give_it_but_for_the_least_delay(drift: float) -> None:
    clock = clock_of(STAMPS_S, arrivals(0.02, drift), [])
    error_s = clock.log_time_s(STAMPS_S) - (STAMPS_S * (1.0 + drift) + OFFSET_S + 0.02)
    assert clock.round_trip_s is None
    assert np.abs(np.median(error_s)) < 0.001
    assert np.percentile(np.abs(error_s), 90) < 0.003


def test_exchanges_with_another_clock_are_not_used() -> None:
    clock = clock_of(STAMPS_S, arrivals(0.02), exchanges(0.02, 0.02, offset_s=OFFSET_S + 5.0))
    assert clock.round_trip_s is None
    assert clock.log_time_s(np.array([10.0]))[0] == pytest.approx(10.0 + OFFSET_S + 0.02, abs=0.003)
