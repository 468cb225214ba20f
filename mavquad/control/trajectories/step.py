"""The step from 0 to 1 with four continuous, bounded derivatives, in the least time that its shape allows.

A unit step convolved with boxcars of lengths T1 .. T5 and area 1 is a spline of degree 5. Over a way D its peaks are

    D / T1,   D / (T1 T2),   D / (T1 T2 T3),   D / (T1 T2 T3 T4)

and no more than that if no two pulses of a derivative overlap: T_i >= T_(i+1) + ... + T5 for each i. The fifth boxcar is
as long as the fourth; it makes the fourth derivative continuous, and that is then a row of triangles. With bounds v, a, j, s
the boxcars are T4 = T5 = j/s, T3 = a/j, T2 = v/a, T1 = D/v. Where a way is too short for a bound to be reached, that bound
gives way, from the innermost out:

    j = min(j, sqrt(a s / 2))               so that  T3 >= T4 + T5
    a with  a (a/j + 2 j/s) = v             so that  T2 >= T3 + T4 + T5
    v with  v (v/a + a/j + 2 j/s) = D       so that  T1 >= T2 + T3 + T4 + T5

The left sides grow with their unknown, so each has one solution. The time in all is D/v + v/a + a/j + 2 j/s.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

from mavquad.control.trajectories.taylor import quintic

Times = tuple[float, float, float, float, float]
Five = tuple[float, float, float, float, float]

BEFORE: Five = (0.0, 0.0, 0.0, 0.0, 0.0)
AFTER: Five = (1.0, 0.0, 0.0, 0.0, 0.0)

TICKS_PER_S = 1 << 40
"""A step is worked out in whole ticks and without rounding. In floating point, what is left of the jerk at the end of a ramp
would grow with the cube of the time, to centimetres over kilometres."""

_HALVINGS = 100


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest first to fourth derivative; all positive."""

    first: float
    second: float
    third: float
    fourth: float


@dataclass(frozen=True, slots=True)
class Step:
    """The step: where its pieces begin (s from its start), and each one's value and five derivatives there."""

    starts_s: tuple[float, ...]
    pieces: tuple[tuple[float, ...], ...]
    duration_s: float

    def at(self, t_s: float) -> Five:
        """Value and four derivatives, t_s after the start; 0 before it, 1 from the end on."""
        if t_s <= 0.0:
            return BEFORE
        if t_s >= self.duration_s:
            return AFTER
        piece = bisect_right(self.starts_s, t_s) - 1
        return quintic(self.pieces[piece], t_s - self.starts_s[piece])


def boxcars(way: float, bounds: Bounds) -> Times:
    """The lengths of the five boxcars for a way > 0, s."""
    first = _speed(way, bounds)
    second = _acceleration(first, bounds)
    third = _jerk(second, bounds)
    last = third / bounds.fourth
    return (way / first, first / second, second / third, last, last)


def rise_times(speed: float, bounds: Bounds) -> tuple[float, float, float, float]:
    """The lengths of T2 .. T5 that lead from rest to a speed, s."""
    second = _acceleration(speed, bounds)
    third = _jerk(second, bounds)
    last = third / bounds.fourth
    return (speed / second, second / third, last, last)


def phase_boxcars(length_s: float, ramp_s: float) -> Times:
    """The boxcars of a phase that grows by `length_s` at a rate of 1, but for a smooth ramp from rest and one to rest.

    Where the length is shorter than the ramp, the ramp is that short and the rate of 1 is just reached.
    """
    ramp = min(ramp_s, length_s)
    return (length_s, ramp / 2.0, ramp / 4.0, ramp / 8.0, ramp / 8.0)


def step(times: Times) -> Step:
    """The spline of degree 5 of five boxcars, all longer than 0, s."""
    lengths = [math.ceil(time * TICKS_PER_S) for time in times]
    edges: dict[int, int] = {0: 1}
    for length in lengths:
        later = {moment + length: -sign for moment, sign in edges.items()}
        edges = {moment: edges.get(moment, 0) + later.get(moment, 0) for moment in edges.keys() | later.keys()}
    moments = sorted(edges)
    scale = 120 * math.prod(lengths)
    state: tuple[int, ...] = (0, 0, 0, 0, 0, 0)
    pieces = []
    for start, end in pairwise(moments):
        state = (*state[:5], state[5] + 120 * edges[start])
        # Dividing one integer by another rounds once.
        pieces.append(tuple(value * TICKS_PER_S**order / scale for order, value in enumerate(state)))
        state = _later(state, end - start)
    return Step(tuple(moment / TICKS_PER_S for moment in moments[:-1]), tuple(pieces), moments[-1] / TICKS_PER_S)


def stretched(times: Times, duration_s: float) -> Times:
    """The same shape over another, longer time, which lowers all its derivatives."""
    factor = max(1.0, duration_s / math.fsum(times))
    t1, t2, t3, t4, t5 = times
    return (t1 * factor, t2 * factor, t3 * factor, t4 * factor, t5 * factor)


def _later(state: tuple[int, ...], h: int) -> tuple[int, ...]:
    """Value and derivatives `h` ticks later, exactly: with the factor 120 all these divisions leave no remainder."""
    return tuple(
        sum(state[order] * h ** (order - k) // math.factorial(order - k) for order in range(k, 6)) for k in range(6)
    )


def _jerk(second: float, bounds: Bounds) -> float:
    """The third derivative that a second one lets be reached."""
    return min(bounds.third, math.sqrt(second * bounds.fourth / 2.0))


def _rise(second: float, bounds: Bounds) -> float:
    """T3 + T4 + T5: from no second derivative to this one."""
    third = _jerk(second, bounds)
    return second / third + 2.0 * third / bounds.fourth


def _acceleration(first: float, bounds: Bounds) -> float:
    """The second derivative that a first one lets be reached: a (a/j + 2 j/s) = v, with either form of j."""
    j, s = bounds.third, bounds.fourth
    second = math.cbrt(first * first * s / 8.0)
    if second * s / 2.0 > j * j:
        # a^2 + 2 (j^2 / s) a - j v = 0, solved without a difference of like numbers.
        half = j * j / s
        second = j * first / (half + math.sqrt(half * half + j * first))
    return min(bounds.second, second)


def _speed(way: float, bounds: Bounds) -> float:
    """The first derivative that a way lets be reached, by halving an interval."""

    def needs(speed: float) -> float:
        second = _acceleration(speed, bounds)
        return speed * (speed / second + _rise(second, bounds))

    high = bounds.first
    if needs(high) <= way:
        return high
    low = 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if needs(middle) <= way:
            low = middle
        else:
            high = middle
    return low
