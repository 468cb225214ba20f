"""Guards of the timing: measurements that come too seldom, setpoints that leave too late."""

from __future__ import annotations

from collections import deque

from pydantic import Field

from mavquad.endpoint import grid_us
from mavquad.flight.guard_types import GuardSection, Tripped


class RateParams(GuardSection):
    """[guards.rate]"""

    share: float = Field(default=0.5, ge=0.0, lt=1.0)
    """Of the rate that a pose stream had before the law took over, or that was asked for, if that is less, this share must
    go on coming; 0: off."""
    window_s: float = Field(default=2.0, gt=0.1, le=60.0)
    """Over this long, s."""


class RateMonitor:
    """Counts the measurements of one stream.

    Args:
        params: what is enough.
        name: of the stream.
    """

    def __init__(self, params: RateParams, name: str) -> None:
        self._params = params
        self._name = name
        self._window_us = grid_us(params.window_s)
        self._arrivals_us: deque[int] = deque()
        self._expected_hz = 0.0
        self._since_us = 0

    def start(self, expected_hz: float, now_us: int) -> None:
        """The law takes over: from now on this rate, in Hz, is expected, or what came in the last window, if that is less.

        Measurements that others overtook are not among them: of 100 Hz with 50 ms of jitter and 20 % lost, 50 Hz are left.
        """
        while self._arrivals_us and self._arrivals_us[0] <= now_us - self._window_us:
            self._arrivals_us.popleft()
        came_hz = len(self._arrivals_us) / self._params.window_s
        self._expected_hz = min(expected_hz, came_hz) if came_hz else expected_hz
        self._arrivals_us.clear()
        self._since_us = now_us

    def take(self, now_us: int) -> Tripped | None:
        """One measurement came; whether those of the last window were too few, once there was a whole one."""
        self._arrivals_us.append(now_us)
        while self._arrivals_us[0] <= now_us - self._window_us:
            self._arrivals_us.popleft()
        rate_hz, least_hz = len(self._arrivals_us) / self._params.window_s, self._params.share * self._expected_hz
        if now_us - self._since_us < self._window_us or rate_hz >= least_hz:
            return None
        words = f"{self._name} comes at {rate_hz:.0f} Hz, {least_hz:.0f} needed"
        return Tripped("rate", words, self._params.reaction)


class LatenessParams(GuardSection):
    """[guards.lateness]"""

    limit_ms: float = Field(default=100.0, ge=0.0, le=10_000.0)
    """A setpoint that leaves this long after the measurement that it answers came, ms; 0: off."""
    count: int = Field(default=5, ge=1, le=1000)
    """So many times trip it; what follows a late one within limit_ms is of the same stall ..."""
    window_s: float = Field(default=2.0, gt=0.0, le=60.0)
    """... within this long, s."""


class LatenessMonitor:
    """The setpoints that left late, as the driver tells; the core itself has no clock to see it by."""

    def __init__(self, params: LatenessParams) -> None:
        self._params = params
        self._window_us = grid_us(params.window_s)
        self._late_us: deque[int] = deque()

    def take(self, lateness_us: int, now_us: int) -> Tripped | None:
        """A setpoint left so late, now."""
        params = self._params
        limit_us = params.limit_ms * 1e3
        if not 0.0 < limit_us < lateness_us or (self._late_us and now_us - self._late_us[-1] < limit_us):
            return None
        self._late_us.append(now_us)
        while self._late_us[0] <= now_us - self._window_us:
            self._late_us.popleft()
        if len(self._late_us) < params.count:
            return None
        words = f"setpoints left more than {params.limit_ms:g} ms late {params.count} times in {params.window_s:g} s"
        return Tripped("lateness", f"{words}, the last one {lateness_us * 1e-3:.0f} ms", params.reaction)
