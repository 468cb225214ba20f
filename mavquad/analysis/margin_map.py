"""Margins over the plane of omega0 and kappa, all else as configured."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mavquad.analysis.gain_search import Gains, noise_share
from mavquad.analysis.loop import Matrix
from mavquad.analysis.loop_spec import Kind, loop_spec
from mavquad.analysis.margins import margins
from mavquad.control.params import LawParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

_COLUMNS, _ROWS = 22, 18
_RATIO_LEAST, _RATIO_MOST = 1.2, 24.0
_AROUND = 5.0


@dataclass(frozen=True, slots=True)
class MarginMap:
    """The worst of some channels at each pair of gains.

    Attributes:
        omega0_rad_s: (columns,).
        ratio: (rows,), kappa / omega0.
        peak: (rows, columns), Ms; infinite where the loop is unstable.
        delay_s: (rows, columns), delay margin; 0 where it is unstable.
        noise_share: (rows, columns), RMS of the input as a share of its saturation; infinite where it is unstable.
    """

    omega0_rad_s: Matrix
    ratio: Matrix
    peak: Matrix
    delay_s: Matrix
    noise_share: Matrix


def margin_map(
    law: LawParams, depth: Depth, streams: StreamParams, kinds: tuple[Kind, ...], around: list[Gains]
) -> MarginMap:
    """Margins of the worst of the channels over a plane that has the given gains well inside.

    Args:
        law: all but these gains.
        depth: of the command.
        streams: rates of the measurements.
        kinds: the channels, `gain_search.PLACE` or `TURN`.
        around: gains that must be on the map.
    """
    speeds = [gains.omega0_rad_s for gains in around]
    ratios = [gains.kappa_rad_s / gains.omega0_rad_s for gains in around]
    omega0 = np.geomspace(min(speeds) / _AROUND, min(max(speeds) * _AROUND, 50.0), _COLUMNS)
    ratio = np.geomspace(min(_RATIO_LEAST, min(ratios) / 1.2), max(_RATIO_MOST, max(ratios) * 1.2), _ROWS)
    worst = [[_worst(law, depth, streams, kinds, Gains(w, w * r)) for w in omega0.tolist()] for r in ratio.tolist()]
    layers = np.moveaxis(np.array(worst), 2, 0)
    return MarginMap(omega0, ratio, layers[0], layers[1], layers[2])


def _worst(
    law: LawParams, depth: Depth, streams: StreamParams, kinds: tuple[Kind, ...], gains: Gains
) -> tuple[float, float, float]:
    """Ms, delay margin, share of noise."""
    peak, delay_s, share = 0.0, math.inf, 0.0
    changed = gains.put_into(law, kinds)
    for kind in kinds:
        spec = loop_spec(changed, depth, kind, streams)
        found = margins(spec, bisect=False)
        peak, delay_s = max(peak, found.peak), min(delay_s, found.delay_s)
        share = max(share, noise_share(changed, depth, spec) if found.stable else math.inf)
    return peak, delay_s, share
