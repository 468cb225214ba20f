"""Gains of the law and of the observer, in closed form: no matrices, so that a replay finds the same bits anywhere.

Law: gamma_i are the coefficients of s^r + gamma_r s^(r-1) + ... + gamma_1, a Butterworth, a binomial (Newton) or a given
(modal) polynomial (Kim, Pyrkin, Borisov, after eq. (6)).

Observer: the chain with sigma has n = r + 1 states; with a measurement at the end of every interval h the error obeys
e+ = Phi(h) (I - K C) e. Its poles are put at p_i = exp(-kappa r_i h), where -r_i are the eigenvalues of the paper's A.
The chain is a polynomial in time. In the coordinates of its forward differences d_j over the interval (its coefficients on
the binomials C(t/h, j)), Phi becomes the identity plus a shift, and L = Phi K can be read off the polynomial in
delta = lambda - 1:

    prod_i (delta + 1 - p_i) = delta^n + L_1 delta^(n-1) + ... + L_n,      K = Phi^-1 L:  K_j = L_j - K_(j+1)

and Stirling's numbers of the first kind, C(t, j) = sum_m s(j, m) t^m / j!, lead back to derivatives:
gain of the m-th derivative = m! / h^m sum_j s(j, m) / j! K_(j+1). All of it is well conditioned for every h.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

Polynomial = Literal["binomial", "butterworth", "poles"]

_MICROSECOND_S = 1e-6


def chain_gains(
    polynomial: Polynomial, order: int, omega0_rad_s: float, poles: Sequence[tuple[float, float]] = ()
) -> tuple[float, ...]:
    """gamma_1 .. gamma_r of the law.

    Args:
        polynomial: which family.
        order: r, the length of the chain.
        omega0_rad_s: the scale; gamma_i goes with omega0^(r-i+1).
        poles: for "poles", r pairs (real, imaginary) in units of omega0, closed under conjugation.
    """
    if polynomial == "binomial":
        descending = [float(math.comb(order, k)) for k in range(order + 1)]
    elif polynomial == "butterworth":
        descending = _butterworth(order)
    else:
        if len(poles) != order:
            raise ValueError(f"a chain of length {order} wants {order} poles, not {len(poles)}")
        descending = polynomial_of_poles(poles)
    return tuple(descending[order - i] * omega0_rad_s ** (order - i) for i in range(order))


def polynomial_of_poles(poles: Sequence[tuple[float, float]]) -> list[float]:
    """Coefficients, highest power first, of the monic real polynomial with these poles (real, imaginary)."""
    coefficients = [1.0 + 0.0j]
    for real, imaginary in poles:
        shifted = [*coefficients, 0.0j]
        for k, c in enumerate(coefficients):
            shifted[k + 1] -= complex(real, imaginary) * c
        coefficients = shifted
    if any(abs(c.imag) > 1e-9 * (1.0 + abs(c)) for c in coefficients):
        raise ValueError("complex poles come in conjugate pairs")
    return [c.real for c in coefficients]


def continuous_observer_gains(moduli: Sequence[float]) -> tuple[float, ...]:
    """The paper's A_r, ..., A_1, A_0 (scalar, one channel): the eigenvalues of its A are the -moduli."""
    return tuple(_elementary_symmetric(moduli)[1:])


def observer_gain(kappa_rad_s: float, moduli: tuple[float, ...], dt_us: int) -> tuple[float, ...]:
    """K(dt) of the predict-correct observer for the states zeta_1 .. zeta_r, sigma; zero when dt is zero."""
    dt_s = dt_us * _MICROSECOND_S
    if dt_s <= 0.0:
        return (0.0,) * len(moduli)
    one_minus_poles = [-math.expm1(-kappa_rad_s * modulus * dt_s) for modulus in moduli]
    differences = _difference_gain(_elementary_symmetric(one_minus_poles)[1:])
    return tuple(
        math.factorial(m)
        / dt_s**m
        * math.fsum(_stirling(j, m) / math.factorial(j) * k for j, k in enumerate(differences))
        for m in range(len(moduli))
    )


def _difference_gain(predictor_gain: list[float]) -> list[float]:
    """K = Phi^-1 L where Phi is one plus the upward shift."""
    gain = predictor_gain.copy()
    for j in range(len(gain) - 2, -1, -1):
        gain[j] -= gain[j + 1]
    return gain


def _elementary_symmetric(values: Sequence[float]) -> list[float]:
    """1, sum of the values, sum of their pairs, ...: coefficients of prod (1 + v x)."""
    sums = [1.0] + [0.0] * len(values)
    for count, value in enumerate(values, start=1):
        for k in range(count, 0, -1):
            sums[k] += value * sums[k - 1]
    return sums


def _butterworth(order: int) -> list[float]:
    """Coefficients by the recursion a_(k+1) / a_k = cos(k pi / 2n) / sin((k+1) pi / 2n); they read the same backwards."""
    coefficients = [1.0]
    for k in range(order):
        angle = math.pi / (2 * order)
        coefficients.append(coefficients[-1] * math.cos(k * angle) / math.sin((k + 1) * angle))
    return coefficients


@lru_cache(maxsize=256)
def _stirling(j: int, m: int) -> int:
    """Signed Stirling number of the first kind: x (x-1) ... (x-j+1) = sum_m s(j, m) x^m."""
    if j == 0 or m == 0:
        return int(j == m)
    return _stirling(j - 1, m - 1) - (j - 1) * _stirling(j - 1, m)
