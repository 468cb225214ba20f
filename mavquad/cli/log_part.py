"""--system, --from and --to: the part of a log that is wanted.

A time is seconds since the log began (12.5), a wall time (2026-05-01T10:20:30, UTC unless it says otherwise), an armed
span (flight:1) or a stretch of one flight mode (mode:GUIDED, or mode:GUIDED:2 for the second one). --from takes the
beginning of a span or stretch, --to its end; what `mavquad replay LOG --list` shows is what there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from mavquad.errors import InputError

if TYPE_CHECKING:
    from mavquad.analysis.survey import Survey
    from mavquad.tlog import Selection

_FORMS = "12.5 (s), 2026-05-01T10:20:30Z, flight:1, mode:GUIDED, mode:GUIDED:2"


@dataclass(frozen=True, slots=True)
class LogPart:
    """As it was asked for; `--list` with the same --system numbers the flights alike."""

    system: int | None = None
    from_: str | None = None
    to: str | None = None

    @property
    def is_all(self) -> bool:
        """Whether nothing was asked for."""
        return self == LogPart()

    def selection(self, path: Path) -> Selection:
        """The part of this log.

        Raises:
            InputError: it cannot be understood, or there is no such flight or mode.
            LogError: the log cannot be read.
        """
        from mavquad.analysis.survey import survey_file
        from mavquad.tlog import Selection

        if self.system is not None and not 0 <= self.system <= 255:
            raise InputError(f"--system: {self.system} is not between 0 and 255")
        whose = Selection(system=self.system)
        if self.from_ is None and self.to is None:
            return whose
        found = survey_file(path, whose)
        from_us = _stamp_us("--from", self.from_, found, 0)
        to_us = _stamp_us("--to", self.to, found, 1)
        if from_us is not None and to_us is not None and from_us > to_us:
            raise InputError(f"--from {self.from_} is behind --to {self.to}")
        return Selection(system=self.system, from_us=from_us, to_us=to_us)


def _stamp_us(option: str, text: str | None, found: Survey, end: int) -> int | None:
    """Unix us of a time; `end` is 0 for the beginning of a span, 1 for its end."""
    if text is None:
        return None
    kind, _, name = text.partition(":")
    if kind == "flight":
        return _of_log(_flight(option, name, found)[end], found)
    if kind == "mode":
        return _of_log(_mode(option, name, found)[end], found)
    try:
        seconds = float(text)
    except ValueError:
        return _wall_us(option, text)
    if not math.isfinite(seconds) or abs(seconds) > 1e10:
        raise InputError(f"{option}: {text!r} is no time", _FORMS)
    return _of_log(seconds, found)


def _of_log(seconds: float, found: Survey) -> int:
    return found.first_stamp_us + round(seconds * 1e6)


def _wall_us(option: str, text: str) -> int:
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(f"{option}: {text!r} is no time", _FORMS) from None
    aware = when if when.tzinfo else when.replace(tzinfo=UTC)
    return round((aware - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds() * 1e6)


def _flight(option: str, name: str, found: Survey) -> tuple[float, float]:
    flights = {str(flight.number): flight.span for flight in found.flights()}
    if name not in flights:
        there = f"flight:1 to flight:{len(flights)}" if flights else "nobody was armed"
        raise InputError(f"{option}: there is no flight:{name}", f"in this log: {there}; see --list")
    return flights[name].from_s, flights[name].to_s


def _mode(option: str, name: str, found: Survey) -> tuple[float, float]:
    """A stretch of a mode of the main vehicle."""
    vehicle = found.main_vehicle()
    modes = vehicle.modes if vehicle else ()
    mode, _, number = name.partition(":")
    stretches = [span for span in modes if span.mode == mode.upper()]
    index = int(number or "1") if (number or "1").isdecimal() else 0
    if not 1 <= index <= len(stretches):
        there = ", ".join(dict.fromkeys(span.mode for span in modes)) or "none that is known"
        raise InputError(f"{option}: there is no mode:{name}", f"modes in this log: {there}; see --list")
    return stretches[index - 1].from_s, stretches[index - 1].to_s
