"""Derivatives of g(phase(t)) from those of g and of the phase: Faa di Bruno's formula, written out to the fourth."""

from __future__ import annotations

from collections.abc import Sequence

Five = tuple[float, float, float, float, float]


def composed(g: Sequence[float], phase: Five) -> Five:
    """Value and four derivatives with respect to time.

    Args:
        g: value and at least four derivatives with respect to the phase, at the phase's present value.
        phase: the phase and its four derivatives with respect to time; its value is not used.
    """
    _, p1, p2, p3, p4 = phase
    square = p1 * p1
    return (
        g[0],
        g[1] * p1,
        g[2] * square + g[1] * p2,
        g[3] * square * p1 + 3.0 * g[2] * p1 * p2 + g[1] * p3,
        g[4] * square * square + 6.0 * g[3] * square * p2 + g[2] * (4.0 * p1 * p3 + 3.0 * p2 * p2) + g[1] * p4,
    )
