"""A log's tables in the order of time, as seconds since the report's start.

Stamps of a damaged log, or of one that two programs wrote, step back now and then: each table is sorted by its stamps (the
order of the file where they are equal). A log without stamps (`.raw`) has its times from the vehicle's own clock: every
message lies where its place in the file is among the messages that carry `time_boot_ms`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from mavquad import tlog
from mavquad.analysis.report.model import Numbers

Sender = tuple[int, int]
_BOOT = "time_boot_ms"


@dataclass(frozen=True, slots=True)
class Rows:
    """The messages of one kind from one sender by time: `rows["roll"]` or `rows["roll_rad"]`, and `times_s`."""

    table: tlog.Table
    times_s: Numbers
    order: NDArray[numpy.int64] | None

    def __getitem__(self, name: str) -> NDArray[Any]:
        values = self.table[name]
        return values if self.order is None else values[self.order]

    def __contains__(self, name: str) -> bool:
        return name in self.table.fields

    def __len__(self) -> int:
        return len(self.times_s)

    def addressed(self, vehicle: Sender) -> NDArray[numpy.bool_]:
        """Which of them are to that vehicle, or to all."""
        return numpy.isin(self["target_system"], (0, vehicle[0]))


@dataclass(slots=True)
class Telemetry:
    """The tables of a log that a report needs.

    Attributes:
        log: as it was read.
        start_us: second 0, Unix us; of a log without stamps, the vehicle's time since its boot.
        duration_s: to the last stamp.
    """

    log: tlog.Log
    start_us: int
    duration_s: float
    _clock: tuple[Numbers, Numbers] | None
    _rows: dict[tuple[str, Sender], Rows | None] = field(default_factory=dict)

    @property
    def has_stamps(self) -> bool:
        """Whether the log itself says when anything came."""
        return self._clock is None

    def of(self, name: str, sender: Sender) -> Rows | None:
        """The messages of that name from that sender, always the same arrays; None where it sent none."""
        key = (name, sender)
        if key not in self._rows:
            table = self.log.tables.get(key)
            self._rows[key] = None if table is None else self._sorted(table)
        return self._rows[key]

    def senders_of(self, name: str) -> list[Sender]:
        """Who sent that message."""
        return sorted(self.log[name])

    def _sorted(self, table: tlog.Table) -> Rows:
        times_s = self._times_s(table)
        if numpy.all(numpy.diff(times_s) >= 0):
            return Rows(table, times_s, None)
        order = numpy.argsort(times_s, kind="stable")
        return Rows(table, times_s[order], order)

    def _times_s(self, table: tlog.Table) -> Numbers:
        if self._clock is None:
            # A stamp of 0 among others is none: the reader does not count it as the log's first.
            return numpy.asarray(numpy.maximum((table.stamps_us - self.start_us) * 1e-6, 0.0))
        return numpy.asarray(numpy.interp(table.offsets, *self._clock), dtype=numpy.float64)


def telemetry(
    path: Path, names: tuple[str, ...], start_us: int | None = None, selection: tlog.Selection | None = None
) -> Telemetry:
    """Read the messages of these names; second 0 is the log's first stamp, or `start_us` if that is earlier.

    Raises:
        LogError: as of `tlog.read`.
    """
    chosen = selection or tlog.Selection()
    log = tlog.read(path, names, system=chosen.system, from_us=chosen.from_us, to_us=chosen.to_us)
    if log.last_us:
        start_us = log.first_us if start_us is None else min(start_us, log.first_us)
        return Telemetry(log, start_us, (log.last_us - start_us) * 1e-6, None)
    offsets, seconds = _boot_clock(log)
    return Telemetry(log, 0, float(seconds[-1]), (offsets, seconds))


def _boot_clock(log: tlog.Log) -> tuple[Numbers, Numbers]:
    """Offsets in the file and the seconds that they stand for: the vehicle's clock, never stepping back.

    The vehicle is who sent most messages with that clock.
    """
    counts: dict[Sender, int] = {}
    stamped = [table for table in log.tables.values() if _BOOT in table.fields]
    for table in stamped:
        counts[table.sender] = counts.get(table.sender, 0) + len(table)
    if not counts:
        return numpy.array([0.0, float(max(log.size, 1))]), numpy.zeros(2)
    vehicle = max(counts, key=lambda sender: counts[sender])
    mine = [table for table in stamped if table.sender == vehicle]
    offsets = numpy.concatenate([table.offsets for table in mine]).astype(float)
    seconds = numpy.concatenate([table[_BOOT] for table in mine]) * 1e-3
    order = numpy.argsort(offsets)
    rising_s = numpy.maximum.accumulate(seconds[order])
    return offsets[order], rising_s - rising_s[0]
