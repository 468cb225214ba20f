"""`python -m tests.conformance [folder or files] [--details]`: the mock against recordings of real autopilots."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tests.conformance.compare import Comparison, compare, totals
from tests.conformance.recording import is_recording, read

_CUT = Path(__file__).parent / "recordings"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.conformance", description=__doc__)
    parser.add_argument(
        "paths", nargs="*", type=Path, help="recordings or folders of them; default: those cut for tests"
    )
    parser.add_argument("--details", action="store_true", help="every exchange, rate and constant field")
    arguments = parser.parse_args()
    files = _files(arguments.paths or [_CUT])
    if not files:
        print("error: no recordings of real autopilots (px4-v*.tlog, arducopter-*.tlog) there", file=sys.stderr)
        return 2
    console = Console(width=160, highlight=False, soft_wrap=False)
    compared = []
    for path in files:
        comparison = compare(read(path))
        compared.append(comparison)
        _show(console, comparison, arguments.details)
    _show_totals(console, compared)
    return 0


def _files(paths: list[Path]) -> list[Path]:
    found = []
    for path in paths:
        found += sorted(filter(is_recording, path.iterdir())) if path.is_dir() else [path]
    return found


def _show(console: Console, comparison: Comparison, details: bool) -> None:
    recording = comparison.recording
    counted = comparison.counted()
    table = Table(
        "what", "of", "agree", "what differs (and why)", title=recording.name, title_justify="left", show_lines=True
    )
    differing = [compared for compared in comparison.exchanges if not compared.identical]
    listed = comparison.exchanges if details else differing
    told = [f"{'= ' if c.identical else ''}{c.real}: {'; '.join(map(str, c.differences))}" for c in listed]
    table.add_row("exchanges: result and state", str(len(counted)), _share(counted, "same_outcome"), "")
    table.add_row("exchanges: texts too", str(len(counted)), _share(counted, "identical"), escape("\n".join(told)))
    events = comparison.events
    table.add_row(
        "events by itself", str(comparison.event_count), f"{len(events)} differ", escape("\n".join(map(str, events)))
    )
    if not recording.is_cut:
        _add_streams(table, comparison, details)
    console.print(table)


def _add_streams(table: Table, comparison: Comparison, details: bool) -> None:
    kinds = f"missing: {', '.join(comparison.missing_kinds) or 'none'}\nextra: {', '.join(comparison.extra_kinds) or 'none'}"
    table.add_row("kinds of messages", "", "", kinds)
    rates = [rate for rate in comparison.rates if details or not rate.agrees]
    lines = [f"{rate.kind} {rate.real_hz:.2f} Hz, mock {rate.mock_hz:.2f}" for rate in rates]
    table.add_row("rates within 10 %", str(len(comparison.rates)), _share(comparison.rates, "agrees"), "\n".join(lines))
    fields = [constant for constant in comparison.constants if details or not constant.agrees]
    lines = [f"{c.kind}.{c.field} {c.real}, mock {'varies' if c.mock is None else c.mock}" for c in fields]
    shown = "\n".join(lines) if details else f"{len(lines)} differ: --details" if len(lines) > 12 else "\n".join(lines)
    table.add_row("constant fields", str(len(comparison.constants)), _share(comparison.constants, "agrees"), shown)


def _share(items: list, attribute: str) -> str:
    return f"{sum(getattr(item, attribute) for item in items)}"


def _show_totals(console: Console, comparisons: list[Comparison]) -> None:
    table = Table("recording", "exchanges", "excused", "result and state", "texts too", "rates", "fields")
    for comparison in comparisons:
        counts = totals([comparison])
        table.add_row(
            comparison.recording.name[:60],
            *(_cell(counts, key) for key in ("exchanges", "excused", "same outcome", "identical")),
            *(
                f"{_share(part, 'agrees')} / {len(part)}" if part else "-"
                for part in (comparison.rates, comparison.constants)
            ),
        )
    counts = totals(comparisons)
    table.add_row("all", *(_cell(counts, key) for key in ("exchanges", "excused", "same outcome", "identical")), "", "")
    console.print(table)
    console.print(_by_kind(comparisons))
    if counts["exchanges"]:
        share = 100 * counts["same outcome"] / counts["exchanges"]
        texts = 100 * counts["identical"] / counts["exchanges"]
        console.print(f"identical in result and resulting state: {share:.1f} %; in texts too: {texts:.1f} %")


def _by_kind(comparisons: list[Comparison]) -> Table:
    """What was asked, how often, and how often it was answered alike."""
    table = Table("asked", "exchanges", "result and state", "texts too")
    counted = [compared for comparison in comparisons for compared in comparison.counted()]
    for kind in sorted({compared.real.kind for compared in counted}):
        same = [compared for compared in counted if compared.real.kind == kind]
        table.add_row(kind, str(len(same)), _share(same, "same_outcome"), _share(same, "identical"))
    return table


def _cell(counts: dict, key: str) -> str:
    return str(counts[key])


if __name__ == "__main__":
    raise SystemExit(main())
