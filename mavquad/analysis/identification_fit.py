"""The search for dead time and lag, and how well the data determine them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from mavquad.analysis.identification_model import Array, LaggedCommand
from mavquad.analysis.identification_windows import Windows, autoregression

DEAD_RANGE_S = (-0.03, 0.4)
LAG_RANGE_S = (0.0, 0.6)
FILTER_ORDER = 3
"""Of the whitening filter: white measurement noise and a slow disturbance together need more than one."""

_GRID_DEAD_S = np.arange(-0.02, 0.4, 0.02)
_GRID_LAG_S = (0.0, 0.02, 0.04, 0.08, 0.15, 0.3)
_ROUNDS = 3
_STEP_S = 2e-3
_NO_FILTER = np.zeros(0)


@dataclass(frozen=True, slots=True)
class Solution:
    """One point of the search with its linear coefficients.

    Attributes:
        dead_s: dead time, s.
        lag_s: lag, s.
        gain: of the model.
        damping_1_s: 1/s; 0 for a static model.
        filter_: the whitening filter under which it was found.
    """

    dead_s: float
    lag_s: float
    gain: float
    damping_1_s: float
    filter_: Array

    @property
    def on_edge(self) -> str:
        """Which end of the range searched it is at; "" inside. A lag of 0 is a value like any other."""
        if not DEAD_RANGE_S[0] + 1e-3 < self.dead_s < DEAD_RANGE_S[1] - 1e-3:
            return f"dead time {self.dead_s * 1e3:.0f} ms"
        return f"lag {self.lag_s * 1e3:.0f} ms" if self.lag_s > LAG_RANGE_S[1] - 1e-3 else ""


@dataclass(frozen=True)
class Problem:
    """One axis: commands, and the answers within their windows.

    Attributes:
        command_times_s, command: the commands, shape (m,) each.
        answer: at `windows.times_s`, shape (n,).
        windows: of the answers.
        integrating: whether the answer integrates the command.
    """

    command_times_s: Array
    command: Array
    answer: Array
    windows: Windows
    integrating: bool
    _lagged: dict[float, LaggedCommand] = field(default_factory=dict)

    @property
    def command_sd(self) -> float:
        """Standard deviation of the command in force within the windows."""
        held = LaggedCommand(self.command_times_s, self.command, 0.0).at(self.windows.times_s)
        return float(np.std(Windows(self.windows.times_s, self.windows.index, 0).free(held, _NO_FILTER)))

    @property
    def answer_sd(self) -> float:
        """Standard deviation of the answer without its windows' polynomials."""
        return float(np.std(self.windows.free(self.answer, _NO_FILTER)))

    def response(self, dead_s: float, lag_s: float) -> Array:
        """The model at gain 1, shape (n,)."""
        if lag_s not in self._lagged:
            self._lagged.clear()
            self._lagged[lag_s] = LaggedCommand(self.command_times_s, self.command, lag_s)
        lagged, times_s = self._lagged[lag_s], self.windows.times_s - dead_s
        return lagged.integral(times_s) if self.integrating else lagged.at(times_s)

    def columns(self, dead_s: float, lag_s: float, filter_: Array) -> Array:
        """What enters linearly, whitened and free of the windows' polynomials, shape (k, 1 or 2)."""
        columns = [self.response(dead_s, lag_s)]
        if self.integrating:
            columns.append(-self._integrated_answer())
        return np.stack([self.windows.free(column, filter_) for column in columns], axis=1)

    def _integrated_answer(self) -> Array:
        steps_s = np.diff(self.windows.times_s)
        means = (self.answer[1:] + self.answer[:-1]) / 2.0
        return np.concatenate(([0.0], np.cumsum(steps_s * means)))

    def residual(self, solution: Solution) -> Array:
        """What the model leaves of the answer, without its windows' polynomials, not whitened, shape (n,)."""
        columns = self.columns(solution.dead_s, solution.lag_s, _NO_FILTER)
        return np.asarray(self.windows.free(self.answer, _NO_FILTER) - columns @ _linear(solution, columns.shape[1]))


def _linear(solution: Solution, count: int) -> Array:
    return np.array((solution.gain, solution.damping_1_s)[:count])


def solve(problem: Problem) -> Solution:
    """Search the whole range coarsely, then refine, learning the noise's colour from the residuals in turns."""
    filter_ = _NO_FILTER
    grid = [(dead, lag) for lag in _GRID_LAG_S for dead in _GRID_DEAD_S]
    start = min(grid, key=lambda point: _misfit(problem, point[0], point[1], filter_))
    best = _refined(problem, start, filter_)
    for _ in range(_ROUNDS if FILTER_ORDER else 0):
        filter_ = autoregression(problem.windows, problem.residual(best), FILTER_ORDER)
        best = _refined(problem, (best.dead_s, best.lag_s), filter_)
    return best


def _refined(problem: Problem, start: tuple[float, float], filter_: Array) -> Solution:
    """Nelder and Mead's simplex: the misfit has kinks where a command's edge meets a sample."""
    dead_s, lag_s = start
    simplex = [(dead_s, lag_s), (dead_s + 0.01, lag_s), (dead_s, lag_s + 0.02)]
    found = minimize(
        lambda point: _misfit(problem, point[0], point[1], filter_),
        start,
        method="Nelder-Mead",
        bounds=(DEAD_RANGE_S, LAG_RANGE_S),
        options={"initial_simplex": simplex, "xatol": 1e-5, "fatol": 0.0, "maxiter": 120},
    )
    dead_s, lag_s = float(found.x[0]), float(found.x[1])
    columns = problem.columns(dead_s, lag_s, filter_)
    linear = np.linalg.lstsq(columns, problem.windows.free(problem.answer, filter_), rcond=None)[0]
    return Solution(dead_s, lag_s, float(linear[0]), float(linear[1]) if problem.integrating else 0.0, filter_)


def _misfit(problem: Problem, dead_s: float, lag_s: float, filter_: Array) -> float:
    """Sum of the squared residuals at the best linear coefficients."""
    columns, answer = problem.columns(dead_s, lag_s, filter_), problem.windows.free(problem.answer, filter_)
    left = answer - columns @ np.linalg.lstsq(columns, answer, rcond=None)[0]
    return float(left @ left)


def covariance(problem: Problem, solution: Solution) -> Array:
    """Covariance of (dead, lag, gain[, damping]) from the curvature, shape (3, 3) or (4, 4).

    With J the derivative of the model: the plain s^2 (J'J)^-1, or the one that lets the residuals be correlated and
    unequal between windows, (J'J)^-1 (sum over windows of J_w' r_w r_w' J_w) (J'J)^-1 (Liang and Zeger 1986); of the two,
    the one with the larger variance of dead + lag.
    """
    gradient = _gradient(problem, solution)
    columns = problem.columns(solution.dead_s, solution.lag_s, solution.filter_)
    answer = problem.windows.free(problem.answer, solution.filter_)
    left = answer - columns @ _linear(solution, columns.shape[1])
    bread = np.linalg.pinv(gradient.T @ gradient)
    freedom = max(len(left) - gradient.shape[1] - (problem.windows.order + 1) * problem.windows.count, 1)
    plain = bread * float(left @ left) / freedom
    index = problem.windows.whitened_index(len(solution.filter_))
    scores = np.stack([np.bincount(index, column * left) for column in gradient.T], axis=1)
    windows = problem.windows.count
    clustered = bread @ scores.T @ scores @ bread * windows / max(windows - 1, 1)
    return np.asarray(max((plain, clustered), key=lambda matrix: matrix[:2, :2].sum()))


def _gradient(problem: Problem, solution: Solution) -> Array:
    """Derivative of the model by (dead, lag, gain[, damping]), whitened and free, by differences, shape (k, 3 or 4)."""
    dead_s, lag_s, filter_ = solution.dead_s, solution.lag_s, solution.filter_
    low_s, high_s = max(lag_s - _STEP_S, 0.0), lag_s + _STEP_S

    def free(at_dead_s: float, at_lag_s: float) -> Array:
        return solution.gain * problem.columns(at_dead_s, at_lag_s, filter_)[:, 0]

    by_dead = (free(dead_s + _STEP_S, lag_s) - free(dead_s - _STEP_S, lag_s)) / (2.0 * _STEP_S)
    by_lag = (free(dead_s, high_s) - free(dead_s, low_s)) / (high_s - low_s)
    return np.column_stack([by_dead, by_lag, problem.columns(dead_s, lag_s, filter_)])
