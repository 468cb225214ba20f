"""The thrust that acts now: a replica of the rotors' lag, fed with what was commanded.

A command is held until the next one, so that the thrust itself climbs in steps. Its derivative is taken of the line through
the middles of the steps, which is what the law means: half a step off, the measured jerk of z would be wrong by as much.
"""

from __future__ import annotations

import math


class ThrustReplica:
    """Thrust per mass behind a first-order lag.

    Attributes:
        value_m_s2: T at the last moment asked for.
        rate_m_s3: its derivative then.
    """

    def __init__(self, lag_s: float, thrust_m_s2: float, stamp_us: int) -> None:
        self._lag_s = lag_s
        self._now_us = stamp_us
        self._in_force = thrust_m_s2
        self._since_us = stamp_us
        self._held_us = 0
        self._slope = 0.0
        self._coming: list[tuple[int, float]] = []
        self.value_m_s2 = thrust_m_s2
        self.rate_m_s3 = 0.0

    def command(self, arrive_us: int, thrust_m_s2: float) -> None:
        """From this moment on another thrust is commanded; what was to come after it is not."""
        while self._coming and self._coming[-1][0] >= arrive_us:
            self._coming.pop()
        self._coming.append((arrive_us, thrust_m_s2))

    def advance(self, stamp_us: int) -> None:
        """To a later moment; an earlier one changes nothing."""
        while self._coming and self._coming[0][0] <= stamp_us:
            arrive_us, thrust = self._coming.pop(0)
            self._pass(arrive_us)
            self._held_us = max(arrive_us - self._since_us, 0)
            self._slope = (thrust - self._in_force) / (self._held_us * 1e-6) if self._held_us else 0.0
            self._in_force, self._since_us = thrust, arrive_us
        self._pass(stamp_us)
        self._differentiate()

    def _pass(self, stamp_us: int) -> None:
        elapsed_s = (stamp_us - self._now_us) * 1e-6
        if elapsed_s > 0.0:
            self._now_us = stamp_us
            left = math.exp(-elapsed_s / self._lag_s) if self._lag_s > 0.0 else 0.0
            self.value_m_s2 = self._in_force + (self.value_m_s2 - self._in_force) * left

    def _differentiate(self) -> None:
        """A command that is held for longer than the one before it climbs no more. Rotors quicker than the steps follow
        each of them: the line is then the commands' own."""
        age_us = self._now_us - self._since_us
        if self._lag_s * 1e6 > 0.5 * self._held_us:
            middle_s = (min(age_us, self._held_us) - 0.5 * self._held_us) * 1e-6
            self.rate_m_s3 = (self._in_force + self._slope * middle_s - self.value_m_s2) / self._lag_s
        else:
            self.rate_m_s3 = self._slope if age_us <= self._held_us else 0.0
