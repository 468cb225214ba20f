"""Whether the estimated velocity is the slope of the estimated position, seen while the autopilot takes off and hovers.

Over a second the two should agree: p(t + 1) - p(t) = integral of v. On real ArduCopter 4.7 they do to 0.02 m/s. On PX4's SIH
they differ by 0.13 (1.13.3) to 0.3 m/s (1.16.2), slowly: an observer that is corrected by such a velocity is misled by it,
and flies better without.
"""

from __future__ import annotations

import math
from collections import deque

from mavquad.types import Position, Vec3

WINDOW_US = 1_000_000
WINDOWS = 8
LEAST_WINDOWS = 2
GAP_US = 300_000
"""Over a longer gap nothing is integrated."""
BELIEVED_M_S = 0.06


class VelocityCheck:
    """Compares them over the latest seconds."""

    def __init__(self) -> None:
        self._differences_m_s: deque[float] = deque(maxlen=WINDOWS)
        self._from: Position | None = None
        self._last: Position | None = None
        self._way_m: Vec3 = (0.0, 0.0, 0.0)

    def take(self, position: Position) -> None:
        """The next position, with its velocity."""
        before, self._last = self._last, position
        if before is None or self._from is None or position.stamp_us - before.stamp_us > GAP_US:
            self._from, self._way_m = position, (0.0, 0.0, 0.0)
            return
        half_s = (position.stamp_us - before.stamp_us) * 0.5e-6
        x, y, z = (
            way + half_s * (v0 + v1)
            for way, v0, v1 in zip(self._way_m, before.velocity_nwu_m_s, position.velocity_nwu_m_s, strict=True)
        )
        self._way_m = (x, y, z)
        elapsed_us = position.stamp_us - self._from.stamp_us
        if elapsed_us >= WINDOW_US:
            miss_m = math.dist(
                position.position_nwu_m, [p + w for p, w in zip(self._from.position_nwu_m, self._way_m, strict=True)]
            )
            self._differences_m_s.append(miss_m / (elapsed_us * 1e-6))
            self._from, self._way_m = position, (0.0, 0.0, 0.0)

    @property
    def difference_m_s(self) -> float:
        """RMS of the difference; 0 while too little has been seen."""
        if len(self._differences_m_s) < LEAST_WINDOWS:
            return 0.0
        return math.sqrt(math.fsum(d * d for d in self._differences_m_s) / len(self._differences_m_s))

    @property
    def misleads(self) -> bool:
        """Whether the velocity is not to be believed."""
        return self.difference_m_s > BELIEVED_M_S
