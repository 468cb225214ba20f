"""When to be at which waypoint: as soon as the limits of the reference allow.

Between waypoints the time is first in proportion to the distance, at the largest speed. Stretching a flight's time by c
divides its k-th derivative by c^k, exactly; so the peaks of this first flight tell the one factor that meets all limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

from mavquad.control.reference import ReferenceParams
from mavquad.control.trajectories import along
from mavquad.control.trajectories.along import Along
from mavquad.control.trajectories.curves import Spline
from mavquad.control.trajectories.spline import Sample, spline
from mavquad.control.trajectories.step import rise_times
from mavquad.types import Vec3

MARGIN = 1.002
"""For what lies between the moments looked at."""
LOOKS_A_PIECE = 40


def waypoint_curve(places: Sequence[Vec3], reference: ReferenceParams, looks_along: bool) -> tuple[Spline, float]:
    """The curve through places (NWU, m; two or more, none twice in a row), and how long its ramps are, s.

    Raises:
        NoHeading: the yaw is to be the direction of a curve that reverses.
    """
    bounds = reference.way_bounds()
    times = list(accumulate((math.dist(a, b) / bounds.first for a, b in pairwise(places)), initial=0.0))
    ramp_s = math.fsum(rise_times(bounds.first, bounds))
    first = along.along(0, spline(_samples(times, places)), ramp_s, looks_along)
    factor = MARGIN * _excess(first, reference, LOOKS_A_PIECE * len(places))
    return spline(_samples([time * factor for time in times], places)), min(ramp_s, times[-1]) * factor


def _samples(times: Sequence[float], places: Sequence[Vec3]) -> list[Sample]:
    return [(time, x, y, z, 0.0) for time, (x, y, z) in zip(times, places, strict=True)]


def _excess(flight: Along, reference: ReferenceParams, looks: int) -> float:
    """The factor by which the time must be stretched; less than 1 if the flight could be shorter."""
    way, turn = reference.way_bounds(), reference.turn_bounds()
    ways = (way.first, way.second, way.third, way.fourth)
    turns = (turn.first, turn.second, turn.third, turn.fourth)
    worst = 0.0
    for look in range(looks + 1):
        z, yaw, x, y = along.channels(flight, round(flight.duration_s * 1e6 * look / looks))
        for k in range(1, 5):
            share = max(math.hypot(x[k], y[k], z[k]) / ways[k - 1], abs(yaw[k]) / turns[k - 1])
            worst = max(worst, share ** (1.0 / k))
    return worst
