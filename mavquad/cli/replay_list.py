"""`mavquad replay --list`: what is in a log."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Table
from rich.text import Text

from mavquad.analysis.survey import SenderSurvey, Survey, survey_file
from mavquad.cli.log_part import LogPart
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.errors import EXIT_OK

_MOST_ROWS = 20


def list_log(path: Path, part: LogPart, as_json: bool) -> int:
    """Print the survey of a log, or of a part of it; returns the exit code."""
    found = survey_file(path, part.selection(path))
    if as_json:
        say(json.dumps(found.to_json(), indent=2, allow_nan=False) + "\n")
    else:
        shown(lambda: _print(found))
    return EXIT_OK


def _print(found: Survey) -> None:
    console = QuietConsole(highlight=False)
    console.print(Text(_head(found)), soft_wrap=True)
    for sender in found.senders:
        console.print()
        console.print(Text(_who(sender), style="bold"), soft_wrap=True)
        console.print(_rows(("message", "count", "Hz"), _messages(sender)))
    flights = [
        (f"flight:{flight.number}", _ids(flight.sender), *_span(flight.span.from_s, flight.span.to_s))
        for flight in found.flights()
    ]
    modes = [
        (span.mode, _ids(sender.sender), *_span(span.from_s, span.to_s))
        for sender in found.senders
        for span in sender.modes
    ]
    gaps = [
        (_ids(sender.sender), *_span(gap.from_s, gap.to_s))
        for sender in found.senders
        if sender.is_vehicle
        for gap in sender.gaps
    ]
    for heads, rows in (
        (("flight (armed)", "vehicle", "from s", "to s", "s"), flights),
        (("mode", "vehicle", "from s", "to s", "s"), modes),
        (("silent", "from s", "to s", "s"), gaps),
        (("bad bytes at", "length"), [(str(at), str(length)) for at, length in found.bad_ranges]),
    ):
        if rows:
            console.print()
            console.print(_rows(heads, rows[:_MOST_ROWS]))
        if len(rows) > _MOST_ROWS:
            console.print(f"  and {len(rows) - _MOST_ROWS} more (--json has all)")


def _head(found: Survey) -> str:
    began = datetime.fromtimestamp(found.first_stamp_us * 1e-6, UTC).isoformat(" ", "milliseconds")
    words = [
        f"{found.frames} frames",
        f"{found.duration_s:.1f} s from {began}" if found.first_stamp_us else "without stamps",
        f"{found.bad_bytes} bad bytes in {len(found.bad_ranges)} places",
    ]
    if found.unknown_frames:
        words.append(f"{found.unknown_frames} frames of unknown messages")
    if found.repaired_stamps and found.first_stamp_us:
        words.append(f"{found.repaired_stamps} lost stamps")
    if found.backward_stamps:
        words.append(f"{found.backward_stamps} stamps that step back")
    return ", ".join(words)


def _who(sender: SenderSurvey) -> str:
    names = (sender.vehicle_type.removeprefix("MAV_TYPE_"), sender.autopilot.removeprefix("MAV_AUTOPILOT_"))
    what = ", ".join(name for name in names if name and name != "INVALID")
    forged = sender.contradicting_heartbeats
    return " ".join(
        [
            _ids(sender.sender),
            *([f"({what})"] if what else []),
            f"{sender.frames} frames",
            *([f"{forged} HEARTBEATs of something else under the same ids"] if forged else []),
        ]
    )


def _messages(sender: SenderSurvey) -> Iterable[tuple[str, str, str]]:
    for message in sender.messages:
        yield message.name, str(message.count), "" if message.rate_hz is None else f"{message.rate_hz:.4g}"


def _ids(sender: tuple[int, int]) -> str:
    return f"{sender[0]}/{sender[1]}"


def _span(from_s: float, to_s: float) -> tuple[str, str, str]:
    return f"{from_s:.1f}", f"{to_s:.1f}", f"{to_s - from_s:.1f}"


def _rows(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    table = Table(box=None, padding=(0, 2), header_style="dim")
    for index, head in enumerate(heads):
        table.add_column(head, justify="right" if index else "left")
    for row in rows:
        table.add_row(*map(Text, row))
    return table
