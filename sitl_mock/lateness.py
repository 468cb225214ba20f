"""How late deadlines fire, in bounded memory."""

from __future__ import annotations

_STEP_S = 1e-4
_STEPS = 5000


class Lateness:
    """A histogram in steps of 0.1 ms up to 0.5 s."""

    def __init__(self) -> None:
        self._counts = [0] * (_STEPS + 1)

    def add(self, late_s: float) -> None:
        """Count one deadline."""
        self._counts[min(max(int(late_s / _STEP_S), 0), _STEPS)] += 1

    def percentile_ms(self, share: float) -> float:
        """The lateness that this share of the deadlines does not exceed, in ms; 0 where there was none."""
        wanted = share * sum(self._counts)
        seen = 0
        for step, count in enumerate(self._counts):
            seen += count
            if count and seen >= wanted:
                return (step + 1) * _STEP_S * 1e3
        return 0.0
