"""Gains: where the eigenvalues are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.control.gains import chain_gains, continuous_observer_gains, observer_gain, polynomial_of_poles


def _companion(gammas: tuple[float, ...]) -> np.ndarray:
    r = len(gammas)
    a = np.diag(np.ones(r - 1), 1)
    a[-1] = [-g for g in gammas]
    return a


def _phi(n: int, h: float) -> np.ndarray:
    return np.array([[h ** (j - i) / math.factorial(j - i) if j >= i else 0.0 for j in range(n)] for i in range(n)])


def _closed(gain: tuple[float, ...], h: float) -> np.ndarray:
    """Phi (I - K C) in coordinates scaled by h^k, as the eigenvalues do not care and the computer does."""
    n = len(gain)
    scale = np.diag([h**k / math.factorial(k) for k in range(n)])
    c = np.eye(1, n)
    closed = _phi(n, h) @ (np.eye(n) - np.array(gain)[:, None] @ c)
    return scale @ closed @ np.linalg.inv(scale)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_binomial_and_butterworth_poles(order: int) -> None:
    binomial = np.poly(np.linalg.eigvals(_companion(chain_gains("binomial", order, 2.0))))
    assert binomial == pytest.approx(np.poly([-2.0] * order), rel=1e-6)
    poles = np.linalg.eigvals(_companion(chain_gains("butterworth", order, 3.0)))
    assert np.abs(poles) == pytest.approx(3.0, rel=1e-9)
    angles = sorted(np.angle(-poles))
    assert angles == pytest.approx([math.pi * (2 * k - order + 1) / (2 * order) for k in range(order)], abs=1e-9)


def test_butterworth_of_order_four_is_the_textbook_one() -> None:
    assert chain_gains("butterworth", 4, 1.0) == pytest.approx((1.0, 2.6131, 3.4142, 2.6131), abs=1e-4)


def test_given_poles_are_placed() -> None:
    wanted = ((-1.0, 0.5), (-1.0, -0.5), (-2.0, 0.0), (-0.5, 0.0))
    poles = np.linalg.eigvals(_companion(chain_gains("poles", 4, 2.0, wanted)))
    assert sorted(poles, key=lambda p: (p.real, p.imag)) == pytest.approx(
        sorted((2.0 * complex(*p) for p in wanted), key=lambda p: (p.real, p.imag)), abs=1e-9
    )


def test_poles_without_their_conjugates_are_refused() -> None:
    with pytest.raises(ValueError, match="conjugate"):
        polynomial_of_poles(((-1.0, 0.5), (-1.0, 0.0)))
    with pytest.raises(ValueError, match="wants 4 poles"):
        chain_gains("poles", 4, 1.0, ((-1.0, 0.0),))


def test_the_papers_matrix_has_the_eigenvalues_asked_for() -> None:
    moduli = (0.5, 1.0, 1.5, 2.0, 3.0)
    gains = continuous_observer_gains(moduli)
    a = np.diag(np.ones(4), 1)
    a[:, 0] = [-g for g in gains]
    assert sorted(np.linalg.eigvals(a).real) == pytest.approx(sorted(-m for m in moduli), abs=1e-9)


@settings(max_examples=200)
@given(
    dt_us=st.integers(min_value=1000, max_value=300_000),
    kappa=st.floats(min_value=1.0, max_value=40.0),
    moduli=st.lists(st.floats(min_value=0.3, max_value=3.0), min_size=2, max_size=6),
)
def test_observer_characteristic_polynomial(dt_us: int, kappa: float, moduli: list[float]) -> None:
    """The polynomial, not its roots: five equal roots are known to the fifth root of the rounding only."""
    h = dt_us * 1e-6
    gain = observer_gain(kappa, tuple(moduli), dt_us)
    wanted = np.poly([math.exp(-kappa * m * h) for m in moduli])
    for point in (0.0, 0.5, 1.3, -0.7):
        n = len(moduli)
        value = np.linalg.det(point * np.eye(n) - _closed(gain, h))
        assert value == pytest.approx(np.polyval(wanted, point), abs=1e-8)


def test_observer_gain_of_distinct_poles_places_each() -> None:
    moduli, h = (0.5, 0.8, 1.0, 1.6, 2.5), 0.01
    poles = np.linalg.eigvals(_closed(observer_gain(10.0, moduli, 10_000), h))
    assert sorted(poles.real) == pytest.approx(sorted(math.exp(-10.0 * m * h) for m in moduli), abs=1e-7)


def test_observer_gain_tends_to_the_papers_and_to_zero() -> None:
    moduli = (1.0, 1.2, 0.8, 1.0, 1.5)
    gain = observer_gain(5.0, moduli, 100)
    for k, a in enumerate(continuous_observer_gains(moduli)):
        assert gain[k] / 1e-4 == pytest.approx(5.0 ** (k + 1) * a, rel=3e-3)
    assert observer_gain(5.0, moduli, 0) == (0.0,) * 5


def test_a_long_gap_believes_the_measurement() -> None:
    gain = observer_gain(8.0, (1.0,) * 5, 10_000_000)
    assert gain[0] == pytest.approx(1.0)
    assert all(0.0 <= k < 10.0 for k in gain)
