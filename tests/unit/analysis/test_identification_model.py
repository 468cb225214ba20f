"""The lagged command against numerical integration, and at its borders."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mavquad.analysis.identification_model import LaggedCommand

TIMES_S = np.array([1.0, 1.01, 1.03, 1.03, 1.2, 1.9])
VALUES = np.array([0.5, -1.0, 2.0, 1.0, 0.0, 3.0])


def numerical(lag_s: float, at_s: float) -> tuple[float, float]:
    """State and integral from the first command on, by an adaptive solver that stops at each command."""
    state = np.array([VALUES[0], 0.0])
    bounds = np.append(TIMES_S, np.inf)
    for value, from_s, to_s in zip(VALUES, bounds, bounds[1:], strict=False):
        end_s = min(to_s, at_s)
        if end_s > from_s:
            solved = solve_ivp(
                lambda _, y, value=value: [(value - y[0]) / lag_s, y[0]], (from_s, end_s), state, rtol=1e-10, atol=1e-12
            )
            state = solved.y[:, -1]
    return float(state[0]), float(state[1])


@pytest.mark.parametrize("lag_s", [0.005, 0.06, 0.5])
@pytest.mark.parametrize("at_s", [1.0, 1.005, 1.02, 1.03, 1.11, 1.9, 2.5])
def test_it_is_the_solution_of_the_lag(lag_s: float, at_s: float) -> None:
    model = LaggedCommand(TIMES_S, VALUES, lag_s)
    state, integral = numerical(lag_s, at_s)
    assert model.at(np.array([at_s]))[0] == pytest.approx(state, abs=1e-7)
    assert model.integral(np.array([at_s]))[0] == pytest.approx(integral, abs=1e-7)


def test_without_a_lag_it_is_the_command() -> None:
    model = LaggedCommand(TIMES_S, VALUES, 0.0)
    assert model.at(np.array([1.005, 1.05, 1.5, 2.0])).tolist() == [0.5, 1.0, 0.0, 3.0]
    assert model.integral(np.array([1.2]))[0] == pytest.approx(0.5 * 0.01 - 1.0 * 0.02 + 1.0 * 0.17)


def test_before_the_first_command_it_is_settled_on_it() -> None:
    model = LaggedCommand(TIMES_S, VALUES, 0.1)
    assert model.at(np.array([-3.0, 0.99])).tolist() == [0.5, 0.5]
    assert model.integral(np.array([0.0]))[0] == pytest.approx(-0.5)
