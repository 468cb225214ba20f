"""The delay that the law bridges, as the link shows it before the flight: how old an attitude is when it arrives, and half
of the quickest round trip for the command's way up. Neither is known without TIMESYNC."""

from __future__ import annotations

from collections import deque
from statistics import median

KEPT = 200
ENOUGH = 50
OUR_OWN_US = 500
"""From the arrival of a measurement until the command leaves; live flights measure it as their lateness."""
LEAST_S, MOST_S = 0.002, 0.3


class DelayMeter:
    """Ages of the latest attitudes."""

    def __init__(self) -> None:
        self._ages_us: deque[int] = deque(maxlen=KEPT)

    def take(self, age_us: int | None) -> None:
        """An attitude was so old when it arrived; None where that is not known."""
        if age_us is not None:
            self._ages_us.append(age_us)

    def delay_s(self, least_round_trip_us: int | None) -> float | None:
        """From the stamp of a measurement until the command that answers it arrives; None while it is not known."""
        if least_round_trip_us is None or len(self._ages_us) < ENOUGH:
            return None
        delay_us = median(self._ages_us) + least_round_trip_us / 2 + OUR_OWN_US
        return min(max(delay_us * 1e-6, LEAST_S), MOST_S)
