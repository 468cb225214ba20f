"""The fastest gains that keep given margins: the largest omega0 for which some kappa keeps them all.

z, x and y share omega0 and kappa, and must keep the margins all; yaw has its own pair. The gains of further rows (velocity,
attitude, rates) stay as they are configured: they belong to those sensors' noise, not to the speed of the loop.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from mavquad.analysis.loop_spec import Kind, LoopSpec, loop_spec
from mavquad.analysis.margins import Margins, margins
from mavquad.analysis.noise_gain import noise_gain
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

PLACE: tuple[Kind, ...] = ("horizontal", "vertical")
TURN: tuple[Kind, ...] = ("yaw",)

KAPPA_RATIOS = (2.0, 2.5, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 13.0, 16.0, 20.0)
"""kappa / omega0 that are tried; a quicker observer than that is one of noise."""
SCANNED_RATIOS = (2.0, 4.0, 8.0, 16.0)
"""Those that are tried on the way to the largest omega0."""
OMEGA0_LEAST_RAD_S = 0.3
OMEGA0_MOST_RAD_S = 12.0

_COARSE, _FINE = 1.2, 1.02
_EASED = 0.95
_LATE_MOST_RAD = 3.0


@dataclass(frozen=True, slots=True)
class Limits:
    """What gains must keep.

    The law's loops are of high order, and the paper's own (position and yaw alone, depth torque) has a phase margin of 14
    to 20 degrees at any speed: the customary 30 would leave it without gains. Ms = 2.5 by itself promises 23 degrees and
    an input gain (torque scale, inertia) known to -28 % and +66 %.

    Attributes:
        phase_deg: least phase margin.
        delay_s: least additional delay.
        peak: greatest Ms.
        noise_share: greatest RMS of the input from the usual noise, as a share of the input's saturation level.
        echo: how much of a command may answer the one before it.
        approach_share: greatest input, as a share of that level, with which the law sets out from rest for its full speed
            of approach: a channel as weak as a quadcopter's yaw is not made quick by gains.
    """

    phase_deg: float = 20.0
    delay_s: float = 0.02
    peak: float = 2.5
    noise_share: float = 0.1
    echo: float = 0.7
    approach_share: float = 1.5


@dataclass(frozen=True, slots=True)
class Gains:
    """A pair of gains, rad/s."""

    omega0_rad_s: float
    kappa_rad_s: float

    def put_into(self, law: LawParams, kinds: Iterable[Kind]) -> LawParams:
        """The law with these gains for z, x and y, or for yaw."""
        prefix = "yaw_" if "yaw" in kinds else ""
        update = {f"{prefix}omega0_rad_s": self.omega0_rad_s, f"{prefix}kappa_rad_s": self.kappa_rad_s}
        return law.model_copy(update=update)


def gains_of(spec: LoopSpec) -> Gains:
    """The pair in force."""
    return Gains(spec.bandwidth_rad_s, spec.tune.spec.rows[0].kappa_rad_s)


def input_level(law: LawParams, depth: Depth, kind: Kind) -> float:
    """Where an input is saturated; at depth attitude, where none is, what the limits leave of it."""
    thrust, yaw, lean = tuning(law, depth).levels
    if kind == "yaw":
        return yaw
    if kind == "vertical":
        return thrust if math.isfinite(thrust) else (law.limits.thrust_max_g - 1.0) * GRAVITY_M_S2
    return lean if math.isfinite(lean) else math.radians(law.limits.tilt_max_deg)


def noise_share(law: LawParams, depth: Depth, spec: LoopSpec) -> float:
    """RMS of the input as a share of its level. Thrust and yaw are saturated before their integrators."""
    noise = noise_gain(spec)
    return (noise.physical if spec.kind == "horizontal" else noise.command) / input_level(law, depth, spec.kind)


def approach_share(law: LawParams, depth: Depth, spec: LoopSpec) -> float:
    """w = gamma_2 times the speed of approach, from rest, as a share of the input's level."""
    tune, gammas = tuning(law, depth), spec.tune.gammas
    limits = tune.limits
    speed = {"vertical": limits.climb_m_s, "horizontal": limits.speed_m_s, "yaw": limits.yaw_rate_rad_s}[spec.kind]
    w = speed * (gammas[1] if len(gammas) > 1 else 1.0)
    return (w / GRAVITY_M_S2 if spec.kind == "horizontal" else w) / input_level(law, depth, spec.kind)


def fastest_gains(
    law: LawParams, depth: Depth, streams: StreamParams, kinds: tuple[Kind, ...], limits: Limits
) -> Gains | None:
    """Gains within 5 % of the largest omega0 that keeps the limits, with the kappa that makes the least noise there; None
    if none keeps them. At the very largest only an extreme kappa would do.

    Args:
        law: everything but the gains that are looked for.
        depth: of the command.
        streams: rates of the measurements.
        kinds: `PLACE` or `TURN`.
        limits: what must be kept.
    """
    search = _Search(law, depth, streams, kinds, limits)
    omega0 = search.most_rad_s()
    while (kappa := search.best_kappa(omega0)) is None:
        omega0 /= _COARSE
        if omega0 < OMEGA0_LEAST_RAD_S:
            return None
    found = Gains(omega0, kappa)
    while (omega0 := omega0 * _FINE) <= search.most_rad_s() and (kappa := search.best_kappa(omega0)) is not None:
        found = Gains(omega0, kappa)
    eased = found.omega0_rad_s * _EASED
    kappa = search.best_kappa(eased, KAPPA_RATIOS)
    if kappa is not None:
        found = Gains(eased, kappa)
    return Gains(_rounded(found.omega0_rad_s), _rounded(found.kappa_rad_s))


@dataclass(frozen=True, slots=True)
class _Search:
    law: LawParams
    depth: Depth
    streams: StreamParams
    kinds: tuple[Kind, ...]
    limits: Limits

    def most_rad_s(self) -> float:
        """Where to begin: no loop is that much faster than its own delays."""
        late_s = 0.0
        for kind in self.kinds:
            path = loop_spec(self.law, self.depth, kind, self.streams).path
            late_s = max(late_s, path.delay_s + path.dead_time_s + path.lag_s)
        return min(OMEGA0_MOST_RAD_S, _LATE_MOST_RAD / max(late_s, 1e-3))

    def best_kappa(self, omega0: float, ratios: tuple[float, ...] = SCANNED_RATIOS) -> float | None:
        """The kappa that makes the least noise at this omega0; None where no one keeps the limits."""
        # Without an observer kappa is nothing.
        tried = [
            Gains(omega0, omega0 * ratio) for ratio in (ratios if self.law.form == "output_feedback" else ratios[:1])
        ]
        scored = [(score, gains.kappa_rad_s) for gains in tried if (score := self._score(gains)) is not None]
        return min(scored)[1] if scored else None

    def _score(self, gains: Gains) -> float | None:
        """The largest share of noise of the channels; None where a limit is broken."""
        law, limits = gains.put_into(self.law, self.kinds), self.limits
        share = 0.0
        for kind in self.kinds:
            spec = loop_spec(law, self.depth, kind, self.streams)
            if approach_share(law, self.depth, spec) > limits.approach_share:
                return None
            if (
                _broken(margins(spec, bisect=False), limits)
                or (noise := noise_share(law, self.depth, spec)) > limits.noise_share
            ):
                return None
            share = max(share, noise)
        return share


def _broken(found: Margins, limits: Limits) -> bool:
    return (
        found.phase_deg < limits.phase_deg
        or found.delay_s < limits.delay_s
        or found.peak > limits.peak
        or abs(found.echo) > limits.echo
    )


def _rounded(value: float) -> float:
    """To three digits, downwards for the last: 2.347 is 2.34."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return round(math.floor(value / step + 1e-9) * step, 6)
