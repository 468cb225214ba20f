"""What a user sees: a live panel while it flies, the story line by line where there is no terminal, and the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from rich.console import Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from mavquad.agent import Agent
from mavquad.cli.terminal import QuietConsole, shown
from mavquad.flight.machine import Phase
from mavquad.flight_record import Note, Status

_STORY = (
    Phase.CONNECTING,
    Phase.IDENTIFYING,
    Phase.WAITING,
    Phase.ARMING,
    Phase.TAKING_OFF,
    Phase.ENGAGING,
    Phase.FLYING,
    Phase.HANDING_BACK,
    Phase.LANDING,
)
_COLOURS = {"phase": "bold cyan", "vehicle": "yellow", "guard": "bold red", "error": "bold red", "operator": "magenta"}
_NOTES_SHOWN = 6


class Display:
    """Shows a flight on stderr; quiet when told so, and for good once nobody reads: showing must never end a flight."""

    def __init__(self, quiet: bool) -> None:
        self._console = QuietConsole(stderr=True, quiet=quiet, highlight=False)
        self._interactive = self._console.is_terminal and not self._console.is_dumb_terminal and not quiet
        self._live: Live | None = None
        self._gone = False
        self._start_us = 0
        self._notes: list[Note] = []

    def __enter__(self) -> Display:
        if self._interactive:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._try(self._live.start)
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._try(self._live.stop)
            self._live = None

    def update(self, agent: Agent, notes: Iterable[Note]) -> None:
        """Show the present state and what happened since the last call."""
        self._try(lambda: self._update(agent, notes))

    def _try(self, show: Callable[[], None]) -> None:
        if not self._gone:
            self._gone = not shown(show)

    def _update(self, agent: Agent, notes: Iterable[Note]) -> None:
        for note in notes:
            self._start_us = self._start_us or note.stamp_us
            self._notes.append(note)
            if not self._interactive and note.kind != "error":  # errors are told at the end
                self._console.print(self._line(note), soft_wrap=True)
        if self._live is not None:
            self._live.update(self._panel(agent.status()), refresh=True)

    def _line(self, note: Note) -> Text:
        seconds = (note.stamp_us - self._start_us) * 1e-6
        return Text.assemble(
            (f"{seconds:7.2f} s  ", "dim"), (f"{note.kind:<10}", "dim"), (note.text, _COLOURS.get(note.kind, ""))
        )

    def _panel(self, status: Status) -> RenderableType:
        story = Text("  ").join(self._step(phase, Phase(status.phase)) for phase in _STORY)
        figures = Table.grid(padding=(0, 3))
        figures.add_row(*(Text(f"{name}", style="dim") for name, _ in _figures(status)))
        figures.add_row(*(Text(value, style="bold") for _, value in _figures(status)))
        parts: list[RenderableType] = [story, Text(""), figures]
        if status.mission_duration_s > 0.0:
            done_s = min(status.mission_s, status.mission_duration_s)
            parts += [Text(""), ProgressBar(total=status.mission_duration_s, completed=done_s)]
        parts += [Text(""), *(self._line(note) for note in self._notes[-_NOTES_SHOWN:])]
        return Panel(
            Group(*parts), title=Text(f"mavquad  {status.vehicle}"), subtitle="Ctrl-C lands", border_style="cyan"
        )

    @staticmethod
    def _step(phase: Phase, present: Phase) -> Text:
        if phase is present:
            return Text(phase.value, style="bold reverse cyan")
        return Text(phase.value, style="dim")


def _figures(status: Status) -> list[tuple[str, str]]:
    thrust = f"{status.row.controls[3]:.3f}" if status.row else "-"
    return [
        ("mode", status.mode or "-"),
        ("armed", "yes" if status.armed else "no"),
        ("height", _number(status.height_m, 1.0, "m", 2)),
        ("position error", _number(status.position_error_m, 100.0, "cm", 1)),
        ("yaw error", _number(status.yaw_error_rad, 180.0 / math.pi, "deg", 1)),
        ("depth", status.depth or "-"),
        ("thrust", thrust),
        ("pose", f"{status.position_hz:.0f} Hz"),
        ("setpoints", str(status.setpoints_sent)),
    ]


def _number(value: float | None, factor: float, unit: str, digits: int) -> str:
    return "-" if value is None else f"{value * factor:.{digits}f} {unit}"


def summary_table(summary: dict[str, Any]) -> RenderableType:
    """The short table at the end of a flight."""
    table = Table(show_header=False, box=None, padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    rows = [
        ("outcome", Text(summary["outcome"], style="bold green" if summary["completed"] else "bold red")),
        ("vehicle", summary["vehicle"] or "-"),
        ("law", f"depth {summary['depth']}, measurements {summary['measurements']}" if summary["depth"] else "-"),
        (
            "position error, RMS / max",
            f"{_cm(summary['position_rms_m'])} / {_cm(summary['position_max_m'])} (estimated)",
        ),
    ]
    if summary.get("true_position_rms_m") is not None:
        rows.append(("true position error, RMS", _cm(summary["true_position_rms_m"])))
    rows += [
        ("yaw error, RMS", _number(summary["yaw_rms_rad"], 180.0 / math.pi, "deg", 2)),
        ("within 5 cm and 3 deg for 3 s after", _number(summary["settle_s"], 1.0, "s", 1)),
        ("setpoints sent", f"{summary['setpoints_sent']} (safe ones: {summary['safe_setpoints']})"),
        ("flight / wall time", f"{summary['flight_s']:.1f} s / {summary['wall_s']:.1f} s"),
        ("real-time factor", f"{summary['real_time_factor']:.1f}"),
        ("lateness p50 / p99 / max", _lateness(summary["lateness_us"])),
        ("frames lost / unknown", f"{summary['link']['lost']} / {summary['link']['unknown']}"),
        ("damaged datagrams", str(summary["link"]["bad"])),
        ("run folder", summary["run_dir"]),
    ]
    for name, value in rows:
        table.add_row(name, Text(value) if isinstance(value, str) else value)
    return table


def _lateness(lateness_us: dict[str, int]) -> str:
    if not any(lateness_us.values()):
        return "none: virtual time"
    return " / ".join(f"{lateness_us[key]} us" for key in ("p50", "p99", "max"))


def _cm(value: float | None) -> str:
    return _number(value, 100.0, "cm", 1)
