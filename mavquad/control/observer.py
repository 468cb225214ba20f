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
every row has a disturbance state of its own, the error dynamics are block triangular, and the poles are those of the
stretches: pole placement per output. Each row corrects its stretch whenever it is measured, with the K of the time since.

A disturbance may be more than a constant: with s slopes d is a polynomial of degree s, and its stretch has order
(stretch + 1 + s). That matters for wind: the law steers the derivatives of the output itself, and those of d are in them.

The state holds these derivatives. What a row learns of d moves the estimate of the states above it, but not what the rows
there predict, and the prediction is that of the plain chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from mavquad.control.actuation import Command, Interval, between, responses
from mavquad.control.chain_code import chain_code
from mavquad.control.gains import observer_gain

_LATE_MAX_US = 100_000
_KEPT = 4096


class Gains(dict[int, tuple[float, ...]]):
    """K of one row by the time since it was measured, us; kept, since stamps are regular."""

    def __init__(self, kappa_rad_s: float, moduli: tuple[float, ...]) -> None:
        super().__init__()
        self._kappa_rad_s, self._moduli = kappa_rad_s, moduli

    def __missing__(self, dt_us: int) -> tuple[float, ...]:
        if len(self) >= _KEPT:
            self.clear()
        found = self[dt_us] = observer_gain(self._kappa_rad_s, self._moduli, dt_us)
        return found


_gains = lru_cache(maxsize=64)(Gains)


@dataclass(frozen=True, slots=True)
class Row:
    """One measured row: which state it measures, and the poles of the stretch that begins there."""

    index: int
    """0 for zeta_1, the output itself."""
    kappa_rad_s: float
    moduli: tuple[float, ...]
    """Its poles are -kappa times these: one for each state of the stretch, and for each of the disturbance's."""

    @property
    def gains(self) -> Gains:
        """K(dt)."""
        return _gains(self.kappa_rad_s, self.moduli)


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


def rows(length: int, kappas: dict[int, float], spread: float, slopes: dict[int, int] | None = None) -> tuple[Row, ...]:
    """The rows that measure the states of these indices, for a chain of this length.

    Args:
        length: r.
        kappas: of each row, by the index of what it measures.
        spread: of the poles of each stretch.
        slopes: how many derivatives of a row's offset are estimated besides, by the row's index.
    """
    starts = sorted(kappas)
    ends = [*starts[1:], length]
    # The slopes of a row's offset are parts of the states above it: there are no more than those.
    orders = [1 + min((slopes or {}).get(end, 0), length - end) for end in ends]
    return tuple(
        Row(start, kappas[start], moduli(end - start + order, spread))
        for start, end, order in zip(starts, ends, orders, strict=True)
    )


class Chain:
    """The estimate of one channel.

    Attributes:
        spec: what it is a chain of.
        values: zeta_1 .. zeta_r and sigma.
        drifts: of each stretch but the last, its disturbance and the derivatives of it that are estimated.
        lagged: the input behind its lag.
        code: the arithmetic of its kind.
    """

    __slots__ = ("_corrected_us", "_gains", "_responses", "code", "drifts", "lagged", "spec", "values")

    def __init__(self, spec: ChainSpec, values: tuple[float, ...], stamp_us: int, lagged: float = 0.0) -> None:
        self.spec = spec
        self.values = list(values)
        self.drifts = [[0.0] * (len(row.moduli) - (after.index - row.index)) for row, after in pairwise(spec.rows)]
        self.lagged = lagged
        self._corrected_us = [stamp_us] * len(spec.rows)
        self._gains = [row.gains for row in spec.rows]
        self._responses = responses(spec.length, spec.lag_s)
        self.code = chain_code(spec.length, tuple((row.index, len(row.moduli)) for row in spec.rows))

    @property
    def sigma(self) -> float:
        """The disturbance beside the input."""
        return self.values[-1]

    def retune(self, spec: ChainSpec) -> None:
        """Other gains, lag and dead time for the same rows; the estimate stays."""
        self.spec = spec
        self._gains = [row.gains for row in spec.rows]
        self._responses = responses(spec.length, spec.lag_s)

    def span(self, commands: tuple[Command, ...], from_us: int, to_us: int) -> Interval:
        """What the commands do between two moments; of use to every chain of the same kind."""
        dead_us = self.spec.dead_us
        return between(self._responses, commands, from_us - dead_us, to_us - dead_us)

    def predict(self, span: Interval, channel: int) -> None:
        """To the end of the interval."""
        self.code.predict((self,), (channel,), span)

    def ahead(self, span: Interval, channel: int) -> list[float]:
        """zeta_1 .. zeta_r and sigma at the end of the interval; the estimate stays where it is."""
        return self.code.ahead((self,), (channel,), span)[0]

    def measured_before(self, row: int, stamp_us: int) -> bool:
        """Whether this row was measured at this moment or later."""
        return stamp_us <= self._corrected_us[row]

    def offset(self, row: int) -> float:
        """What of its state a row does not measure."""
        return self.code.rows[row].offset(self.drifts)

    def predicted(self, row: int, late_us: int = 0) -> float:
        """What the row should measure; `late_us` before the estimate's own moment."""
        index = self.spec.rows[row].index
        value = self.values[index]
        if late_us:
            value = _carried_on(tuple(self.values[index:-1]), -late_us * 1e-6)[0]
        return value - self.offset(row) if row else value

    def correct(self, row: int, innovation: float, stamp_us: int, late_us: int = 0) -> None:
        """Take in measured minus predicted of one row at `stamp_us`; nothing happens when that moment was seen before.

        `late_us` before the estimate's own moment: what would have been corrected then has gone on as a polynomial since.
        """
        dt_us = stamp_us - self._corrected_us[row]
        if dt_us <= 0:
            return
        self._corrected_us[row] = stamp_us
        gain = self._gains[row][dt_us]
        if late_us:
            gain = _carried_on(gain, late_us * 1e-6)
        self.code.rows[row].correct(self.values, self.drifts, gain, innovation)


class Together:
    """Chains that are measured together, with the same poles."""

    def __init__(self, *chains: Chain) -> None:
        self._chains = chains
        self._rows = chains[0].code.rows
        self._gains = [row.gains for row in chains[0].spec.rows]
        self._corrected_us = list(chains[0]._corrected_us)

    def retune(self) -> None:
        """The chains have other gains."""
        self._gains = [row.gains for row in self._chains[0].spec.rows]

    def take(self, row: int, measured: Sequence[float], stamp_us: int, late_us: int = 0) -> None:
        """Take in what one row measured of each; see `Chain.correct`."""
        dt_us = stamp_us - self._corrected_us[row]
        if dt_us <= 0:
            return
        self._corrected_us[row] = stamp_us
        gain = self._gains[row][dt_us]
        if not late_us:
            self._rows[row].take(self._chains, gain, measured)
            return
        gain = _carried_on(gain, late_us * 1e-6)
        for chain, value in zip(self._chains, measured, strict=True):
            self._rows[row].correct(chain.values, chain.drifts, gain, value - chain.predicted(row, late_us))


def _carried_on(derivatives: tuple[float, ...], ahead_s: float) -> tuple[float, ...]:
    """A polynomial's value and derivatives some time later, from those now."""
    later = list(derivatives)
    for i in range(len(later)):
        factor = 1.0
        for k, derivative in enumerate(derivatives[i + 1 :], start=1):
            factor *= ahead_s / k
            later[i] += factor * derivative
    return tuple(later)


def usable(stamp_us: int, estimate_us: int) -> bool:
    """Whether a measurement of another stream, older than the estimate, may still correct it."""
    return estimate_us - stamp_us <= _LATE_MAX_US
