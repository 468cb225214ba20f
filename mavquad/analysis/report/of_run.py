"""The report of one of our own flights, from its run folder."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from typing import Any

import numpy

from mavquad import __version__
from mavquad.analysis.metrics import error_samples, flight_metrics
from mavquad.analysis.report.law import Trace, law_panels, law_tracks, limit_lanes
from mavquad.analysis.report.model import Lane, Mark, Panel, Report, Span, Track
from mavquad.analysis.report.position import POSITION_NAMES, Positions, altitude_panel, positions, track, velocity_lines
from mavquad.analysis.report.run_data import RunData
from mavquad.analysis.report.states import STATE_NAMES, lanes, marks
from mavquad.analysis.report.summary import flattened, moment, quantity
from mavquad.analysis.report.vehicle import VEHICLE_NAMES, attitude_panels
from mavquad.analysis.survey import Sender

MESSAGES = tuple(dict.fromkeys((*STATE_NAMES, *POSITION_NAMES, *VEHICLE_NAMES)))
"""What the page reads of flight.tlog."""

_FLYING = ("flying",)
_OWN_NOTES = ("phase", "mode", "vehicle")
"""Kinds of notes that stand elsewhere: in the lanes, and among the texts as the vehicle sent them."""


@numpy.errstate(invalid="ignore", over="ignore")
def report_of_run(run: RunData) -> Report:
    """Everything that a run folder tells."""
    trace = Trace.of(run.rows, run.start_us) if run.rows else None
    vehicle = _vehicle(run)
    places = positions(run.log, vehicle) if run.log is not None and vehicle is not None else None
    found_lanes = [*_phases(run), *_vehicle_lanes(run, vehicle)]
    if trace is not None:
        found_lanes += limit_lanes(run.rows, trace.times_s)
    duration_s = max(_duration_s(run, trace), 1e-3)
    summary = run.summary if run.summary is not None else cut_off_summary(run)
    return Report(
        title=_title(run, summary),
        subtitle=_subtitle(run, duration_s),
        start_us=run.start_us,
        duration_s=duration_s,
        view_s=(0.0, duration_s),
        facts=tuple(_facts(summary)),
        summary=summary,
        table=tuple(flattened(summary)),
        panels=tuple(_panels(run, trace, vehicle, places)),
        lanes=tuple(found_lanes),
        marks=tuple(sorted(_marks(run, vehicle), key=lambda mark: mark.time_s)),
        tracks=tuple(law_tracks(trace)) if trace is not None else _tracks(places),
        remarks=tuple(run.remarks),
        config_text=run.config_text,
    )


def cut_off_summary(run: RunData) -> dict[str, Any]:
    """What can be said of a flight that left no summary."""
    flown = [note.text for note in run.notes if note.kind == "phase"]
    metrics = flight_metrics(error_samples(run.rows, _FLYING))
    return {
        "completed": False,
        "outcome": f"the recording broke off{f' while {flown[-1]}' if flown else ''}: there is no summary of this flight",
        **metrics.to_json(),
        "depth": run.rows[0].depth if run.rows else None,
        "steps": len(run.rows),
        "mavquad": __version__,
    }


def _vehicle(run: RunData) -> Sender | None:
    """The autopilot that was flown: who sent most of attitudes, positions and heartbeats without being us."""
    if run.log is None:
        return None
    counts: dict[Sender, int] = {}
    for (name, sender), table in run.log.log.tables.items():
        if name in ("ATTITUDE", "LOCAL_POSITION_NED", "STATUSTEXT"):
            counts[sender] = counts.get(sender, 0) + len(table)
    return max(counts, key=lambda sender: counts[sender], default=None)


def _duration_s(run: RunData, trace: Trace | None) -> float:
    ends_s = [(note.stamp_us - run.start_us) * 1e-6 for note in run.notes[-1:]]
    if trace is not None:
        ends_s.append(float(trace.times_s[-1]))
    if run.log is not None:
        ends_s.append(run.log.duration_s)
    return max(ends_s)


def _phases(run: RunData) -> Iterator[Lane]:
    entered = [((note.stamp_us - run.start_us) * 1e-6, note.text) for note in run.notes if note.kind == "phase"]
    if entered:
        ends_s = [time_s for time_s, _ in entered[1:]] + [max(_duration_s(run, None), entered[-1][0])]
        spans = [Span(begun_s, end_s, name) for (begun_s, name), end_s in zip(entered, ends_s, strict=True)]
        yield Lane("phase", tuple(spans))


def _vehicle_lanes(run: RunData, vehicle: Sender | None) -> list[Lane]:
    return lanes(run.log, vehicle) if run.log is not None and vehicle is not None else []


def _marks(run: RunData, vehicle: Sender | None) -> Iterator[Mark]:
    """The story as the agent told it; the vehicle's texts with their severity, from the log where there is one."""
    has_log = run.log is not None and vehicle is not None
    for note in run.notes:
        if not (has_log and note.kind == "vehicle"):
            yield Mark((note.stamp_us - run.start_us) * 1e-6, note.kind, note.text)
    if run.log is not None and vehicle is not None:
        yield from marks(run.log, vehicle)


def _panels(run: RunData, trace: Trace | None, vehicle: Sender | None, places: Positions | None) -> Iterator[Panel]:
    logged = list(velocity_lines(places)) if places is not None else []
    if trace is not None:
        yield from law_panels(trace, logged)
    elif places is not None:
        yield altitude_panel(places, None)
        yield Panel("velocity", "Velocity", "m/s", tuple(logged), 0.4)
    if run.log is not None and vehicle is not None:
        yield from attitude_panels(run.log, vehicle)


def _tracks(places: Positions | None) -> tuple[Track, ...]:
    return () if places is None else (track(places),)


def _title(run: RunData, summary: dict[str, Any]) -> str:
    try:
        mission = tomllib.loads(run.config_text)["mission"]["name"]
    except (tomllib.TOMLDecodeError, KeyError, TypeError):
        mission = ""
    return " · ".join(map(str, filter(None, (mission, summary.get("vehicle"), summary.get("outcome")))))


def _subtitle(run: RunData, duration_s: float) -> str:
    law_s = (run.rows[-1].stamp_us - run.rows[0].stamp_us) * 1e-6 if run.rows else 0.0
    law = f"{law_s:.1f} s under the law, {len(run.rows)} steps" if run.rows else "the law was never in control"
    return f"{run.path.resolve().name} · {moment(run.start_us)} · {duration_s:.1f} s · {law}"


def _facts(summary: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """What is read first; whatever a damaged summary holds instead of a number is a dash."""

    def number(name: str) -> float | None:
        value = summary.get(name)
        return float(value) if isinstance(value, int | float) and math.isfinite(value) else None

    yield "position error, RMS", quantity(number("position_rms_m"), 100.0, " cm")
    yield "position error, largest", quantity(number("position_max_m"), 100.0, " cm")
    yield "yaw error, RMS", quantity(number("yaw_rms_rad"), math.degrees(1.0), "°")
    yield "within 5 cm and 3° after", quantity(number("settle_s"), 1.0, " s")
    if number("true_position_rms_m") is not None:
        yield "true error, RMS", quantity(number("true_position_rms_m"), 100.0, " cm")
    yield "depth", str(summary.get("depth") or "–")
