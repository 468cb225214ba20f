"""The extended observer (Kim, Pyrkin, Borisov, eq. (8)) in discrete predict-correct form, for a chain of any length and
for more measured rows than the paper's one.

    zeta_1_d = zeta_2,  ...,  zeta_r_d = a + sigma,      a: the input behind a known delay and lag

With zeta_1 alone measured this is the paper's observer:

    predict   the chain with its last estimate of sigma, driven by the input that really acted, exactly over the measured dt
    correct   estimate += K(dt) (measurement - predicted zeta_1), the innovation taken at the moment of the measurement

Integrating (8) between samples with the last measurement held instead diverges in the useful range of gains.

A further row measures a later state of the chain but for an unknown offset: y_j = zeta_k - d_j (roll, pitch and thrust give
the acceleration but for the wind's part of it). The rows cut the chain into stretches. Each stretch, from its own row up to
the next, is a chain whose input is what the next row measures and whose disturbance is that row's offset: the same observer
again, order (stretch + 1), with a kappa of its own. The last stretch has the chain's input, and its disturbance is sigma. So
every row has one disturbance state, the error dynamics are block triangular, and the poles are those of the stretches:
pole placement per output. Each row corrects its stretch whenever it is measured, with the K of the time since it was last.

The state holds the derivatives of the output itself, so that what a row learns of the offset d of the next moves the
estimate of the state that the next one measures, and the prediction is that of the plain chain.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.actuation import Command, Interval, advance, interval
from mavquad.control.gains import observer_gain

_LATE_MAX_US = 100_000


@dataclass(frozen=True, slots=True)
class Row:
    """One measured row: which state it measures, and the poles of the stretch that begins there."""

    index: int
    """0 for zeta_1, the output itself."""
    kappa_rad_s: float
    moduli: tuple[float, ...]
    """One more than the stretch has states: its poles are -kappa times these."""


@dataclass(frozen=True, slots=True)
class ChainSpec:
    """A chain with its rows, the output's first."""

    length: int
    rows: tuple[Row, ...]
    lag_s: float = 0.0
    dead_us: int = 0


def moduli(order: int, spread: float) -> tuple[float, ...]:
    """`order` numbers in geometric progression around 1."""
    return tuple(spread ** (k - 0.5 * (order - 1)) for k in range(order))


def rows(length: int, kappas: dict[int, float], spread: float) -> tuple[Row, ...]:
    """The rows that measure the states of these indices, for a chain of this length."""
    starts = sorted(kappas)
    ends = [*starts[1:], length]
    return tuple(
        Row(start, kappas[start], moduli(end - start + 1, spread)) for start, end in zip(starts, ends, strict=True)
    )


class Chain:
    """The estimate of one channel.

    Attributes:
        spec: what it is a chain of.
        values: zeta_1 .. zeta_r and sigma.
        offsets: d of each row after the first, by row; entry 0 is not used.
        lagged: the input behind its lag.
    """

    __slots__ = ("_corrected_us", "lagged", "offsets", "spec", "values")

    def __init__(self, spec: ChainSpec, values: tuple[float, ...], stamp_us: int, lagged: float = 0.0) -> None:
        self.spec = spec
        self.values = list(values)
        self.offsets = [0.0] * len(spec.rows)
        self.lagged = lagged
        self._corrected_us = [stamp_us] * len(spec.rows)

    @property
    def sigma(self) -> float:
        """The disturbance beside the input."""
        return self.values[-1]

    def span(self, commands: tuple[Command, ...], from_us: int, to_us: int) -> Interval:
        """What the commands do between two moments; of use to every chain of the same kind."""
        spec = self.spec
        return interval(spec.length, spec.lag_s, commands, from_us - spec.dead_us, to_us - spec.dead_us)

    def predict(self, span: Interval, channel: int) -> None:
        """To the end of the interval."""
        self.values, self.lagged = advance(self.values, self.lagged, span, channel)

    def ahead(self, span: Interval, channel: int) -> list[float]:
        """zeta_1 .. zeta_r and sigma at the end of the interval; the estimate stays where it is."""
        return advance(self.values, self.lagged, span, channel)[0]

    def measured_before(self, row: int, stamp_us: int) -> bool:
        """Whether this row was measured at this moment or later."""
        return stamp_us <= self._corrected_us[row]

    def predicted(self, row: int, late_us: int = 0) -> float:
        """What the row should measure; `late_us` before the estimate's own moment."""
        index = self.spec.rows[row].index
        value = self.values[index] if late_us == 0 else self._back(index, late_us * 1e-6)
        return value - self.offsets[row] if row else value

    def correct(self, row: int, innovation: float, stamp_us: int) -> None:
        """Take in measured minus predicted of one row at `stamp_us`; nothing happens when that moment was seen before."""
        spec_row = self.spec.rows[row]
        gain = observer_gain(spec_row.kappa_rad_s, spec_row.moduli, max(0, stamp_us - self._corrected_us[row]))
        self._corrected_us[row] = max(stamp_us, self._corrected_us[row])
        values, index = self.values, spec_row.index
        for k in gain:
            values[index] += k * innovation
            index += 1
        if row + 1 < len(self.offsets):
            # The step of the next row's state is a step of its offset: what that row predicts stays as it was.
            self.offsets[row + 1] += gain[-1] * innovation

    def _back(self, index: int, late_s: float) -> float:
        """A state a little earlier, by the chain's own Taylor series."""
        total, factor = 0.0, 1.0
        for k, value in enumerate(self.values[index:-1]):
            total += factor * value
            factor *= -late_s / (k + 1)
        return total


def usable(stamp_us: int, estimate_us: int) -> bool:
    """Whether a measurement of another stream, older than the estimate, may still correct it."""
    return estimate_us - stamp_us <= _LATE_MAX_US
