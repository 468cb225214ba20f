"""Margins of one channel's loop, broken where the command enters the plant.

Over a beat with c commands the loop is a c by c transfer matrix L(z), the sensitivity S = (1 + L)^-1 from a disturbance of
the commands to the commands that the plant gets. At one command to the beat (all streams at one rate) these are the ordinary
scalars. Otherwise gain and phase margin are those of the eigenvalues of L (the factor k e^(i phi) on all commands at which
det(1 + k e^(i phi) L) = 0 on the unit circle), and the peak of S is that of its largest singular value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg

from mavquad.analysis.loop import Loop, Matrix, closed_loop
from mavquad.analysis.loop_spec import LoopSpec

Complex = npt.NDArray[Any]

STABLE_BELOW = 1.0 - 1e-9
"""A spectral radius this large or larger is not stable: rounding is far below it, no useful loop is that slow."""
DELAY_MAX_S = 0.3
"""A loop that bears more than this is not asked how much more."""

_FREQUENCIES = 320
_LOWEST = 0.03  # of omega0: the loop's gain is far above 1 there
_ASIDE = 1e-4
_NOTHING = 1e-9
_LEAST_GAIN = 1e-3  # a loop that bears this little bears any
_BRACKET = 0.03
_WIDER = 1.35
_RELATIVE = 0.01


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a loop is from instability. An unstable one has none: zeros, and an infinite peak.

    Attributes:
        eigenvalues: of the closed loop over one beat, largest modulus first.
        spectral_radius: largest modulus, for one tick.
        slowest_s: time constant of the slowest eigenvalue, s.
        echo: coefficient of a command on the one before it; towards -1 the commands alternate, which the margins, a matter
            of the plant, do not show.
        stable: whether it is less than 1.
        gain_low: least factor on the plant's input gain (torque scale, thrust scale) that it bears; 0: any.
        gain_high: greatest.
        phase_deg: phase margin, of both signs the smaller.
        crossover_rad_s: where that is.
        delay_from_phase_s: additional delay by the phase margins of all crossovers: phase / frequency.
        delay_s: additional true delay that makes the sampled closed loop unstable, found by bisection on its eigenvalues;
            at most `DELAY_MAX_S`.
        peak: Ms, the largest |S|.
        peak_rad_s: where that is.
    """

    eigenvalues: tuple[complex, ...]
    spectral_radius: float
    slowest_s: float
    echo: float
    stable: bool
    gain_low: float = 1.0
    gain_high: float = 1.0
    phase_deg: float = 0.0
    crossover_rad_s: float = 0.0
    delay_from_phase_s: float = 0.0
    delay_s: float = 0.0
    peak: float = math.inf
    peak_rad_s: float = 0.0


def margins(spec: LoopSpec, bisect: bool = True) -> Margins:
    """Margins of a channel, some milliseconds of work.

    Args:
        spec: the channel.
        bisect: find `delay_s` by bisection; otherwise it is `delay_from_phase_s`, and a fifth of the work.
    """
    loop = closed_loop(spec)
    beat_s = spec.beat.ticks * spec.beat.tick_us * 1e-6
    triangular = _triangular(loop)
    found = _of_eigenvalues(np.diagonal(triangular[0]), loop.echo, spec)
    if not found.stable:
        return found
    omega = _frequencies(spec, beat_s)
    sensitivity = _sensitivity(*triangular, np.exp(1j * omega * beat_s))
    peaks = np.linalg.norm(sensitivity, ord=2, axis=(1, 2))
    loci = np.linalg.eigvals(np.linalg.inv(sensitivity)) - 1.0
    here, there, low, high = _followed(loci, omega)
    gain_low, gain_high = _of_gain(here, there)
    found = replace(
        found,
        **_of_phase(here, there, low, high),
        gain_low=gain_low,
        gain_high=gain_high,
        peak=float(peaks.max()),
        peak_rad_s=float(omega[peaks.argmax()]),
    )
    guess_s = min(found.delay_from_phase_s, DELAY_MAX_S)
    return replace(found, delay_s=_delay_margin_s(spec, guess_s) if bisect else guess_s)


def spectral_radius(a: Matrix) -> float:
    """Largest modulus of the eigenvalues of a matrix."""
    return float(np.abs(np.linalg.eigvals(a)).max())


def is_stable(spec: LoopSpec, extra_delay_s: float = 0.0, gain: float = 1.0) -> bool:
    """Whether the loop is stable with more delay than the path says, and a plant with another input gain."""
    path = replace(spec.path, delay_s=spec.path.delay_s + extra_delay_s)
    return spectral_radius(closed_loop(replace(spec, path=path)).with_gain(gain)) < STABLE_BELOW


def _of_eigenvalues(eigenvalues: Complex, echo: float, spec: LoopSpec) -> Margins:
    ordered = sorted(eigenvalues.tolist(), key=abs, reverse=True)
    largest = abs(ordered[0])
    beat_s = spec.beat.ticks * spec.beat.tick_us * 1e-6
    stable = largest < STABLE_BELOW
    return Margins(
        eigenvalues=tuple(ordered),
        spectral_radius=largest ** (1.0 / spec.beat.ticks),
        slowest_s=-beat_s / math.log(largest) if stable else math.inf,
        echo=echo,
        stable=stable,
    )


# ---------------------------------------------------------------------- frequency response


def _triangular(loop: Loop) -> tuple[Complex, Complex, Complex, Complex]:
    """T, Q^H B, C Q and D of the sensitivity, with A = Q T Q^H and T triangular (the eigenvalues on its diagonal).

    Nothing is assumed of the eigenvectors: a chain of delays has too few of them.
    """
    n, count = len(loop.a), loop.b.shape[1]
    balanced, (scale, _) = scipy.linalg.matrix_balance(loop.a, permute=False, separate=True)
    triangle, unitary = scipy.linalg.schur(balanced, output="complex")
    into = unitary.conj().T @ (loop.b / scale[:, None])
    out = (loop.inputs[:, :n] * scale) @ unitary
    return triangle, into, out, np.eye(count) + loop.inputs[:, n : n + count]


def _sensitivity(triangle: Complex, into: Complex, out: Complex, direct: Complex, z: Complex) -> Complex:
    """S = 1 + D + C (z - A)^-1 B from q to input + q at each z, (f, c, c): all z at once, from the last row up."""
    n, count = into.shape
    # Element by element: a threaded library would spend more on its threads than these few numbers take.
    solved = np.repeat(into[:, :, None], len(z), axis=2)
    answer = np.zeros((count, count, len(z)), dtype=complex)
    for i in range(n - 1, -1, -1):
        solved[i] /= z - triangle[i, i]
        solved[:i] += triangle[:i, i, None, None] * solved[i]
        answer += out[:, i, None, None] * solved[i]
    sensitivity: Complex = direct + np.moveaxis(answer, 2, 0)
    return sensitivity


def _frequencies(spec: LoopSpec, beat_s: float) -> Matrix:
    """From well below the crossovers to half a turn of z per beat, and a little to either side of both ends.

    The response at -w is the conjugate of that at w: where a locus is real at an end, it crosses the real axis there.
    """
    lowest, half_turn = _LOWEST * spec.bandwidth_rad_s, math.pi / beat_s
    inside = np.geomspace(lowest, half_turn * (1.0 - _ASIDE), _FREQUENCIES)
    before = [-lowest] if spec.beat.ticks > 1 else []
    return np.concatenate([before, inside, [half_turn * (1.0 + _ASIDE)]])


def _followed(loci: Complex, omega: Matrix) -> tuple[Complex, Complex, Matrix, Matrix]:
    """The loci as short pieces, each from one frequency to the nearest eigenvalue at the next: ends and frequencies."""
    here, following = loci[:-1], loci[1:]
    nearest = np.abs(following[:, None, :] - here[:, :, None]).argmin(axis=2)
    there = np.take_along_axis(following, nearest, axis=1)
    low, high = (np.broadcast_to(part[:, None], here.shape).ravel() for part in (omega[:-1], omega[1:]))
    return here.ravel(), there.ravel(), low, high


def _of_phase(here: Complex, there: Complex, low: Matrix, high: Matrix) -> dict[str, Any]:
    """Where the loci cross the unit circle: phase margin, and the delay that turns a crossing onto -1."""
    gain_here, gain_there = (np.log(np.maximum(np.abs(ends), _NOTHING)) for ends in (here, there))
    crossing = ((gain_here > 0.0) != (gain_there > 0.0)) & (low > 0.0)
    if not crossing.any():
        return {"phase_deg": 180.0, "crossover_rad_s": 0.0, "delay_from_phase_s": DELAY_MAX_S}
    share = gain_here[crossing] / (gain_here[crossing] - gain_there[crossing])
    turned = np.angle(there[crossing] / here[crossing])
    # Of -L, so that zero is on -1.
    phase = np.angle(-here[crossing] * np.exp(1j * share * turned))
    frequency = low[crossing] + share * (high[crossing] - low[crossing])
    nearest = int(np.abs(phase).argmin())
    return {
        "phase_deg": math.degrees(abs(phase[nearest])),
        "crossover_rad_s": float(frequency[nearest]),
        "delay_from_phase_s": float(np.min(np.mod(phase, 2.0 * math.pi) / frequency)),
    }


def _of_gain(here: Complex, there: Complex) -> tuple[float, float]:
    """Where the loci cross the negative real axis: the factors next to 1 that move a crossing onto -1."""
    crossing = ((here.imag > 0.0) != (there.imag > 0.0)) & (np.minimum(here.real, there.real) < -_NOTHING)
    share = here[crossing].imag / (here[crossing].imag - there[crossing].imag)
    real = here[crossing].real + share * (there[crossing].real - here[crossing].real)
    factors = -1.0 / real[real < -_NOTHING]
    low = factors[(factors > _LEAST_GAIN) & (factors < 1.0)].max(initial=0.0)
    high = factors[factors > 1.0].min(initial=math.inf)
    return float(low), float(high)


def _delay_margin_s(spec: LoopSpec, guess_s: float) -> float:
    """Bisection between a stable and an unstable delay around the guess; what is stable at `DELAY_MAX_S` ends there."""
    low, high = guess_s * (1.0 - _BRACKET), guess_s * (1.0 + _BRACKET)
    while low > 1e-4 and not is_stable(spec, low):
        low, high = low / _WIDER, low
    while high < DELAY_MAX_S and is_stable(spec, high):
        low, high = high, high * _WIDER
    if high >= DELAY_MAX_S and is_stable(spec, DELAY_MAX_S):
        return DELAY_MAX_S
    while high - low > _RELATIVE * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_stable(spec, middle) else (low, middle)
    return 0.5 * (low + high)
