"""What the measurements' noise becomes in steady state: of the output, of the command, of what goes to the vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mavquad.analysis.loop import Matrix, closed_loop
from mavquad.analysis.loop_spec import LoopSpec
from mavquad.analysis.margins import STABLE_BELOW, spectral_radius
from mavquad.control.model import GRAVITY_M_S2

_DOUBLINGS = 40


@dataclass(frozen=True, slots=True)
class NoiseGain:
    """RMS of what noise in the measurements does, in steady state.

    Attributes:
        output: of the plant's zeta_1: m, or rad for yaw.
        command: of w, m/s^r or rad/s^r.
        physical: of what goes to the vehicle: roll and pitch (w / g: rad, rad/s or rad/s^2 by depth), thrust per mass
            (m/s^2), yaw (rad/s or rad/s^2).
    """

    output: float
    command: float
    physical: float


def noise_gain(spec: LoopSpec) -> NoiseGain:
    """RMS of output, command and input, the mean over a beat.

    Raises:
        ValueError: the loop is not stable.
    """
    loop = closed_loop(spec)
    if spectral_radius(loop.a) >= STABLE_BELOW:
        raise ValueError("an unstable loop has no steady state")
    covariance = _steady(loop.a, loop.e @ loop.e.T)
    output, command, taken = (
        _rms(rows, covariance, loop.b.shape[1]) for rows in (loop.outputs, loop.commands, loop.inputs)
    )
    return NoiseGain(output, command, taken / GRAVITY_M_S2 if spec.kind == "horizontal" else taken)


def _steady(a: Matrix, q: Matrix) -> Matrix:
    """X = A X A^T + Q by doubling: the sum of A^k Q A^kT, twice as many terms with each step."""
    total, power = q, a
    for _ in range(_DOUBLINGS):
        more = power @ total @ power.T
        total = total + more
        if np.abs(more).max() <= 1e-13 * np.abs(total).max():
            break
        power = power @ power
    return total


def _rms(rows: Matrix, covariance: Matrix, disturbances: int) -> float:
    n = len(covariance)
    state, noise = rows[:, :n], rows[:, n + disturbances :]
    variances = np.einsum("ij,jk,ik->i", state, covariance, state) + np.sum(noise * noise, axis=1)
    return math.sqrt(float(np.mean(variances)))
