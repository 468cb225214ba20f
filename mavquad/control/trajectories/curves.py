"""Curves over their phase: north, west, up from the point where they begin, and five derivatives of each.

The phase is a time in s, that of a flight at full pace. The fifth derivative is there for the fourth one of the heading.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Protocol

from mavquad.control.trajectories.taylor import Row, septic

Six = tuple[float, float, float, float, float, float]
Point = tuple[Six, Six, Six, Six]
"""x, y, z (NWU, m) and the yaw that belongs to the place (rad); i-th derivatives in s^-i."""

NO_YAW: Six = (0.0,) * 6


class Curve(Hashable, Protocol):
    """Anything that can be flown along."""

    @property
    def length_s(self) -> float:
        """The phase at its end; it begins at 0."""
        ...

    @property
    def grid_s(self) -> tuple[float, ...]:
        """Phases from 0 to the end between which it turns by much less than half a turn, unless it reverses."""
        ...

    def at(self, phase_s: float) -> Point:
        """The point at a phase, and its derivatives with respect to it."""
        ...


@dataclass(frozen=True, slots=True)
class Circle:
    """Level, through the point where it begins, northwards at first; its centre is east of it if clockwise, else west.

    x = r sin(w s), y = -+ r (1 - cos(w s)).
    """

    radius_m: float
    period_s: float
    clockwise: bool
    laps: int = 1

    @property
    def length_s(self) -> float:
        """Of all laps."""
        return self.period_s * self.laps

    @property
    def grid_s(self) -> tuple[float, ...]:
        """32 a lap."""
        return _even(self.length_s, 32 * self.laps)

    def at(self, phase_s: float) -> Point:
        """The point at a phase, and its derivatives with respect to it."""
        w = math.tau / self.period_s
        x = _sine(self.radius_m, w, phase_s)
        side = -self.radius_m if self.clockwise else self.radius_m
        c0, *rest = _cosine(-side, w, phase_s)
        return (x, (side + c0, rest[0], rest[1], rest[2], rest[3], rest[4]), NO_YAW, NO_YAW)


@dataclass(frozen=True, slots=True)
class Eight:
    """A figure of eight with its crossing where it begins: north = a sin(w s), and b sin(2 w s) upwards or to the east."""

    along_m: float
    across_m: float
    period_s: float
    upright: bool
    laps: int = 1

    @property
    def length_s(self) -> float:
        """Of all laps."""
        return self.period_s * self.laps

    @property
    def grid_s(self) -> tuple[float, ...]:
        """64 a lap."""
        return _even(self.length_s, 64 * self.laps)

    def at(self, phase_s: float) -> Point:
        """The point at a phase, and its derivatives with respect to it."""
        w = math.tau / self.period_s
        x = _sine(self.along_m, w, phase_s)
        if self.upright:
            return (x, NO_YAW, _sine(self.across_m, 2.0 * w, phase_s), NO_YAW)
        return (x, _sine(-self.across_m, 2.0 * w, phase_s), NO_YAW, NO_YAW)


@dataclass(frozen=True, slots=True)
class Spline:
    """Pieces of degree 7: where each begins, and value and seven derivatives there of x, y, z and yaw."""

    starts_s: tuple[float, ...]
    pieces: tuple[tuple[Row, Row, Row, Row], ...]
    length_s: float

    @property
    def grid_s(self) -> tuple[float, ...]:
        """8 a piece."""
        ends = (*self.starts_s[1:], self.length_s)
        inner = [a + (b - a) * k / 8.0 for a, b in zip(self.starts_s, ends, strict=True) for k in range(8)]
        return (*inner, self.length_s)

    def at(self, phase_s: float) -> Point:
        """The point at a phase, and its derivatives with respect to it."""
        piece = max(0, bisect_right(self.starts_s, phase_s) - 1)
        x, y, z, yaw = self.pieces[piece]
        h = phase_s - self.starts_s[piece]
        return (septic(x, h), septic(y, h), septic(z, h), septic(yaw, h))


def _sine(a: float, w: float, phase_s: float) -> Six:
    s, c = a * math.sin(w * phase_s), a * math.cos(w * phase_s)
    w2 = w * w
    w4 = w2 * w2
    return (s, w * c, -w2 * s, -w2 * w * c, w4 * s, w4 * w * c)


def _cosine(a: float, w: float, phase_s: float) -> Six:
    s, c = a * math.sin(w * phase_s), a * math.cos(w * phase_s)
    w2 = w * w
    w4 = w2 * w2
    return (c, -w * s, -w2 * c, w2 * w * s, w4 * c, -w4 * w * s)


def _even(length: float, count: int) -> tuple[float, ...]:
    return tuple(length * k / count for k in range(count + 1))
