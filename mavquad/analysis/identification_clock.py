"""The vehicle's clock on the log's: log time of a stamp = stamp + offset(stamp), the offset between knots linear; before
the first and behind the last it goes on as the clocks drift on the whole.

From TIMESYNC exchanges that the log holds both halves of: offset = (sent + received) / 2 - vehicle's answer, which is
right within half the difference of the link's two ways; of each second the exchange with the shortest round trip counts.
Without any, from the answers themselves: the running minimum of arrival minus stamp. That is later by the least time that
a message needs to come down the link, which then counts as dead time and not as age: their sum is the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mavquad.analysis.identification_model import Array

KNOT_S = 1.0
"""Clocks drift (real PX4 in lockstep: 13 ms/s): each second has its own offset."""
LEAST_PER_KNOT = 10
_LEAST_FOR_DRIFT = 5
_EARLIEST_S = -0.003  # an answer that arrives before its own stamp, beyond the stamp's resolution: not the same clock
_OLDEST_S = 1.0


@dataclass(frozen=True, slots=True)
class Exchange:
    """One TIMESYNC question and its answer: log time sent and received, the vehicle's time in between; s."""

    sent_s: float
    received_s: float
    vehicle_s: float

    @property
    def round_trip_s(self) -> float:
        """From question to answer, s."""
        return self.received_s - self.sent_s


@dataclass(frozen=True, slots=True)
class Clock:
    """Offset log time minus vehicle time at knots (vehicle time), s; shape (n,) each, n > 0.

    Attributes:
        stamps_s: knots, increasing.
        offsets_s: offset at each.
        round_trip_s: median round trip of the exchanges; None where the offset is from arrivals.
    """

    stamps_s: Array
    offsets_s: Array
    round_trip_s: float | None

    def log_time_s(self, stamps_s: Array) -> Array:
        """Stamps of the vehicle's clock as log time, s."""
        trend = _line(self.stamps_s, self.offsets_s)
        about = np.interp(stamps_s, self.stamps_s, self.offsets_s - np.polyval(trend, self.stamps_s))
        return np.asarray(stamps_s + np.polyval(trend, stamps_s) + about)


def _line(stamps_s: Array, offsets_s: Array) -> Array:
    """Slope and offset of the drift; without a slope where there are too few knots for one."""
    return (
        np.polyfit(stamps_s, offsets_s, 1) if len(stamps_s) >= _LEAST_FOR_DRIFT else np.array((0.0, offsets_s.mean()))
    )


def clock_of(stamps_s: Array, arrivals_s: Array, exchanges: Sequence[Exchange]) -> Clock:
    """The clock of one boot of the vehicle.

    Args:
        stamps_s: vehicle time of its messages, increasing, s, shape (n,), n > 0.
        arrivals_s: log time at which they arrived, s, shape (n,).
        exchanges: TIMESYNC; those with another clock than the messages' are noticed and not used.
    """
    if exchanges:
        clock = _by_exchange(exchanges)
        least_age_s = float(np.min(arrivals_s - clock.log_time_s(stamps_s)))
        if _EARLIEST_S <= least_age_s <= _OLDEST_S:
            return clock
    return _by_arrival(stamps_s, arrivals_s)


def _by_exchange(exchanges: Sequence[Exchange]) -> Clock:
    stamps_s = np.array([exchange.vehicle_s for exchange in exchanges])
    trips_s = np.array([exchange.round_trip_s for exchange in exchanges])
    middles_s = np.array([(exchange.sent_s + exchange.received_s) / 2.0 for exchange in exchanges])
    chosen = _least_of_each(stamps_s, trips_s, KNOT_S)
    return Clock(stamps_s[chosen], (middles_s - stamps_s)[chosen], float(np.median(trips_s)))


def _by_arrival(stamps_s: Array, arrivals_s: Array) -> Clock:
    delays_s = arrivals_s - stamps_s
    spacing_s = float(np.median(np.diff(stamps_s))) if len(stamps_s) > 1 else KNOT_S
    chosen = _least_of_each(stamps_s, delays_s, max(KNOT_S, LEAST_PER_KNOT * spacing_s))
    return Clock(stamps_s[chosen], delays_s[chosen], None)


def _least_of_each(stamps_s: Array, values: Array, period_s: float) -> list[int]:
    """Index of the smallest value in each period."""
    order = np.argsort(stamps_s, kind="stable")
    period = np.floor((stamps_s[order] - stamps_s[order[0]]) / period_s)
    parts = np.split(order, np.flatnonzero(np.diff(period)) + 1)
    return [int(part[np.argmin(values[part])]) for part in parts]
