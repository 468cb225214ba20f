"""The extended observer (Kim, Pyrkin, Borisov, eq. (8)) in discrete predict-correct form, for a chain of any length.

    predict   the chain with its last estimate of sigma, driven by the input that really acted, exactly over the measured dt
    correct   estimate += K(dt) (measurement - predicted zeta_1), the innovation taken at the moment of the measurement

Integrating (8) between samples with the last measurement held instead diverges in the useful range of gains.
An estimate is (zeta_1, .., zeta_r, sigma) at the vehicle's own time stamp; the next measurement, whenever it comes, predicts
over the whole gap. A second measurement of the same stamp has dt = 0 and K = 0; an older one is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.actuation import Command, Interval, advance, interval
from mavquad.control.gains import observer_gain


@dataclass(frozen=True, slots=True)
class ObserverGains:
    """What the observer of one channel is tuned by."""

    kappa_rad_s: float
    moduli: tuple[float, ...]
    """r + 1 of them: the eigenvalues of the paper's A are the -moduli."""
    lag_s: float
    """Of the replica of the actuator; 0 for none."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """One channel at one moment."""

    stamp_us: int
    values: tuple[float, ...]
    """zeta_1 .. zeta_r, sigma."""
    lagged_input: float
    """What the replica of the actuator gives out at this moment."""


def predict(estimate: Estimate, channel: int, span: Interval) -> Estimate:
    """The estimate at the end of the interval, no measurement used."""
    values, lagged = advance(estimate.values, estimate.lagged_input, span, channel)
    return Estimate(estimate.stamp_us + span.duration_us, values, lagged)


def correct(gains: ObserverGains, predicted: Estimate, measured: float, dt_us: int) -> Estimate:
    """The estimate after a measurement of zeta_1; `dt_us` is the time since the correction before."""
    innovation = measured - predicted.values[0]
    gain = observer_gain(gains.kappa_rad_s, gains.moduli, dt_us)
    values = tuple([v + k * innovation for v, k in zip(predicted.values, gain, strict=True)])
    return Estimate(predicted.stamp_us, values, predicted.lagged_input)


def update(
    gains: ObserverGains,
    estimate: Estimate,
    channel: int,
    commands: tuple[Command, ...],
    stamp_us: int,
    measured: float,
) -> Estimate | None:
    """Predict to the stamp of the measurement and correct; None when the measurement is older than the estimate."""
    dt_us = stamp_us - estimate.stamp_us
    if dt_us < 0:
        return None
    span = interval(len(gains.moduli) - 1, gains.lag_s, commands, estimate.stamp_us, stamp_us)
    return correct(gains, predict(estimate, channel, span), measured, dt_us)
