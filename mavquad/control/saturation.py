"""sat_N of the law (7): smooth, the identity near zero, never beyond N."""

from __future__ import annotations

import math

LINEAR_SHARE = 0.7
"""Up to this share of N nothing is changed."""


def smooth_saturation(value: float, level: float) -> float:
    """sat_N(value): twice continuously differentiable, odd, increasing, |sat_N| <= N.

    The identity up to s N, then s N + (1 - s) N tanh(excess / ((1 - s) N)): tanh has slope 1 and no curvature at zero.
    """
    knee = LINEAR_SHARE * level
    size = abs(value)
    if size <= knee:
        return value
    room = level - knee
    return math.copysign(knee + room * math.tanh((size - knee) / room), value)


def is_saturated(value: float, level: float) -> bool:
    """Whether sat_N changes this value."""
    return abs(value) > LINEAR_SHARE * level
