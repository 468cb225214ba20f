"""Windows of a recording, and linear regression within them.

Each window has an offset (and, where asked for, a slope) of its own: trim, wind and drift are slow beside an inner
loop. They are projected out of every column, which leaves the same coefficients as fitting them would (Frisch, Waugh
and Lovell). Columns can be whitened first: the noise that feedback carries into the commands is coloured, and an
autoregressive filter that whitens the residuals makes the direct fit in a closed loop nearly unbiased (Ljung 1999,
System Identification, section 13.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mavquad.analysis.identification_model import Array

Span = tuple[float, float]
"""From, to, s."""
NO_FILTER: Array = np.zeros(0)
_TINY = 1e-12


@dataclass(frozen=True, slots=True)
class Windows:
    """Samples sorted into windows.

    Attributes:
        times_s: of the samples used, s, shape (n,).
        index: which window each is in, 0, 1, ..., not decreasing, shape (n,).
        order: of the polynomial that each window has for itself: 0 an offset, 1 an offset and a slope.
    """

    times_s: Array
    index: npt.NDArray[np.intp]
    order: int

    @property
    def count(self) -> int:
        """How many windows there are."""
        return int(self.index[-1]) + 1 if len(self.index) else 0


class Projection:
    """Columns whitened, weighted, and without what each window's own polynomial explains of them."""

    def __init__(self, windows: Windows, filter_: Array = NO_FILTER, weights: Array | None = None) -> None:
        """Prepare.

        Args:
            windows: of the n samples of a column.
            filter_: coefficients of the whitening filter: column[k] - sum_j filter[j] column[k - 1 - j] for each k with
                enough samples before it in its window, which leaves k <= n rows; see `index`.
            weights: of each row that is left in least squares; None: all 1.
        """
        self._filter = filter_
        order = len(filter_)
        self._complete = windows.index[order:] == windows.index[: len(windows.index) - order]
        self.index = windows.index[order:][self._complete]
        self._weights = np.ones(len(self.index)) if weights is None else weights
        self._totals = np.maximum(np.bincount(self.index, self._weights), _TINY)
        self._roots = np.sqrt(self._weights)
        self._slope = self._centred(self._whitened(windows.times_s)) if windows.order else None

    def __call__(self, column: Array) -> Array:
        """The column, of n values, as k rows; to be used in ordinary least squares."""
        result = self._centred(self._whitened(column))
        slope = self._slope
        if slope is not None:
            share = np.bincount(self.index, self._weights * slope * result) / self._squares(slope)
            result = result - share[self.index] * slope
        return np.asarray(result * self._roots)

    def _squares(self, slope: Array) -> Array:
        return np.maximum(np.bincount(self.index, self._weights * slope * slope), _TINY)

    def _whitened(self, column: Array) -> Array:
        order, count = len(self._filter), len(column)
        result = column[order:].copy()
        for j, weight in enumerate(self._filter.tolist()):
            result -= weight * column[order - 1 - j : count - 1 - j]
        return np.asarray(result[self._complete])

    def _centred(self, column: Array) -> Array:
        mean = np.bincount(self.index, self._weights * column) / self._totals
        return np.asarray(column - mean[self.index])


def cut(
    times_s: Array, spans: Sequence[Span], window_s: float, gap_s: float, least: int, order: int
) -> tuple[Windows, npt.NDArray[np.intp]]:
    """Cut the spans into windows of about `window_s`; a gap in the samples ends a window too.

    Args:
        times_s: of all samples, s, increasing, shape (n,).
        spans: from, to, s: what may be used.
        window_s: length wanted; a span becomes the whole number of windows nearest to it.
        gap_s: longest step between two samples of a window.
        least: a window with fewer samples is dropped.
        order: see `Windows`.

    Returns:
        The windows, and the indices into `times_s` of the samples that are in one.
    """
    kept: list[npt.NDArray[np.intp]] = []
    for from_s, to_s in spans:
        inside = np.flatnonzero((times_s >= from_s) & (times_s <= to_s))
        for run in np.split(inside, np.flatnonzero(np.diff(times_s[inside]) > gap_s) + 1):
            kept += _equal_parts(times_s, run, window_s)
    kept = [part for part in kept if len(part) >= least]
    index = np.repeat(np.arange(len(kept)), [len(part) for part in kept])
    used = np.concatenate(kept) if kept else np.array([], dtype=np.intp)
    return Windows(times_s[used], index, order), used


def _equal_parts(times_s: Array, run: npt.NDArray[np.intp], window_s: float) -> list[npt.NDArray[np.intp]]:
    if len(run) < 2:
        return []
    from_s, to_s = times_s[run[0]], times_s[run[-1]]
    parts = max(1, round((to_s - from_s) / window_s))
    bounds = np.searchsorted(times_s[run], np.linspace(from_s, to_s, parts + 1)[1:-1])
    return np.split(run, bounds)


def autoregression(windows: Windows, residual: Array, order: int) -> Array:
    """Coefficients of the filter of this order that predicts a residual from its past within each window."""
    complete = windows.index[order:] == windows.index[: len(residual) - order]
    past = [residual[order - 1 - j : len(residual) - 1 - j][complete] for j in range(order)]
    return np.asarray(np.linalg.lstsq(np.stack(past, axis=1), residual[order:][complete], rcond=None)[0])
