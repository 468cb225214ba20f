"""Curves through given points at given times: splines of degree 7, with six continuous derivatives.

Points that are far apart in time are met exactly, by the natural spline (fourth to sixth derivative zero at both ends):
of all curves through the points at these times it has the least integral of the squared snap. Two or three points give a
line, or a parabola.

Points that are close together in time are not: rounding a position to a millimetre every 10 ms is a snap of 10^6 m/s^4. The
knots are then kept a least time apart, and the spline is the least-squares one.

scipy does this when a flight is planned; what is left of it are plain numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mavquad.control.trajectories.curves import Curve, Spline
from mavquad.control.trajectories.taylor import Row

Numbers = npt.NDArray[np.float64]

DEGREE = 7
NATURAL = (4, 5, 6)
"""Derivatives that are zero at both ends."""
MISS_MAX_M = 1e-6
"""A spline through points that misses one of them by more was not solved but only seemed to be."""

Sample = tuple[float, float, float, float, float]
"""Time (s), then x, y, z (m, NWU) and yaw (rad)."""


class NoCurve(Exception):
    """No spline through such points can be worked out: times that differ by too many orders of magnitude."""


def thinned(times_s: Sequence[float], least_s: float) -> list[int]:
    """Indices of times that are at least so far apart; the first and the last are among them."""
    kept = [0]
    last = len(times_s) - 1
    for index in range(1, last):
        if times_s[index] - times_s[kept[-1]] >= least_s and times_s[last] - times_s[index] >= least_s:
            kept.append(index)
    return [*kept, last]


def spline(samples: Sequence[Sample], least_s: float = 0.0) -> Spline:
    """The curve through the samples, or near them where they are closer in time than `least_s`.

    Args:
        samples: two or more, with times that grow; the phase of the curve is the time since the first.
        least_s: knots are no closer than this.

    Raises:
        NoCurve: the equations of the spline cannot be solved.
    """
    table = np.array(samples, dtype=float)
    times, values = table[:, 0] - table[0, 0], table[:, 1:]
    kept = thinned(times.tolist(), least_s)
    try:
        fitted, starts = _natural(times, values) if len(kept) == len(times) else _smooth(times, values, times[kept])
    except (ValueError, np.linalg.LinAlgError):
        raise NoCurve from None
    degree = fitted.k
    orders = [fitted.derivative(k)(starts) if k else fitted(starts) for k in range(degree + 1)]
    orders += [np.zeros_like(orders[0])] * (DEGREE - degree)
    table = np.stack(orders, axis=-1)
    if not np.isfinite(table).all():
        raise NoCurve
    rows = table.tolist()
    pieces = tuple((_row(x), _row(y), _row(z), _row(yaw)) for x, y, z, yaw in rows)
    curve = Spline(tuple(starts.tolist()), pieces, float(times[-1]))
    if len(kept) == len(times) and max(misses_m(curve, samples)) > MISS_MAX_M:
        raise NoCurve
    return curve


def misses_m(curve: Curve, samples: Sequence[Sample]) -> list[float]:
    """How far the curve passes from each sample at its time, m."""
    start = samples[0][0]
    found = []
    for time_s, *place, _ in samples:
        x, y, z, _ = curve.at(time_s - start)
        found.append(math.dist((x[0], y[0], z[0]), place))
    return found


def _natural(times: Numbers, values: Numbers) -> tuple[Any, Numbers]:
    """The natural spline through all points, and where its pieces begin.

    Where long times follow short ones, rounding makes it miss by 1e-6 m; what it misses by is fitted once more.
    """
    # Takes half a second to import, and most flights need no spline.
    from scipy.interpolate import BSpline, make_interp_spline

    if len(times) <= 3:
        return make_interp_spline(times, values, len(times) - 1), times[:1]
    ends = [(order, np.zeros(values.shape[1])) for order in NATURAL]
    near = make_interp_spline(times, values, DEGREE, bc_type=(ends, ends))
    rest = make_interp_spline(times, values - near(times), DEGREE, bc_type=(ends, ends))
    return BSpline(near.t, near.c + rest.c, DEGREE), times[:-1]


def _smooth(times: Numbers, values: Numbers, knots: Numbers) -> tuple[Any, Numbers]:
    """The least-squares spline with as many coefficients as knots, and where its pieces begin."""
    from scipy.interpolate import make_lsq_spline

    degree = min(DEGREE, len(knots) - 1)
    margin = (degree + 1) // 2
    inner = knots[margin:-margin] if degree == DEGREE else knots[:0]
    ends = np.ones(degree + 1)
    fitted = make_lsq_spline(times, values, np.concatenate([times[0] * ends, inner, times[-1] * ends]), k=degree)
    return fitted, np.concatenate([times[:1], inner])


def _row(values: list[float]) -> Row:
    return tuple(values)
