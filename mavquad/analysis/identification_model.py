"""A first-order lag behind a piecewise constant command, exactly.

    lag x' = u(t) - x,   u(t) = u_i from c_i on

so between two commands x(c_i + s) = u_i + (x_i - u_i) exp(-s / lag), and its integral over s is
u_i s + (x_i - u_i) lag (1 - exp(-s / lag)). It starts settled on the first command.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class LaggedCommand:
    """One command behind a lag; a dead time is an argument that is that much earlier."""

    def __init__(self, times_s: Array, values: Array, lag_s: float) -> None:
        """Run the lag over the commands.

        Args:
            times_s: when each command comes into force, s, not decreasing, shape (n,), n > 0.
            values: the commands, shape (n,), any unit.
            lag_s: time constant, s; 0 is no lag.
        """
        self._times_s, self._values, self._lag_s = times_s, values, lag_s
        spacings_s = np.diff(times_s)
        self._states = _states(values, _decay(spacings_s, lag_s))
        pieces = self._piece_integrals(np.arange(len(spacings_s)), spacings_s)
        self._integrals = np.concatenate(([0.0], np.cumsum(pieces)))

    def at(self, times_s: Array) -> Array:
        """The lagged command at each time, shape (m,); before the first command it is the first."""
        index, since_s = self._place(times_s)
        values = self._values[index]
        return np.asarray(values + (self._states[index] - values) * _decay(since_s, self._lag_s))

    def integral(self, times_s: Array) -> Array:
        """The lagged command's integral from the first command to each time, shape (m,), unit times s."""
        index, since_s = self._place(times_s)
        before_s = np.minimum(times_s - self._times_s[0], 0.0)
        return np.asarray(self._integrals[index] + self._piece_integrals(index, since_s) + self._values[0] * before_s)

    def _place(self, times_s: Array) -> tuple[npt.NDArray[np.intp], Array]:
        index = np.maximum(np.searchsorted(self._times_s, times_s, side="right") - 1, 0)
        return index, np.maximum(times_s - self._times_s[index], 0.0)

    def _piece_integrals(self, index: npt.NDArray[Any], since_s: Array) -> Array:
        values = self._values[index]
        forgotten_s = self._lag_s * (1.0 - _decay(since_s, self._lag_s))
        return np.asarray(values * since_s + (self._states[index] - values) * forgotten_s)


def _decay(since_s: Array, lag_s: float) -> Array:
    return np.exp(-since_s / lag_s) if lag_s > 0.0 else np.where(since_s > 0.0, 0.0, 1.0)


def _states(values: Array, decays: Array) -> Array:
    """The lag's state at each command's time; a recursion, quickest in plain floats."""
    state = float(values[0])
    states = [state]
    for value, decay in zip(values.tolist(), decays.tolist(), strict=False):
        state = value + (state - value) * decay
        states.append(state)
    return np.array(states)
