"""Whether poses at the rate of a log would do for the law: the margins of `tune` at that rate, and the guard on old poses.

The delay of the link is the configuration's: a log does not tell it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, median
from typing import Any

from mavquad.analysis.loop_spec import KINDS, loop_spec
from mavquad.analysis.margin_check import is_short
from mavquad.analysis.margins import Margins, margins
from mavquad.control.defaults import DEPTHS
from mavquad.control.params import LawParams
from mavquad.flight.guards import GuardParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

_SLOWER = (0.8, 0.65, 0.5, 0.4, 0.3, 0.2, 0.12)
"""Shares of the bandwidths that are tried where the whole leaves no margin."""
_RATE_DIGITS = 2
_GAP = 3.0
"""Times the median spacing: what is longer is a gap."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """Of one stream in one phase.

    Attributes:
        count: samples.
        rate_hz: one over the mean spacing, gaps left out; None for fewer than two samples.
        gaps_s: from each sample to the next, the longest first.
    """

    count: int
    rate_hz: float | None
    gaps_s: tuple[float, ...]

    def late(self, limit_s: float) -> int:
        """How many gaps are longer than this."""
        return sum(gap_s > limit_s for gap_s in self.gaps_s)


def spacing(stamps_us: Sequence[int]) -> Spacing:
    """The spacing of a stream."""
    gaps_s = [(later - earlier) * 1e-6 for earlier, later in pairwise(stamps_us)]
    if not gaps_s:
        return Spacing(len(stamps_us), None, ())
    usual_s = [gap_s for gap_s in gaps_s if gap_s <= _GAP * median(gaps_s)]
    return Spacing(len(stamps_us), 1.0 / fmean(usual_s), tuple(sorted(gaps_s, reverse=True)))


@dataclass(frozen=True, slots=True)
class Verdict:
    """Of one depth at one data rate.

    Attributes:
        depth: which.
        margins: whether the configured gains leave margin.
        omega0_rad_s: the bandwidth of z, x and y with which there is margin: the configured one, or the largest of the
            slower ones tried (kappa and the yaw's gains slowed alike); None where none does.
        least_delay_s: the least delay margin of the channels with the configured gains.
        peak: their largest Ms; None: unstable.
        late: gaps in which the guard on old poses would have ended its flight.
    """

    depth: Depth
    margins: bool
    omega0_rad_s: float | None
    least_delay_s: float
    peak: float | None
    late: int

    @property
    def would_do(self) -> bool:
        """Whether the law could have flown on this data as configured."""
        return self.margins and not self.late

    @property
    def words(self) -> str:
        """In short."""
        if self.would_do:
            return "yes"
        gaps = f"{self.late} late" if self.late else ""
        if self.margins:
            return f"no: {gaps}"
        slower = "no margin" if self.omega0_rad_s is None else f"omega0 {self.omega0_rad_s:.2g} at most"
        return f"no: {slower}{', ' + gaps if gaps else ''}"

    def to_json(self) -> dict[str, Any]:
        """For --json."""
        return {
            "would_do": self.would_do,
            "words": self.words,
            "margins": self.margins,
            "delay_margin_s": self.least_delay_s,
            "ms": self.peak,
            "omega0_rad_s": self.omega0_rad_s,
            "stale_gaps": self.late,
        }


class Judge:
    """Gives verdicts for one law; of data rates that are alike the work is done once."""

    def __init__(self, law: LawParams, guards: GuardParams) -> None:
        self._law = law.model_copy(update={"depth": "auto"}) if law.polynomial != "poles" else law
        self._known: dict[tuple[Depth, float, float], tuple[bool, float | None, float, float | None]] = {}
        self._guards = guards

    @property
    def depths(self) -> tuple[Depth, ...]:
        """Which can be judged: poles that are given are those of one depth."""
        return self._law.depths if self._law.polynomial == "poles" else DEPTHS

    def verdicts(self, positions: Spacing, attitudes: Spacing) -> tuple[Verdict, ...]:
        """Of every depth; none where one of the streams is missing."""
        if positions.rate_hz is None or attitudes.rate_hz is None:
            return ()
        rates = (_rounded(positions.rate_hz), _rounded(attitudes.rate_hz))
        return tuple(
            Verdict(depth, *self._judged(depth, *rates), self._late(depth, positions, attitudes))
            for depth in self.depths
        )

    def _late(self, depth: Depth, positions: Spacing, attitudes: Spacing) -> int:
        guards = self._guards
        attitude_s = guards.stale_attitude_at_torque_s if depth == "torque" else guards.stale_attitude_s
        return positions.late(guards.stale_position_s) + attitudes.late(attitude_s)

    def _judged(
        self, depth: Depth, position_hz: float, attitude_hz: float
    ) -> tuple[bool, float | None, float, float | None]:
        key = (depth, position_hz, attitude_hz)
        if key not in self._known:
            # What is too slow to be asked for in a configuration can still be judged.
            streams = StreamParams.model_construct(position_hz=position_hz, attitude_hz=attitude_hz)
            self._known[key] = self._worked_out(depth, streams)
        return self._known[key]

    def _worked_out(self, depth: Depth, streams: StreamParams) -> tuple[bool, float | None, float, float | None]:
        found = [margins(loop_spec(self._law, depth, kind, streams)) for kind in KINDS]
        keeps = not any(map(is_short, found))
        omega0 = _omega0(self._law, depth)
        if not keeps:
            omega0 = next((share * omega0 for share in _SLOWER if self._keeps(depth, streams, share)), math.nan)
        return (
            keeps,
            None if math.isnan(omega0) else omega0,
            min(one.delay_s for one in found),
            max(one.peak for one in found) if all(one.stable for one in found) else None,
        )

    def _keeps(self, depth: Depth, streams: StreamParams, share: float) -> bool:
        slower = _slowed(self._law, depth, share)
        return not any(is_short(self._quick(slower, depth, kind, streams)) for kind in KINDS)

    @staticmethod
    def _quick(law: LawParams, depth: Depth, kind: Any, streams: StreamParams) -> Margins:
        return margins(loop_spec(law, depth, kind, streams), bisect=False)


def _omega0(law: LawParams, depth: Depth) -> float:
    return law.omega0_rad_s or law.own(depth).omega0_rad_s


def _slowed(law: LawParams, depth: Depth, share: float) -> LawParams:
    """All bandwidths at a share of what they are, the observers' among them."""
    own = law.own(depth)
    omega0, yaw = _omega0(law, depth), law.yaw_omega0_rad_s or own.yaw_omega0_rad_s
    return law.model_copy(
        update={
            "omega0_rad_s": share * omega0,
            "kappa_rad_s": share * (law.kappa_rad_s or own.kappa_per_omega0 * omega0),
            "yaw_omega0_rad_s": share * yaw,
            "yaw_kappa_rad_s": share * (law.yaw_kappa_rad_s or own.yaw_kappa_per_omega0 * yaw),
            "velocity_kappa_rad_s": share * (law.velocity_kappa_rad_s or own.velocity_kappa_rad_s),
            "attitude_kappa_rad_s": share * (law.attitude_kappa_rad_s or own.attitude_kappa_rad_s),
            "rates_kappa_rad_s": share * (law.rates_kappa_rad_s or own.rates_kappa_rad_s),
        }
    )


def _rounded(rate_hz: float) -> float:
    """To two digits: 99.7 and 100.2 Hz are one rate."""
    return float(f"{rate_hz:.{_RATE_DIGITS}g}")
