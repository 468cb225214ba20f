"""Delay, lag and gain between a command and a vehicle's answer, from recorded data.

    static        y(t) = gain * x(t - dead) + window's offset
    integrating   y(t) = gain * integral of x(t - dead) - damping * integral of y + window's offset and slope
    lag x' = u - x,   u the command in force

Separable least squares: gain and damping are linear and solved for exactly at each (dead, lag), which are searched for
(Golub and Pereyra 1973). The result says how well it is known, and data without enough excitation are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavquad.analysis.identification_fit import Problem, View, covariance, solve
from mavquad.analysis.identification_model import Array
from mavquad.analysis.identification_windows import Span, Windows, cut

Kind = Literal["static", "integrating"]

WINDOW_S: dict[Kind, float] = {"static": 4.0, "integrating": 2.0}
LEAST_WINDOWS = 2
LEAST_SAMPLES = 150
LEAST_EXPLAINED = 0.05
LARGEST_GAIN_ERROR = 0.1
LARGEST_TIME_ERROR_S = 0.02
LARGEST_TIME_ERROR = 0.1
"""Of dead time and lag together; the larger of both limits counts, since a slow loop forgives more."""
_LEAST_PER_WINDOW = 15
_GAPS_OF_SPACING = 5.0
_LEAST_GAP_S = 0.1


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and its standard error."""

    value: float
    error: float


@dataclass(frozen=True, slots=True)
class AxisFit:
    """What one axis gave.

    Attributes:
        dead_s: dead time from the command's time to the start of the answer, s.
        lag_s: first-order lag, s.
        total_s: the sum of both, s; better known than either.
        gain: answer per command; for "integrating", the answer's derivative per command.
        damping_1_s: for "integrating", the damping of the answer, 1/s; else None.
        explained: share of the answer's variance within the windows that the model explains.
        residual: standard deviation of what it leaves, in the answer's unit.
        command_sd: standard deviation of the command within the windows, in its unit.
        samples: answers used.
        seconds: their time span, gaps left out.
        windows: stretches with an offset of their own.
        times_s, answer, model: the samples used and the fitted model at them, window's polynomial included,
            shape (samples,) each.
    """

    dead_s: Estimate
    lag_s: Estimate
    total_s: Estimate
    gain: Estimate
    damping_1_s: Estimate | None
    explained: float
    residual: float
    command_sd: float
    samples: int
    seconds: float
    windows: int
    times_s: Array
    answer: Array
    model: Array


@dataclass(frozen=True, slots=True)
class Refused:
    """Why an axis has no figures."""

    reason: str


@dataclass(frozen=True, slots=True)
class Signal:
    """Values at times: `times_s` increasing, s, shape (n,); `values`, shape (n,)."""

    times_s: Array
    values: Array


def identify(command: Signal, answer: Signal, spans: Sequence[Span], kind: Kind) -> AxisFit | Refused:
    """Fit one axis.

    Args:
        command: each value is in force from its time to the next one's.
        answer: samples of what the vehicle did, on the same clock.
        spans: from, to, s: when the vehicle was following these commands.
        kind: whether the answer follows the command or integrates it.

    Returns:
        The fit, or why there is none.
    """
    spacing_s = float(np.median(np.diff(answer.times_s))) if len(answer.times_s) > 1 else 1.0
    gap_s = max(_LEAST_GAP_S, _GAPS_OF_SPACING * spacing_s)
    order = 1 if kind == "integrating" else 0
    windows, used = cut(answer.times_s, spans, WINDOW_S[kind], gap_s, _LEAST_PER_WINDOW, order)
    if windows.count < LEAST_WINDOWS or len(used) < LEAST_SAMPLES:
        return Refused(
            f"too little data: {len(used)} answers in {_seconds(windows):.1f} s while it followed commands in the air"
        )
    problem = Problem(command.times_s, command.values, answer.values[used], windows, kind == "integrating")
    if problem.command_sd <= 1e-9 * (1.0 + float(np.max(np.abs(command.values)))):
        return Refused("the command never changes: no excitation")
    if float(np.ptp(problem.answer)) == 0.0:
        return Refused("the answer never changes")
    return _judged(_fit(problem))


def _fit(problem: Problem) -> AxisFit | Refused:
    solution, view = solve(problem)
    if solution.on_edge:
        return Refused(f"no dead time and lag fit within the range searched ({solution.on_edge})")
    errors = covariance(view, solution)
    dead, lag, gain, *damping = (
        Estimate(float(value), float(np.sqrt(max(variance, 0.0))))
        for value, variance in zip((solution.dead_s, solution.lag_s, *solution.linear), np.diag(errors), strict=True)
    )
    plain, windows = View(problem), problem.windows
    residual = plain.residual(solution)
    return AxisFit(
        dead_s=dead,
        lag_s=lag,
        total_s=Estimate(dead.value + lag.value, float(np.sqrt(max(errors[:2, :2].sum(), 0.0)))),
        gain=gain,
        damping_1_s=damping[0] if damping else None,
        explained=1.0 - float(np.var(residual) / np.var(plain.answer)),
        residual=float(np.std(residual)),
        command_sd=problem.command_sd,
        samples=len(windows.times_s),
        seconds=_seconds(windows),
        windows=windows.count,
        times_s=windows.times_s,
        answer=problem.answer,
        model=problem.answer - residual,
    )


def _seconds(windows: Windows) -> float:
    return float(np.diff(windows.times_s)[np.diff(windows.index) == 0].sum())


def _judged(fit: AxisFit | Refused) -> AxisFit | Refused:
    """The fit, if it says enough about the vehicle to fly on."""
    if isinstance(fit, Refused):
        return fit
    if fit.explained < LEAST_EXPLAINED:
        return Refused(f"too little excitation: the command explains {max(fit.explained, 0.0):.0%} of the answer")
    if fit.gain.value <= 0.0:
        return Refused(f"the answer goes against the command (gain {fit.gain.value:.3g})")
    if fit.gain.error > LARGEST_GAIN_ERROR * fit.gain.value:
        return Refused(f"too little excitation: the gain is known within {fit.gain.error / fit.gain.value:.0%} only")
    if fit.total_s.error > max(LARGEST_TIME_ERROR_S, LARGEST_TIME_ERROR * fit.total_s.value):
        return Refused(
            f"too little excitation: dead time and lag together are known within {fit.total_s.error * 1e3:.0f} ms only"
        )
    return fit
