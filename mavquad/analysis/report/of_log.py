"""The report of a log that anybody wrote: its vehicle's path and states, and the observer in its shadow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy

from mavquad.analysis.law_shadow import LawShadow
from mavquad.analysis.report.model import Lane, Numbers, Panel, Report, Track
from mavquad.analysis.report.position import (
    POSITION_NAMES,
    Positions,
    altitude_panel,
    error_panel,
    positions,
    target_track,
    track,
    velocity_lines,
)
from mavquad.analysis.report.shadow_lines import has_law, law_panels, observer_panels, verdict_lanes
from mavquad.analysis.report.states import STATE_NAMES, lanes, marks
from mavquad.analysis.report.summary import moment, quantity
from mavquad.analysis.report.telemetry import Sender, Telemetry, telemetry
from mavquad.analysis.report.vehicle import VEHICLE_NAMES, attitude_panels, control_panels
from mavquad.analysis.shadow import Shadow, shadow
from mavquad.analysis.survey import SenderSurvey, Survey, survey_file
from mavquad.tlog import Selection, TlogContents, read_records

_MESSAGES = tuple(dict.fromkeys((*STATE_NAMES, *POSITION_NAMES, *VEHICLE_NAMES)))
LAW_POSITIONS = 30_000
"""With more than that in the part that is wanted, our law is not put beside it: that takes some 0.7 ms each."""
OBSERVER_POSITIONS = 300_000
"""The same of the observer, with 0.2 ms each; the log need not be held in memory then."""

_POSITIONS = ("LOCAL_POSITION_NED", "ODOMETRY", "GLOBAL_POSITION_INT")
_SITTING_S = 600.0
"""A longer silence parts one sitting from the next; the page opens with the one that has most in it."""
_MARGIN_S = 3.0


@dataclass(frozen=True, slots=True)
class LogData:
    """A log as it was read.

    Attributes:
        path: of the file.
        who: who is in it.
        vehicle: whom the report is of; None where nobody speaks.
        found: the tables that the page reads.
        observed: the observer over the vehicle's poses; None where they are too many.
        law: our law over its flights; None where nobody asked, or they are too many.
        begin_s: the log's first record, on the report's time axis.
    """

    path: Path
    who: Survey
    vehicle: SenderSurvey | None
    found: Telemetry
    observed: Shadow | None = None
    law: LawShadow | None = None
    begin_s: float = 0.0

    @property
    def positions(self) -> int:
        """How many messages with a position the vehicle sent."""
        return sum(map(self.vehicle.count, _POSITIONS)) if self.vehicle is not None else 0

    @property
    def sender(self) -> Sender:
        """Of the vehicle; (0, 0) where nobody speaks."""
        return self.vehicle.sender if self.vehicle is not None else (0, 0)


Lawyer = Callable[[TlogContents, SenderSurvey], LawShadow]
"""What puts a law beside the flights of one vehicle."""


def read_log(path: Path, selection: Selection | None = None, lawyer: Lawyer | None = None) -> LogData:
    """Read a log, or a part of it, for its report.

    Raises:
        LogError: it cannot be read, or is no log.
    """
    selection = selection or Selection()
    who = survey_file(path, selection)
    vehicle = who.main_vehicle()
    # Whoever commanded the vehicle may be of another system.
    found = telemetry(path, _MESSAGES, selection=replace(selection, system=None))
    data = LogData(path, who, vehicle, found)
    if vehicle is None or data.positions > OBSERVER_POSITIONS:
        return data
    contents = read_records(path).only(selection)
    begin_s = (contents[0].stamp_us - found.start_us) * 1e-6 if len(contents) and found.has_stamps else 0.0
    law = lawyer(contents, vehicle) if lawyer is not None and data.positions <= LAW_POSITIONS else None
    return replace(data, observed=shadow(contents, vehicle.sender), law=law, begin_s=begin_s)


@numpy.errstate(invalid="ignore", over="ignore")
def report_of_log(data: LogData) -> Report:
    """Everything that a log tells of the vehicle that it tells most of; a number that is none is no point of a line."""
    found, sender = data.found, data.sender
    duration_s = max(found.duration_s, 1e-3)
    places = positions(found, sender)
    wanted = target_track(found, sender)
    states = lanes(found, sender)
    verdicts = verdict_lanes(data.law, data.begin_s) if data.law is not None else ()
    return Report(
        title=data.path.name,
        subtitle=_subtitle(data.who, found, duration_s),
        start_us=found.start_us,
        duration_s=duration_s,
        view_s=_view(found, states, duration_s),
        facts=tuple(_facts(data, places)),
        summary=_summary(data),
        table=tuple(_table(data)),
        panels=tuple(_panels(data, places, wanted)),
        lanes=(*states, *verdicts),
        marks=tuple(sorted(marks(found, sender), key=lambda mark: mark.time_s)),
        tracks=tuple(candidate for candidate in (track(places) if places else None, wanted) if candidate),
        remarks=tuple(_remarks(data, places)),
    )


def _panels(data: LogData, places: Positions | None, wanted: Track | None) -> Iterator[Panel]:
    if places is not None:
        yield altitude_panel(places, wanted if places.source != "GLOBAL_POSITION_INT" else None)
        error = error_panel(places, wanted) if wanted is not None else None
        if error is not None:
            yield error
    logged = list(velocity_lines(places)) if places is not None else []
    if data.law is not None and has_law(data.law):
        yield from law_panels(data.law, data.begin_s, logged)
    else:
        yield from observer_panels(data.observed, data.begin_s, logged)
    yield from control_panels(data.found, data.sender)
    yield from attitude_panels(data.found, data.sender)


def _view(found: Telemetry, states: Sequence[Lane], duration_s: float) -> tuple[float, float]:
    """The sitting that most messages are of; of that the time from the first arming to the last, if it was armed."""
    low_s, high_s = _longest_sitting(found)
    armed = [span for lane in states if lane.name == "armed" for span in lane.spans]
    inside = [span for span in armed if span.from_s < high_s and span.to_s > low_s]
    if inside:
        low_s, high_s = max(low_s, inside[0].from_s), min(high_s, inside[-1].to_s)
    return (max(low_s - _MARGIN_S, 0.0), min(max(high_s, low_s + 1e-3) + _MARGIN_S, duration_s))


def _longest_sitting(found: Telemetry) -> tuple[float, float]:
    """From and to, s."""
    times_s = _all_times_s(found)
    if not len(times_s):
        return (0.0, found.duration_s)
    breaks = numpy.flatnonzero(numpy.diff(times_s) > _SITTING_S) + 1
    sittings = numpy.split(times_s, breaks)
    longest = max(sittings, key=len)
    return (float(longest[0]), float(longest[-1]))


def _all_times_s(found: Telemetry) -> Numbers:
    rows = [found.of(name, sender) for name, sender in found.log.tables]
    return numpy.sort(numpy.concatenate([some.times_s for some in rows if some is not None] or [numpy.empty(0)]))


# ---------------------------------------------------------------------- words


def _subtitle(who: Survey, found: Telemetry, duration_s: float) -> str:
    when = moment(found.start_us) if found.has_stamps else "no stamps: times by the vehicle's clock"
    senders = ", ".join(map(_name, who.senders[:5]))
    more = f" and {len(who.senders) - 5} more" if len(who.senders) > 5 else ""
    return f"{when} · {duration_s:.1f} s · {who.frames} frames of {senders}{more}"


def _name(sender: SenderSurvey) -> str:
    kind = sender.vehicle_type.removeprefix("MAV_TYPE_").replace("_", " ").lower()
    autopilot = sender.autopilot.removeprefix("MAV_AUTOPILOT_") if sender.is_vehicle else ""
    words = (autopilot.replace("ARDUPILOTMEGA", "ArduPilot"), kind)
    return f"{sender.sender[0]}/{sender.sender[1]} {' '.join(filter(None, words))}".strip()


def _facts(data: LogData, places: Positions | None) -> Iterator[tuple[str, str]]:
    who, vehicle, observed = data.who, data.vehicle, data.observed
    if vehicle is not None:
        yield "vehicle", _name(vehicle)
        armed_s = sum(span.to_s - span.from_s for span in vehicle.armed_spans)
        yield "armed", f"{len(vehicle.armed_spans)} × · {armed_s:.0f} s" if vehicle.armed_spans else "–"
    if places is not None:
        heights_m = places.points_m[:, 2]
        yield "climbed", quantity(float(numpy.nanmax(heights_m) - numpy.nanmin(heights_m)), 1.0, " m")
        yield "positions", _positions(places, observed)
    if observed is not None and None not in observed.velocity_rms_m_s:
        rms = observed.velocity_rms_m_s
        yield "observer's velocity, RMS N/W/U", " / ".join(quantity(value, 1.0, "", 2) for value in rms) + " m/s"
    yield "bad bytes", f"{who.bad_bytes} in {len(who.bad_ranges)}" if who.bad_bytes else "0"


def _positions(places: Positions, observed: Shadow | None) -> str:
    rate = observed.position_rate_hz if observed is not None else None
    return f"{places.source}{f', {rate:.3g} Hz' if rate else ''}"


def _summary(data: LogData) -> dict[str, Any]:
    observer = data.observed.to_json() if data.observed is not None else None
    return {**data.who.to_json(), "observer": observer, "law": data.law.to_json() if data.law is not None else None}


def _table(data: LogData) -> Iterator[tuple[str, Any]]:
    who, vehicle, observed = data.who, data.vehicle, data.observed
    yield "frames", who.frames
    yield "frames of unknown messages", who.unknown_frames
    yield "bad bytes", who.bad_bytes
    yield "bad places", len(who.bad_ranges)
    yield "stamps that step back", who.backward_stamps
    for sender in who.senders:
        yield f"frames of {_name(sender)}", sender.frames
    for name, value in (observed.to_json() if observed is not None else {}).items():
        if not isinstance(value, dict | list):
            yield f"observer: {name}", value
    for message in vehicle.messages if vehicle is not None else ():
        rate = f", {message.rate_hz:.3g} Hz" if message.rate_hz else ""
        yield message.name, f"{message.count}{rate}"


def _remarks(data: LogData, places: Positions | None) -> Iterator[str]:
    who, found, sender = data.who, data.found, data.sender
    if not found.has_stamps:
        yield "This log has no stamps; the time axis is the vehicle's own clock since its first message."
    if who.bad_bytes:
        yield f"{who.bad_bytes} bytes in {len(who.bad_ranges)} places are damaged; every whole frame around them was read."
    if who.backward_stamps:
        yield f"The stamps step back {who.backward_stamps} times; everything is shown in the order of the stamps."
    if data.positions > LAW_POSITIONS:
        yield (
            f"With {data.positions} positions this is too long for our law to be put beside it; "
            "--from and --to choose a part, flight:1 for instance."
        )
    if places is None:
        yield "The log has no usable position."
    if found.of("ATTITUDE", sender) is None and found.of("ATTITUDE_QUATERNION", sender) is None:
        yield "The log has no attitude."
