"""Lines of what the law saw and did, from the rows of its trace."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy

from mavquad.analysis.metrics import SETTLED_POSITION_M, SETTLED_YAW_RAD
from mavquad.analysis.report.model import Colour, Lane, Line, Numbers, Panel, Span, Track
from mavquad.flight_record import TraceRow

Z, YAW, X, Y = range(4)
_PLACE: tuple[tuple[int, str, Colour], ...] = ((X, "north", "x"), (Y, "west", "y"), (Z, "up", "z"))
_POWERS = {1: "", 2: "²", 3: "³", 4: "⁴"}
_CONTROLS: dict[str, tuple[str, str, float]] = {
    "torque": ("Torques commanded", "normalised", 1.0),
    "rate": ("Body rates commanded", "°/s (FRD)", 180.0 / math.pi),
    "attitude": ("Attitude commanded", "° (FRD)", 180.0 / math.pi),
}
_DEGREES = 180.0 / math.pi


@dataclass(frozen=True, slots=True)
class Trace:
    """The rows of a trace as arrays over `times_s`; (n, 4) in the order z, yaw, x, y (NWU)."""

    times_s: Numbers
    measured: Numbers
    reference: Numbers
    rates: Numbers
    sigma: Numbers
    wind: Numbers
    controls: Numbers
    orders: tuple[int, int]
    depth: str

    @staticmethod
    def of(rows: Sequence[TraceRow], start_us: int) -> Trace:
        """Of at least one row. `rates` are the observer's estimates of the first derivatives, NaN where it has none."""
        return Trace(
            times_s=numpy.array([row.stamp_us - start_us for row in rows]) * 1e-6,
            measured=numpy.array([row.measured for row in rows]),
            reference=numpy.array([row.reference for row in rows]),
            rates=numpy.array([[c[1] if len(c) > 1 else math.nan for c in row.zeta_hat] for row in rows]),
            sigma=numpy.array([row.sigma for row in rows]),
            wind=numpy.array([row.wind for row in rows]),
            controls=numpy.array([row.controls for row in rows]),
            orders=(len(rows[0].zeta_hat[Z]), len(rows[0].zeta_hat[YAW])),
            depth=rows[0].depth,
        )


def law_panels(trace: Trace, logged_velocity: Sequence[Line]) -> Iterator[Panel]:
    """Altitude, errors, velocity, disturbance, commands, thrust."""
    t = trace.times_s
    error = trace.measured - trace.reference
    yaw_error = (error[:, YAW] + math.pi) % (2 * math.pi) - math.pi
    yield Panel(
        "altitude",
        "Altitude",
        "m",
        (
            Line("measured", t, trace.measured[:, Z], "z"),
            Line("reference", t, trace.reference[:, Z], "ink", dashed=True),
        ),
        least_span=1.0,
    )
    place = [Line(name, t, error[:, channel] * 100.0, colour) for channel, name, colour in _PLACE]
    yield Panel("error", "Position error", "cm", tuple(place), 14.0, SETTLED_POSITION_M * 100.0)
    heading = (Line("yaw", t, yaw_error * _DEGREES, "yaw"),)
    yield Panel("yaw_error", "Yaw error", "°", heading, 8.0, SETTLED_YAW_RAD * _DEGREES)
    seen = [Line(name, t, trace.rates[:, channel], colour) for channel, name, colour in _PLACE]
    seen = [line for line in seen if numpy.isfinite(line.values).any()]
    if seen or logged_velocity:
        yield Panel("velocity", "Velocity", "m/s, as the law sees it", (*seen, *logged_velocity), 0.4)
    yield from _disturbances(trace)
    yield from _commands(trace)


def _disturbances(trace: Trace) -> Iterator[Panel]:
    t, (place, yaw) = trace.times_s, trace.orders
    lines = tuple(Line(name, t, trace.sigma[:, channel], colour) for channel, name, colour in _PLACE)
    yield Panel("sigma", "σ, the disturbance", f"m/s{_POWERS[place]}", lines, 1.0)
    yield Panel("sigma_yaw", "σ of yaw", f"rad/s{_POWERS[yaw]}", (Line("yaw", t, trace.sigma[:, YAW], "yaw"),), 0.2)
    if numpy.any(trace.wind):
        winds = tuple(Line(name, t, trace.wind[:, axis], c) for axis, (_, name, c) in enumerate(_PLACE))
        yield Panel("wind", "Acceleration that is not the thrust's", "m/s²", winds, 0.5)


def _commands(trace: Trace) -> Iterator[Panel]:
    title, unit, factor = _CONTROLS[trace.depth]
    names: tuple[tuple[str, Colour], ...] = (("roll", "y"), ("pitch", "x"), ("yaw", "yaw"))
    lines = [Line(n, trace.times_s, trace.controls[:, i] * factor, c) for i, (n, c) in enumerate(names)]
    yield Panel("commands", title, unit, tuple(lines), 0.02 * factor)
    thrust = Line("commanded", trace.times_s, trace.controls[:, 3], "z")
    yield Panel("thrust", "Thrust", "0 to 1", (thrust,), 0.1)


def law_tracks(trace: Trace) -> list[Track]:
    """What was flown under the law, and the reference."""

    def points(vectors: Numbers) -> Numbers:
        return numpy.stack((vectors[:, X], -vectors[:, Y], vectors[:, Z]), axis=1)

    return [
        Track("flown", trace.times_s, points(trace.measured), "blue"),
        Track("reference", trace.times_s, points(trace.reference), "ink", dashed=True),
    ]


def limit_lanes(rows: Sequence[TraceRow], times_s: Numbers) -> list[Lane]:
    """One lane for each limit that was ever active, and when it was."""
    names = sorted({name for row in rows for name in row.limits})
    return [Lane(name.replace("_", " "), _active(rows, times_s, name), alarming=True) for name in names]


def _active(rows: Sequence[TraceRow], times_s: Numbers, name: str) -> tuple[Span, ...]:
    """From each row with the limit to the next row."""
    active = numpy.array([name in row.limits for row in rows] + [False])
    edges = numpy.flatnonzero(numpy.diff(active.astype(int), prepend=0))
    times = numpy.append(times_s, times_s[-1])
    return tuple(Span(float(times[a]), float(times[b]), "") for a, b in edges.reshape(-1, 2))
