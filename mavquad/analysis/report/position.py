"""Where the vehicle of a log went: LOCAL_POSITION_NED, or ODOMETRY, or GLOBAL_POSITION_INT as metres from its first fix."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy

from mavquad.analysis.report.model import Colour, Line, Numbers, Panel, Track
from mavquad.analysis.report.telemetry import Rows, Sender, Telemetry

POSITION_NAMES = ("LOCAL_POSITION_NED", "ODOMETRY", "GLOBAL_POSITION_INT", "POSITION_TARGET_LOCAL_NED")
"""The messages that this module reads."""

_EARTH_RADIUS_M = 6_378_137.0
_IGNORED = (1, 2, 4)  # POSITION_TARGET_TYPEMASK_X_IGNORE and on
_AXES: tuple[tuple[str, Colour], ...] = (("north", "x"), ("east", "y"), ("up", "z"))
_BELIEVED_S = 2.0  # a target older than that is none


@dataclass(frozen=True, slots=True)
class Positions:
    """Rows of north, east, up (m) and their rates (m/s, NaN where the message has none in that frame)."""

    source: str
    times_s: Numbers
    points_m: Numbers
    velocities_m_s: Numbers


def positions(found: Telemetry, sender: Sender) -> Positions | None:
    """The first source that has at least two usable positions."""
    for name, read in (("LOCAL_POSITION_NED", _local), ("ODOMETRY", _odometry), ("GLOBAL_POSITION_INT", _global)):
        columns = found.of(name, sender)
        if columns is None:
            continue
        points_m, velocities_m_s = read(columns)
        usable = numpy.isfinite(points_m).all(axis=1)
        points_m[~usable] = numpy.nan
        if usable.sum() > 1:
            return Positions(name, columns.times_s, points_m, velocities_m_s)
    return None


def _up(ned: Numbers) -> Numbers:
    flipped: Numbers = ned * numpy.array([1.0, 1.0, -1.0])
    return flipped


def _stacked(columns: Rows, *names: str) -> Numbers:
    return numpy.stack([columns[name].astype(float) for name in names], axis=1)


def _local(columns: Rows) -> tuple[Numbers, Numbers]:
    return _up(_stacked(columns, "x", "y", "z")), _up(_stacked(columns, "vx", "vy", "vz"))


def _odometry(columns: Rows) -> tuple[Numbers, Numbers]:
    """Its velocities are the body's: not shown."""
    points_m = _up(_stacked(columns, "x", "y", "z"))
    return points_m, numpy.full_like(points_m, numpy.nan)


def _global(columns: Rows) -> tuple[Numbers, Numbers]:
    """On a plane that touches the Earth at the first fix; 0, 0 is no fix."""
    lat, lon, alt = (columns[name].astype(float) for name in ("lat", "lon", "alt"))
    fixed = (lat != 0) | (lon != 0)
    if not fixed.any():
        nothing = numpy.full((len(lat), 3), numpy.nan)
        return nothing, nothing
    first = int(numpy.argmax(fixed))
    north_m = numpy.radians((lat - lat[first]) * 1e-7) * _EARTH_RADIUS_M
    east_m = numpy.radians((lon - lon[first]) * 1e-7) * _EARTH_RADIUS_M * numpy.cos(numpy.radians(lat[first] * 1e-7))
    points_m = numpy.stack((north_m, east_m, (alt - alt[first]) * 1e-3), axis=1)
    points_m[~fixed] = numpy.nan
    return points_m, _up(_stacked(columns, "vx", "vy", "vz")) * 0.01


def track(places: Positions) -> Track:
    """The path that was flown."""
    return Track("flown", places.times_s, places.points_m, "blue")


def target_track(found: Telemetry, sender: Sender) -> Track | None:
    """What the autopilot says it wants (POSITION_TARGET_LOCAL_NED), NaN where it wants no position."""
    columns = found.of("POSITION_TARGET_LOCAL_NED", sender)
    if columns is None:
        return None
    points_m = _up(_stacked(columns, "x", "y", "z"))
    mask = columns["type_mask"].astype(int)
    for axis, bit in enumerate(_IGNORED):
        points_m[(mask & bit) != 0, axis] = numpy.nan
    if not numpy.isfinite(points_m).all(axis=1).any():
        return None
    return Track("wanted", columns.times_s, points_m, "ink", dashed=True)


def error_panel(places: Positions, wanted: Track) -> Panel | None:
    """Flown minus wanted, the last target that is not older than 2 s, north, east, up."""
    if places.source == "GLOBAL_POSITION_INT":
        return None  # another origin
    last = numpy.searchsorted(wanted.times_s, places.times_s, side="right") - 1
    usable = (last >= 0) & (places.times_s - wanted.times_s[numpy.maximum(last, 0)] <= _BELIEVED_S)
    errors_m = numpy.where(usable[:, None], places.points_m - wanted.points_m[numpy.maximum(last, 0)], numpy.nan)
    if not numpy.isfinite(errors_m).any():
        return None
    lines = [Line(name, places.times_s, errors_m[:, axis] * 100.0, colour) for axis, (name, colour) in enumerate(_AXES)]
    return Panel("error", "Position error", "cm, against the autopilot's own target", tuple(lines), least_span=20.0)


def altitude_panel(places: Positions, wanted: Track | None) -> Panel:
    """Up, and dashed what is wanted."""
    lines = [Line("flown", places.times_s, places.points_m[:, 2], "z")]
    if wanted is not None:
        lines.append(Line("wanted", wanted.times_s, wanted.points_m[:, 2], "ink", dashed=True))
    return Panel("altitude", "Altitude", "m", tuple(lines), least_span=1.0)


def velocity_lines(places: Positions) -> Iterator[Line]:
    """The log's own velocity, north, west, up."""
    north, east, up = places.velocities_m_s.T
    named: tuple[tuple[str, Numbers, Colour], ...] = (("north", north, "x"), ("west", -east, "y"), ("up", up, "z"))
    for name, values, colour in named:
        if numpy.isfinite(values).any():
            yield Line(f"{name}, autopilot", places.times_s, values, colour, dashed=True)
