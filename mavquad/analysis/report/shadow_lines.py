"""Lines of the observer that ran in the shadow of somebody's flight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy

from mavquad.analysis.report.model import Colour, Line, Numbers, Panel
from mavquad.analysis.shadow import Shadow
from mavquad.types import Vec3

_AXES: tuple[tuple[str, Colour], ...] = (("north", "x"), ("west", "y"), ("up", "z"))


def velocity_panel(observed: Shadow | None, begin_s: float, logged: Sequence[Line]) -> Panel | None:
    """The observer's velocity, and dashed the log's own."""
    seen = _lines(observed, begin_s, [t.velocity_nwu_m_s for t in observed.tracks] if observed else [])
    if not seen and not logged:
        return None
    return Panel("velocity", "Velocity", "m/s, as the observer sees it", (*seen, *logged), 0.4)


def sigma_panel(observed: Shadow | None, begin_s: float) -> Panel | None:
    """The acceleration that the observer sees: its sigma, knowing no input."""
    seen = _lines(observed, begin_s, [t.acceleration_nwu_m_s2 for t in observed.tracks] if observed else [])
    if not seen:
        return None
    return Panel("sigma", "σ, all acceleration", "m/s²", tuple(seen), 1.0)


def _lines(observed: Shadow | None, begin_s: float, by_track: Sequence[Sequence[Vec3]]) -> list[Line]:
    """The tracks one after the other; they are parted by gaps in time, which the page shows as such."""
    if observed is None or not any(len(values) for values in by_track):
        return []
    pairs = [(t.times_s, values) for t, values in zip(observed.tracks, by_track, strict=True) if len(values)]
    times_s: Numbers = numpy.concatenate([numpy.asarray(times) for times, _ in pairs]) + begin_s
    values: Numbers = numpy.concatenate([numpy.asarray(vectors) for _, vectors in pairs])
    order = numpy.argsort(times_s, kind="stable")
    times_s = times_s[order]
    return [Line(name, times_s, values[order, axis], colour) for axis, (name, colour) in enumerate(_AXES)]
