"""The search for dead time and lag, and how well the data determine them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from mavquad.analysis.identification_model import Array, LaggedCommand
from mavquad.analysis.identification_windows import NO_FILTER, Projection, Windows, autoregression

DEAD_RANGE_S = (-0.03, 0.6)
LAG_RANGE_S = (0.0, 1.5)
FILTER_ORDER = 3
"""Of the whitening filter: white measurement noise and a slow disturbance together need more than one."""

_GRID_DEAD_S = np.arange(-0.02, 0.6, 0.02)
_GRID_LAG_S = (0.0, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2)
_ROUNDS = 3
_LEAST_STEP_S = 2e-3
_LARGEST_STEP_S = 20e-3
_HUBER = 2.5
_MEDIAN_OF_NORMAL = 0.6745  # of the absolute value, in standard deviations


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
    _last: list[tuple[float, LaggedCommand]] = field(default_factory=list)

    @property
    def command_sd(self) -> float:
        """Standard deviation of the command in force about its mean in each window."""
        held = LaggedCommand(self.command_times_s, self.command, 0.0).at(self.windows.times_s)
        return float(np.std(Projection(Windows(self.windows.times_s, self.windows.index, 0))(held)))

    def response(self, dead_s: float, lag_s: float) -> Array:
        """The model at gain 1, shape (n,)."""
        lagged, times_s = self._lagged(lag_s), self.windows.times_s - dead_s
        return lagged.integral(times_s) if self.integrating else lagged.at(times_s)

    def _lagged(self, lag_s: float) -> LaggedCommand:
        """The coarse search asks for one lag at many dead times."""
        if self._last and self._last[0][0] == lag_s:
            return self._last[0][1]
        lagged = LaggedCommand(self.command_times_s, self.command, lag_s)
        self._last[:] = [(lag_s, lagged)]
        return lagged

    @cached_property
    def integrated_answer(self) -> Array:
        """The answer's integral, by trapezoids, shape (n,)."""
        steps_s = np.diff(self.windows.times_s)
        means = (self.answer[1:] + self.answer[:-1]) / 2.0
        return np.concatenate(([0.0], np.cumsum(steps_s * means)))


@dataclass(frozen=True, slots=True)
class Solution:
    """One point of the search with its linear coefficients: gain, and for an integrating answer damping (1/s)."""

    dead_s: float
    lag_s: float
    linear: Array

    @property
    def on_edge(self) -> str:
        """Which end of the range searched it is at; "" inside. A lag of 0 is a value like any other."""
        if not DEAD_RANGE_S[0] + 1e-3 < self.dead_s < DEAD_RANGE_S[1] - 1e-3:
            return f"dead time {self.dead_s * 1e3:.0f} ms"
        return f"lag {self.lag_s * 1e3:.0f} ms" if self.lag_s > LAG_RANGE_S[1] - 1e-3 else ""


class View:
    """A problem seen through a whitening filter and a weight for each row; its columns have k <= n rows."""

    def __init__(self, problem: Problem, filter_: Array = NO_FILTER, weights: Array | None = None) -> None:
        self.problem = problem
        self._seen = Projection(problem.windows, filter_, weights)
        self.index = self._seen.index
        self.answer = self._seen(problem.answer)
        self._damping = self._seen(-problem.integrated_answer) if problem.integrating else None

    def columns(self, dead_s: float, lag_s: float) -> Array:
        """What enters linearly, shape (k, 1 or 2)."""
        response = self._seen(self.problem.response(dead_s, lag_s))
        return np.stack([response] if self._damping is None else [response, self._damping], axis=1)

    def solution(self, dead_s: float, lag_s: float) -> Solution:
        """The best linear coefficients at one point."""
        columns = self.columns(dead_s, lag_s)
        return Solution(dead_s, lag_s, np.linalg.pinv(columns.T @ columns) @ (columns.T @ self.answer))

    def residual(self, solution: Solution) -> Array:
        """What the model leaves of the answer, shape (k,)."""
        return np.asarray(self.answer - self.columns(solution.dead_s, solution.lag_s) @ solution.linear)

    def misfit(self, dead_s: float, lag_s: float) -> float:
        """Sum of the squared residuals at the best linear coefficients."""
        left = self.residual(self.solution(dead_s, lag_s))
        return float(left @ left)


def solve(problem: Problem) -> tuple[Solution, View]:
    """Search the whole range coarsely, then refine, learning from the residuals, in turns, the noise's colour and what
    does not belong. Returns the solution and the view under which it is the best.
    """
    view = View(problem)
    grid = [(float(dead), lag) for lag in _GRID_LAG_S for dead in _GRID_DEAD_S]
    best = _refined(view, min(grid, key=lambda point: view.misfit(*point)))
    for _ in range(_ROUNDS):
        view = _learnt(problem, best)
        best = _refined(view, (best.dead_s, best.lag_s))
    return best, view


def _learnt(problem: Problem, solution: Solution) -> View:
    """The noise's filter, and Huber's weights: one up to `_HUBER` usual deviations, beyond it falling with the residual.

    So a moment in which the vehicle met a limit, a gust or the ground does not speak louder than the rest.
    """
    filter_ = autoregression(problem.windows, View(problem).residual(solution), FILTER_ORDER)
    left = np.abs(View(problem, filter_).residual(solution))
    limit = _HUBER * float(np.median(left)) / _MEDIAN_OF_NORMAL
    return View(problem, filter_, limit / np.maximum(left, max(limit, 1e-300)))


def _refined(view: View, start: tuple[float, float]) -> Solution:
    """Nelder and Mead's simplex: the misfit has kinks where a command's edge meets a sample."""
    dead_s, lag_s = start
    found = minimize(
        lambda point: view.misfit(float(point[0]), float(point[1])),
        start,
        method="Nelder-Mead",
        bounds=(DEAD_RANGE_S, LAG_RANGE_S),
        options={
            "initial_simplex": [(dead_s, lag_s), (dead_s + 0.01, lag_s), (dead_s, lag_s + 0.02)],
            "xatol": 3e-5,
            "fatol": float("inf"),
            "maxiter": 80,
        },
    )
    return view.solution(float(found.x[0]), float(found.x[1]))


def covariance(view: View, solution: Solution) -> Array:
    """Covariance of (dead, lag, gain[, damping]) from the curvature, shape (3, 3) or (4, 4).

    With J the derivative of the model: the plain s^2 (J'J)^-1, or the one that lets the residuals be correlated and
    unequal between windows, (J'J)^-1 (sum over windows of J_w' r_w r_w' J_w) (J'J)^-1 (Liang and Zeger 1986); of the two,
    the one with the larger variance of dead + lag.
    """
    gradient, left, windows = _gradient(view, solution), view.residual(solution), view.problem.windows
    bread = np.linalg.pinv(gradient.T @ gradient)
    freedom = max(len(left) - gradient.shape[1] - (windows.order + 1) * windows.count, 1)
    plain = bread * float(left @ left) / freedom
    scores = np.stack([np.bincount(view.index, column * left) for column in gradient.T], axis=1)
    clustered = bread @ scores.T @ scores @ bread * windows.count / max(windows.count - 1, 1)
    return np.asarray(max((plain, clustered), key=lambda matrix: float(matrix[:2, :2].sum())))


def _gradient(view: View, solution: Solution) -> Array:
    """Derivative of the model by (dead, lag, gain[, damping]), by differences, shape (k, 3 or 4).

    The differences span a whole spacing of the commands: within less, a staircase without a lag to smooth it is all jumps.
    """
    spacing_s = float(np.median(np.diff(view.problem.command_times_s)))
    step_s = min(max(spacing_s / 2.0, _LEAST_STEP_S), _LARGEST_STEP_S)
    dead_s, lag_s, gain = solution.dead_s, solution.lag_s, solution.linear[0]
    low_s, high_s = max(lag_s - step_s, 0.0), lag_s + step_s
    later, earlier = view.columns(dead_s + step_s, lag_s), view.columns(dead_s - step_s, lag_s)
    slower, quicker = view.columns(dead_s, high_s), view.columns(dead_s, low_s)
    by_dead = gain * (later - earlier)[:, 0] / (2.0 * step_s)
    by_lag = gain * (slower - quicker)[:, 0] / (high_s - low_s)
    return np.column_stack([by_dead, by_lag, view.columns(dead_s, lag_s)])
