"""Fewer rows where there are too many for a page: extremes for lines, every n-th point for paths, and honest gaps.

A line keeps the least and the greatest value of every bucket of rows, in their order, so that no spike is lost, however
far out the view is zoomed. A path cannot be thinned so: the extremes of its coordinates are not points of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy

from mavquad.analysis.report.model import Numbers

_GAP_SPACINGS = 10.0
_LEAST_GAP_S = 1.0


def extremes(times_s: Numbers, columns: Sequence[Numbers], rows: int) -> tuple[Numbers, list[Numbers]]:
    """At most `rows` rows (at least 2): of every bucket each column's extremes, NaN only where nothing else is."""
    count = len(times_s)
    if count <= rows:
        return times_s, list(columns)
    size = -(-count // (rows // 2))
    buckets = -(-count // size)
    first = numpy.arange(buckets) * size
    second = numpy.minimum(first + size // 2, count - 1)
    return _interleaved(times_s[first], times_s[second]), [_extremes(column, buckets, size) for column in columns]


def _extremes(column: Numbers, buckets: int, size: int) -> Numbers:
    padded = numpy.full(buckets * size, numpy.nan)
    padded[: len(column)] = column
    table = padded.reshape(buckets, size)
    empty = numpy.isnan(table)
    least = numpy.where(empty, numpy.inf, table).argmin(axis=1)
    greatest = numpy.where(empty, -numpy.inf, table).argmax(axis=1)
    at = numpy.arange(buckets)
    return _interleaved(table[at, numpy.minimum(least, greatest)], table[at, numpy.maximum(least, greatest)])


def _interleaved(first: Numbers, second: Numbers) -> Numbers:
    return numpy.stack((first, second), axis=1).reshape(-1)


def strided(times_s: Numbers, columns: Sequence[Numbers], rows: int) -> tuple[Numbers, list[Numbers]]:
    """At most `rows` rows, evenly picked, the first and the last among them."""
    if len(times_s) <= rows:
        return times_s, list(columns)
    picked = numpy.linspace(0, len(times_s) - 1, rows).astype(int)
    return times_s[picked], [column[picked] for column in columns]


def with_gaps(times_s: Numbers, columns: Sequence[Numbers]) -> tuple[Numbers, list[Numbers]]:
    """A row of NaN amid every gap, so that no line is drawn across it.

    A gap is longer than a second and than ten times the median spacing.
    """
    if len(times_s) < 2:
        return times_s, list(columns)
    spacings_s = numpy.diff(times_s)
    longest_s = max(_LEAST_GAP_S, _GAP_SPACINGS * float(numpy.median(spacings_s)))
    at = numpy.flatnonzero(spacings_s > longest_s) + 1
    if not len(at):
        return times_s, list(columns)
    middles_s = (times_s[at - 1] + times_s[at]) / 2
    return numpy.insert(times_s, at, middles_s), [numpy.insert(column, at, numpy.nan) for column in columns]
