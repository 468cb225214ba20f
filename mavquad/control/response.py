"""How late the autopilot's inner loop answers in roll and pitch, found in flight from the commands and their answers.

The answer to a command is modelled as N first-order lags L in a row and a mixture of their outputs,

    x_1 = u / (L s + 1),   x_k = x_(k-1) / (L s + 1),   y = sum b_k x_k,   sum b_k = 1

since an inner loop ends at what it was asked for. The commands are known exactly and the noise is all y's, so that b comes of
linear least squares; and with it the answer's mean delay, which is what a law much slower than that answer needs to know:

    T = sum k b_k L = L (N + d b),   d_k = k - N,   var T = L^2 var(noise) d (Z'Z)^-1 d,   Z's rows x_k - x_N, k < N

Both signals lose their slow part first: a trim, the wind's lean, a gyro's bias.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

TERMS = 5
LEAST_LAG_S = 0.01
SLOW_S = 0.5
"""What changes more slowly than this is left out."""
PART_US = 250_000
PARTS = 4
"""What is told is of the latest so many parts of time."""
LEAST_ANSWERS = 40
_COMING_MAX = 256
"""Commands on their way; the oldest go first where nothing is measured for long."""
GAP_US = 100_000
"""After a longer gap it begins anew."""
_QUICKEST = 0.1
PEAK_UP_TO = 1.6
"""The peak is looked for up to this frequency times the delay that is expected: a law much slower feels no other."""
_FREQUENCIES = np.linspace(0.1, 1.0, 10) * PEAK_UP_TO / 3.0
_GAINS = np.stack([(1.0 + 1j * _FREQUENCIES) ** -k for k in range(1, TERMS + 1)])
"""Of x_1 .. x_N, shape (N, 10); the frequencies are in units of 1 / L."""
_TO_LAST = np.arange(1.0, TERMS) - TERMS
_RIDGE = 1e-9
_NOTHING = 1e-12


class Late(NamedTuple):
    """What was found.

    Attributes:
        delay_s: how late the answer is.
        deviation_s: standard deviation of that.
        unexplained: share of the answer's variance that the commands leave unexplained.
        peak: greatest gain from command to answer.
        moved: root mean square of the motion that the commands explain, in the answer's unit.
    """

    delay_s: float
    deviation_s: float
    unexplained: float
    peak: float
    moved: float


class _Axis:
    """One command behind its lags, and one answer."""

    def __init__(self, answer: float) -> None:
        """It begins settled: what is measured was asked for."""
        self._command = 0.0
        self._slow_command = self._slow_answer = answer
        self._lags = (0.0,) * TERMS

    def take(self, command: float, share: float) -> None:
        """Another command is in force."""
        self._slow_command += share * (command - self._slow_command)
        self._command = command - self._slow_command

    def run(self, w0: float, w1: float, w2: float, w3: float, w4: float) -> None:
        """Let time t pass, exactly: x_k(t) = u + sum w_j (x_(k-j) - u), w_j = e^(-q) q^j / j!, q = t / L."""
        u = self._command
        a, b, c, d, e = self._lags
        a, b, c, d, e = a - u, b - u, c - u, d - u, e - u
        self._lags = (
            u + w0 * a,
            u + w0 * b + w1 * a,
            u + w0 * c + w1 * b + w2 * a,
            u + w0 * d + w1 * c + w2 * b + w3 * a,
            u + w0 * e + w1 * d + w2 * c + w3 * b + w4 * a,
        )

    def row(self, answer: float, share: float) -> tuple[float, ...]:
        """z_1 .. z_(N-1), y - x_N, and y."""
        self._slow_answer += share * (answer - self._slow_answer)
        a, b, c, d, last = self._lags
        y = answer - self._slow_answer
        return (a - last, b - last, c - last, d - last, y - last, y)


class _Part(NamedTuple):
    """Products of the rows of a part of time, summed; the last row and column are the answer's own."""

    products: npt.NDArray[np.float64]
    answers: int


class ResponseMeter:
    """Takes in commands and answers of roll and pitch; both count alike."""

    def __init__(self, expected_s: float) -> None:
        """Args: the delay that is expected, s; the lags are a third of it each."""
        self._lag_s = max(expected_s / 3.0, LEAST_LAG_S)
        self._coming: deque[tuple[int, float, float]] = deque(maxlen=_COMING_MAX)
        self._axes: tuple[_Axis, _Axis] | None = None
        self._now_us = self._taken_us = self._part_us = 0
        self._rows: list[tuple[float, ...]] = []
        self._parts: deque[_Part] = deque(maxlen=PARTS)

    def command(self, arrive_us: int, roll: float, pitch: float) -> None:
        """A command that acts from this moment on, until the next one does."""
        while self._coming and self._coming[-1][0] >= arrive_us:
            self._coming.pop()
        self._coming.append((arrive_us, roll, pitch))

    def answer(self, stamp_us: int, roll: float, pitch: float) -> Late | None:
        """What was measured; four times a second, how late the answer is as far as the latest second tells."""
        since_us = stamp_us - self._now_us
        if self._axes is None or since_us > GAP_US:
            self._begin(stamp_us, roll, pitch)
            return None
        if since_us <= 0:
            return None
        self._advance(stamp_us)
        share = since_us / (SLOW_S * 1e6)
        one, other = self._axes
        self._rows.append(one.row(roll, share))
        self._rows.append(other.row(pitch, share))
        return self._told(stamp_us) if stamp_us - self._part_us >= PART_US else None

    def _begin(self, stamp_us: int, roll: float, pitch: float) -> None:
        """From the first command on; what is in force then is taken as new."""
        if not self._coming:
            return
        self._axes = (_Axis(roll), _Axis(pitch))
        self._now_us = self._part_us = self._taken_us = stamp_us
        self._rows.clear()
        self._parts.clear()

    def _advance(self, stamp_us: int) -> None:
        assert self._axes is not None
        one, other = self._axes
        while self._coming and self._coming[0][0] <= stamp_us:
            arrive_us, roll, pitch = self._coming.popleft()
            self._pass(arrive_us)
            share = min(max(arrive_us - self._taken_us, 0) / (SLOW_S * 1e6), _QUICKEST)
            self._taken_us = arrive_us
            one.take(roll, share)
            other.take(pitch, share)
        self._pass(stamp_us)

    def _pass(self, stamp_us: int) -> None:
        if stamp_us <= self._now_us or self._axes is None:
            return
        q = (stamp_us - self._now_us) * 1e-6 / self._lag_s
        self._now_us = stamp_us
        w0 = math.exp(-q)
        w1 = w0 * q
        w2 = w1 * q / 2.0
        w3 = w2 * q / 3.0
        for axis in self._axes:
            axis.run(w0, w1, w2, w3, w3 * q / 4.0)

    def _told(self, stamp_us: int) -> Late | None:
        rows = np.array(self._rows)
        self._part_us = stamp_us
        self._rows.clear()
        self._parts.append(_Part(rows.T @ rows, len(rows)))
        count = sum(part.answers for part in self._parts)
        if len(self._parts) < PARTS - 1 or count < LEAST_ANSWERS:
            return None
        return self._solved(np.sum([part.products for part in self._parts], axis=0), count)

    def _solved(self, sums: npt.NDArray[np.float64], count: int) -> Late | None:
        zz, zf, ff, yy = sums[:-2, :-2], sums[:-2, -2], float(sums[-2, -2]), float(sums[-1, -1])
        if not np.trace(zz) > _NOTHING or not yy > _NOTHING:
            return None
        zz = zz + _RIDGE * np.trace(zz) * np.eye(TERMS - 1)
        b, to_last = np.linalg.solve(zz, np.stack([zf, _TO_LAST], axis=1)).T
        left = max(ff - float(b @ zf), 0.0)
        deviation_s = self._lag_s * math.sqrt(left / count * max(float(_TO_LAST @ to_last), 0.0))
        answer = np.append(b, 1.0 - b.sum()) @ _GAINS
        delay_s = self._lag_s * (TERMS + float(_TO_LAST @ b))
        moved = math.sqrt(max(yy - left, 0.0) / count)
        return Late(delay_s, deviation_s, left / yy, float(np.abs(answer).max()), moved)
