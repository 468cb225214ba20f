"""The delay that the law bridges, as the link shows it in the takeoff: how old an attitude is when it arrives, and half
of a round trip for the command's way up. Neither is known without TIMESYNC."""

from __future__ import annotations

from collections import deque
from statistics import median

KEPT = 200
ENOUGH = 50
OUR_OWN_S = 0.0005
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

    def delay_s(self, round_trip_s: float | None, most_s: float) -> float | None:
        """From the stamp of a measurement until the command that answers it arrives; None while it is not known.

        Args:
            round_trip_s: the usual one.
            most_s: as much as the law can bridge.
        """
        if round_trip_s is None or len(self._ages_us) < ENOUGH:
            return None
        delay_s = median(self._ages_us) * 1e-6 + round_trip_s / 2 + OUR_OWN_S
        return min(max(delay_s, LEAST_S), most_s, MOST_S)
