"""Largest stable omega0 of three discrete forms of the extended observer: `python tests/bench/observer_boundaries.py`.

One chain of length 4, binomial gains, all moduli 1, no lag, no delay, input held between samples. The closed loop of plant
and law is linear and periodic; a form is stable when the spectral radius over one period is below one.

    held       (8) integrated exactly over the period, with the measurement held constant through it
    euler      (8) by one forward Euler step
    discrete   predict-correct, as flown
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.linalg import expm

from mavquad.control.gains import chain_gains, continuous_observer_gains, observer_gain

LENGTH = 4
RATES_HZ = (50, 100, 250)
RATIOS = (5, 10, 20)
LARGEST = 12.0
Array = np.ndarray


def chain(length: int) -> tuple[Array, Array]:
    """A and B of the chain with sigma."""
    a = np.diag(np.ones(length), 1)
    b = np.zeros((length + 1, 1))
    b[length - 1] = 1.0
    return a, b


def zero_order_hold(a: Array, b: Array, h: float) -> tuple[Array, Array]:
    n, m = b.shape
    whole = expm(h * np.block([[a, b], [np.zeros((m, n + m))]]))
    return whole[:n, :n], whole[:n, n:]


def law_row(omega0: float) -> Array:
    """u = -(sigma + gamma zeta)."""
    return -np.array([[*chain_gains("binomial", LENGTH, omega0), 1.0]])


def continuous_gain(kappa: float) -> Array:
    gains = continuous_observer_gains((1.0,) * (LENGTH + 1))
    return np.array([[kappa ** (k + 1) * g] for k, g in enumerate(gains)])


def held(omega0: float, kappa: float, h: float) -> Array:
    a, b = chain(LENGTH)
    gain, c = continuous_gain(kappa), np.eye(1, LENGTH + 1)
    phi, gamma = zero_order_hold(a - gain @ c, np.hstack([b, gain]), h)
    return _assembled(omega0, h, phi + gamma[:, :1] @ law_row(omega0), gamma[:, 1:])


def euler(omega0: float, kappa: float, h: float) -> Array:
    a, b = chain(LENGTH)
    gain, c = continuous_gain(kappa), np.eye(1, LENGTH + 1)
    own = np.eye(LENGTH + 1) + h * (a - gain @ c + b @ law_row(omega0))
    return _assembled(omega0, h, own, h * gain)


def discrete(omega0: float, kappa: float, h: float) -> Array:
    """State: plant, and the estimate as predicted; the law acts on the corrected one."""
    a, b = chain(LENGTH)
    c = np.eye(1, LENGTH + 1)
    gain = np.array([observer_gain(kappa, (1.0,) * (LENGTH + 1), round(h * 1e6))]).T
    phi, gamma = zero_order_hold(a, b, h)
    step = phi + gamma @ law_row(omega0)
    plant_phi, plant_gamma = zero_order_hold(a[:LENGTH, :LENGTH], b[:LENGTH], h)
    corrected = np.hstack([gain @ np.eye(1, LENGTH), np.eye(LENGTH + 1) - gain @ c])
    top = np.hstack([plant_phi, np.zeros((LENGTH, LENGTH + 1))]) + plant_gamma @ law_row(omega0) @ corrected
    return np.vstack([top, step @ corrected])


def _assembled(omega0: float, h: float, own: Array, innovation: Array) -> Array:
    a, b = chain(LENGTH)
    phi, gamma = zero_order_hold(a[:LENGTH, :LENGTH], b[:LENGTH], h)
    return np.block([[phi, gamma @ law_row(omega0)], [innovation @ np.eye(1, LENGTH), own]])


FORMS: dict[str, Callable[[float, float, float], Array]] = {"held": held, "euler": euler, "discrete": discrete}


def largest_stable_omega0(form: str, rate_hz: float, ratio: float) -> float:
    """By steps of 1 %, from below: the first instability ends the search. At most LARGEST."""
    omega0 = 0.05
    while omega0 < LARGEST:
        closed = FORMS[form](omega0, ratio * omega0, 1.0 / rate_hz)
        scale = np.diag([omega0 ** (-k) for k in range(LENGTH)] + [omega0 ** (-k) for k in range(LENGTH + 1)])
        radius = max(abs(np.linalg.eigvals(scale @ closed @ np.linalg.inv(scale))))
        if not math.isfinite(radius) or radius >= 1.0:
            return omega0
        omega0 *= 1.01
    return LARGEST


def main() -> None:
    print("| rate | kappa/omega0 | held | forward Euler | discrete |\n|---|---|---|---|---|")
    for rate in RATES_HZ:
        for ratio in RATIOS:
            found = [largest_stable_omega0(form, rate, ratio) for form in FORMS]
            cells = [f"> {LARGEST:.0f}" if v >= LARGEST else f"{v:.2g}" for v in found]
            print(f"| {rate} Hz | {ratio} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
