"""Lines of what ran in the shadow of somebody's flight: the observer over all of its poses, our law over its flights."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy

from mavquad.analysis.law_shadow import LawShadow, LawTrack
from mavquad.analysis.report.model import Colour, Lane, Line, Numbers, Panel, Span
from mavquad.analysis.shadow import Shadow

_AXES: tuple[tuple[str, Colour], ...] = (("north", "x"), ("west", "y"), ("up", "z"))
_TURNS: tuple[tuple[str, Colour], ...] = (("roll", "y"), ("pitch", "x"), ("yaw", "yaw"))
_FRD = (1.0, -1.0, -1.0)  # of a roll, pitch and yaw in FLU
_SETPOINTS = {"attitude": "attitude", "rate": "body rates", "torque": "angular acceleration"}
_UNITS = {"attitude": "° (FRD)", "rate": "°/s (FRD)", "torque": "°/s² (FRD)"}
_DEGREES = float(numpy.degrees(1.0))


def observer_panels(observed: Shadow | None, begin_s: float, logged: Sequence[Line]) -> Iterator[Panel]:
    """The observer's velocity and acceleration, knowing no input; and dashed the log's own velocity."""
    tracks = [track for track in observed.tracks if track.velocity_nwu_m_s] if observed is not None else []
    times_s = _joined([track.times_s for track in tracks]) + begin_s
    velocity = _lines(times_s, _joined([track.velocity_nwu_m_s for track in tracks]), _AXES) if tracks else []
    if velocity or logged:
        yield Panel("velocity", "Velocity", "m/s, as the observer sees it", (*velocity, *logged), 0.4)
    if tracks:
        acceleration = _joined([track.acceleration_nwu_m_s2 for track in tracks])
        yield Panel("sigma", "σ, all acceleration", "m/s²", tuple(_lines(times_s, acceleration, _AXES)), 1.0)


def law_panels(law: LawShadow, begin_s: float, logged: Sequence[Line]) -> Iterator[Panel]:
    """What our law would have made of the flights: its error, velocity, disturbance, and setpoints."""
    tracks = [phase.track for phase in law.phases if phase.track.times_s]
    times_s = _joined([track.times_s for track in tracks]) + begin_s

    def lines(of: Callable[[LawTrack], Sequence[Any]], factor: float = 1.0) -> list[Line]:
        return _lines(times_s, _joined([of(track) for track in tracks]) * factor, _AXES)

    place = _joined([track.position_nwu_m for track in tracks])
    away = place - _joined([track.reference_nwu_m for track in tracks])
    yield Panel("law_error", "Distance from the law's reference", "m", tuple(_lines(times_s, away, _AXES)), 0.4)
    velocity = lines(lambda track: track.velocity_nwu_m_s)
    yield Panel("velocity", "Velocity", "m/s, as the law sees it", (*velocity, *logged), 0.4)
    disturbance = tuple(lines(lambda track: track.disturbance_nwu_m_s2))
    yield Panel("sigma", "σ, the acceleration that is not the thrust's", "m/s²", disturbance, 1.0)
    depth = next(phase.depth for phase in law.phases)
    sent = _joined([_turns(track.setpoints) for track in tracks])
    moved = _joined([_turns(track.moved) for track in tracks])
    turns = (*_lines(times_s, sent, _TURNS), *_lines(times_s, moved, _TURNS, ", flown", dashed=True))
    yield Panel("law_setpoints", f"What the law would have sent: {_SETPOINTS[depth]}", _UNITS[depth], turns, 4.0)


def has_law(law: LawShadow | None) -> bool:
    """Whether the law ran over anything."""
    return law is not None and any(phase.track.times_s for phase in law.phases)


def verdict_lanes(law: LawShadow, begin_s: float) -> Iterator[Lane]:
    """Of each depth, whether these poses would have done for it, flight phase by flight phase."""
    depths = dict.fromkeys(verdict.depth for phase in law.phases for verdict in phase.verdicts)
    for depth in depths:
        spans = [
            Span(phase.phase.from_s + begin_s, phase.phase.to_s + begin_s, f"would do: {verdict.words}")
            for phase in law.phases
            for verdict in phase.verdicts
            if verdict.depth == depth
        ]
        yield Lane(f"law at {depth}", tuple(spans))


def _turns(setpoints: Sequence[Any]) -> Numbers:
    """Roll, pitch, yaw, or how they change, FRD, degrees."""
    return numpy.asarray([[sign * x for sign, x in zip(_FRD, values, strict=False)] for values in setpoints]) * _DEGREES


def _joined(parts: Sequence[Any]) -> Numbers:
    """The tracks one after the other; they are parted by gaps in time, which the page shows as such."""
    if not parts:
        return numpy.empty(0)
    return numpy.concatenate([numpy.asarray(part, dtype=numpy.float64) for part in parts])


def _lines(
    times_s: Numbers, vectors: Numbers, names: Sequence[tuple[str, Colour]], suffix: str = "", dashed: bool = False
) -> list[Line]:
    return [Line(name + suffix, times_s, vectors[:, i], colour, dashed) for i, (name, colour) in enumerate(names)]
