"""When messages of one kind arrived: rate, jitter, gaps, and how old they were."""

from __future__ import annotations

import itertools
import statistics
from dataclasses import dataclass

STREAM_SHARE = 0.3
"""Of the time that is looked at: what lasts less is a burst (parameters, texts), and has no rate."""


@dataclass(frozen=True, slots=True)
class Stream:
    """What is known of the arrivals of one message.

    Attributes:
        count: how many came.
        rate_hz: of those that came, one interval to the next; None where they came for a moment only: no stream.
        jitter_ms: standard deviation of the intervals; None below three.
        gap_ms: the longest interval, that to the end included.
        age_ms: median age of the measurements by the vehicle's own stamps; None where there are none.
    """

    count: int
    rate_hz: float | None
    jitter_ms: float | None
    gap_ms: float | None
    age_ms: float | None


class Arrivals:
    """Collects them."""

    def __init__(self) -> None:
        self._times_us: list[int] = []
        self._ages_us: list[int] = []

    def add(self, now_us: int, age_us: int | None) -> None:
        """One arrived."""
        self._times_us.append(now_us)
        if age_us is not None:
            self._ages_us.append(age_us)

    def stream(self, start_us: int, end_us: int) -> Stream:
        """What they say of the time that was looked at."""
        times = self._times_us
        intervals = [after - before for before, after in itertools.pairwise(times)]
        span_us = times[-1] - times[0] if times else 0
        return Stream(
            count=len(times),
            rate_hz=len(intervals) * 1e6 / span_us if span_us > STREAM_SHARE * (end_us - start_us) else None,
            jitter_ms=statistics.stdev(intervals) / 1000 if len(intervals) > 1 else None,
            gap_ms=max([*intervals, end_us - times[-1]]) / 1000 if intervals else None,
            age_ms=statistics.median(self._ages_us) / 1000 if self._ages_us else None,
        )


@dataclass(frozen=True, slots=True)
class RoundTrips:
    """Of TIMESYNC, in ms."""

    count: int
    least_ms: float
    p50_ms: float
    p99_ms: float
    max_ms: float


def round_trips(values_us: list[int]) -> RoundTrips | None:
    """Their percentiles; None if there were none."""
    if not values_us:
        return None
    ordered = sorted(value / 1000 for value in values_us)
    last = len(ordered) - 1
    return RoundTrips(len(ordered), ordered[0], ordered[last // 2], ordered[round(last * 0.99)], ordered[-1])
