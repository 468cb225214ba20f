"""Where a curve leads: the direction of its horizontal velocity, and its derivatives.

With the velocity as a complex number w = x' + i y' over the phase, the heading is Im log w. From w' = L w, Leibniz' rule
gives L = w'/w and its derivatives one after the other, and the heading's derivatives are Im L, Im L', Im L'', Im L'''. They
do not depend on how fast the curve is flown, so there is a heading at rest, too. There is none where the horizontal
velocity over the phase is zero: at a reversal, at a stop within the curve, in a vertical climb. Such a curve cannot be
looked along, and `unwound` says where.
"""

from __future__ import annotations

import cmath
import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache

from mavquad.control.trajectories.chain_rule import Five
from mavquad.control.trajectories.curves import Curve, Point
from mavquad.frames import unwrap_near

TURN_MAX_RAD = 0.5
"""Between two knots of the table; a table this fine cannot miss a turn."""
INTERVAL_MIN_S = 1e-3
"""A heading that jumps within less is that of a curve that reverses or stands still."""
SPEED_MIN_M_S = 1e-3
"""Over the phase; below this the heading is noise."""


class NoHeading(Exception):
    """A curve stands still or reverses, horizontally, `at_s` of its phase."""

    def __init__(self, at_s: float) -> None:
        super().__init__(f"no heading at {at_s:.2f} s")
        self.at_s = at_s


@dataclass(frozen=True, slots=True)
class Heading:
    """The whole turns of a heading: its continuous value at some phases, the first one in (-pi, pi]."""

    phases_s: tuple[float, ...]
    angles_rad: tuple[float, ...]

    def at(self, phase_s: float, point: Point) -> Five:
        """Heading (rad, continuous, counter-clockwise from north) and four derivatives with respect to the phase."""
        (_, x1, x2, x3, x4, x5), (_, y1, y2, y3, y4, y5), *_ = point
        w1, w2, w3, w4, w5 = complex(x1, y1), complex(x2, y2), complex(x3, y3), complex(x4, y4), complex(x5, y5)
        l0 = w2 / w1
        l1 = (w3 - l0 * w2) / w1
        l2 = (w4 - l0 * w3 - 2.0 * l1 * w2) / w1
        l3 = (w5 - l0 * w4 - 3.0 * l1 * w3 - 3.0 * l2 * w2) / w1
        knot = max(0, bisect_right(self.phases_s, phase_s) - 1)
        angle = unwrap_near(math.atan2(y1, x1), self.angles_rad[knot])
        return (angle, l0.imag, l1.imag, l2.imag, l3.imag)


@lru_cache(maxsize=8)
def unwound(curve: Curve) -> Heading:
    """The continuous heading of a curve over its whole length.

    Raises:
        NoHeading: its horizontal velocity vanishes somewhere.
    """
    grid = curve.grid_s
    velocity = _velocity(curve, grid[0])
    phases, angles = [grid[0]], [cmath.phase(velocity)]
    for end in grid[1:]:
        # Halve the interval until the turn over it is small, then go on from there to its end.
        todo = [end]
        while todo:
            goal = todo[-1]
            there = _velocity(curve, goal)
            turn = cmath.phase(there / velocity)
            if abs(turn) <= TURN_MAX_RAD:
                velocity = there
                phases.append(goal)
                angles.append(angles[-1] + turn)
                todo.pop()
            elif goal - phases[-1] < INTERVAL_MIN_S:
                raise NoHeading(goal)
            else:
                todo.append(0.5 * (phases[-1] + goal))
    return Heading(tuple(phases), tuple(angles))


def _velocity(curve: Curve, phase_s: float) -> complex:
    x, y, *_ = curve.at(phase_s)
    velocity = complex(x[1], y[1])
    if abs(velocity) < SPEED_MIN_M_S:
        raise NoHeading(phase_s)
    return velocity
