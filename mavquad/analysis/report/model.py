"""What a report shows, before anybody thinks of a page: lines over time, bands of states, marks, paths, facts.

Times are seconds since the report's start (`start_us`, Unix us); arrays are numpy's, in the order of time. Lines that
share the very same array of times belong together: the page carries those times once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy
from numpy.typing import NDArray

Numbers = NDArray[numpy.float64]
Colour = Literal["x", "y", "z", "yaw", "ink", "blue", "muted"]
"""Named by the channel that they stand for everywhere; the page has their values for light and dark."""


@dataclass(frozen=True, slots=True)
class Line:
    """One quantity over time; `values[i]` at `times_s[i]`, NaN where there is none."""

    name: str
    times_s: Numbers
    values: Numbers
    colour: Colour
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """Lines over one vertical axis.

    Attributes:
        title: the quantity.
        unit: of all its lines.
        lines: from back to front.
        least_span: the axis shows at least this much, so that noise about zero looks as small as it is.
        tolerance: half the width of a band about zero, 0 for none.
        key: under which summaries and tests know it.
    """

    key: str
    title: str
    unit: str
    lines: tuple[Line, ...]
    least_span: float = 0.0
    tolerance: float = 0.0


@dataclass(frozen=True, slots=True)
class Span:
    """A state that lasted."""

    from_s: float
    to_s: float
    name: str


@dataclass(frozen=True, slots=True)
class Lane:
    """States one after the other: phases, modes, armed or not, one limit of the law."""

    name: str
    spans: tuple[Span, ...]
    alarming: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """Something said or done at one moment.

    Attributes:
        kind: phase, mode, vehicle, guard, operator, law, command: where it comes from.
        severity: MAV_SEVERITY, 0 (emergency) to 7 (debug); None where nobody gave one.
    """

    time_s: float
    kind: str
    text: str
    severity: int | None = None


@dataclass(frozen=True, slots=True)
class Track:
    """A path: `points_m[i]` = north, east, up (m) at `times_s[i]`."""

    name: str
    times_s: Numbers
    points_m: Numbers
    colour: Colour
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Report:
    """Everything that the page shows.

    Attributes:
        title: first line.
        subtitle: what it is of.
        start_us: Unix us at second 0.
        duration_s: how long the time axis is.
        view_s: (from, to) that the page opens with.
        facts: (name, value) shown large.
        summary: as `summary.json` has it.
        table: (name, value) of what the page's table shows of it.
        panels, lanes, marks, tracks: what is drawn.
        remarks: what a reader must know of the data (damage, gaps, what is missing).
        config_text: the configuration in force, "" if there is none.
    """

    title: str
    subtitle: str
    start_us: int
    duration_s: float
    view_s: tuple[float, float]
    facts: tuple[tuple[str, str], ...]
    summary: dict[str, Any]
    table: tuple[tuple[str, Any], ...] = ()
    panels: tuple[Panel, ...] = ()
    lanes: tuple[Lane, ...] = ()
    marks: tuple[Mark, ...] = ()
    tracks: tuple[Track, ...] = ()
    remarks: tuple[str, ...] = field(default=())
    config_text: str = ""
