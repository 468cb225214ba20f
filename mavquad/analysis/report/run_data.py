"""What can be read of a run folder, whole or broken off in the middle of a line."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mavquad.analysis.report.telemetry import Telemetry, telemetry
from mavquad.analysis.trace import read_whole_rows
from mavquad.errors import LogError, RunFolderError
from mavquad.flight_record import Note, TraceRow

_FILES = ("flight.tlog", "trace.csv", "notes.jsonl")


@dataclass(slots=True)
class RunData:
    """A run folder.

    Attributes:
        path: of the folder.
        rows: of the law.
        notes: the story.
        summary: as the flight wrote it; None where it did not come to that.
        config_text: the configuration in force, "" if it cannot be read.
        log: the tables of flight.tlog, second 0 at `start_us`; None where there is no frame.
        start_us: the earliest stamp of all of it.
        remarks: what could not be read, and why.
    """

    path: Path
    rows: list[TraceRow] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    summary: dict[str, Any] | None = None
    config_text: str = ""
    log: Telemetry | None = None
    start_us: int = 0
    remarks: list[str] = field(default_factory=list)


def is_run_folder(path: Path) -> bool:
    """Whether a folder looks like one of ours.

    Raises:
        RunFolderError: that cannot be told, for want of permission.
    """
    try:
        return path.is_dir() and any((path / name).exists() for name in _FILES)
    except OSError as error:
        raise RunFolderError(str(path), f"cannot be read ({(error.strerror or str(error)).lower()})") from None


def read_run(path: Path, message_names: tuple[str, ...]) -> RunData:
    """Read what there is; of the log, the messages of these names.

    Raises:
        RunFolderError: it is no run folder, or nothing in it can be read.
    """
    if not is_run_folder(path):
        hint = f"a folder that `fly` or `sim` wrote has {', '.join(_FILES)}"
        raise RunFolderError(str(path), "is not a run folder", hint)
    run = RunData(path)
    _read_trace(run)
    _read_notes(run)
    _read_summary(run)
    run.config_text = _text(run, "config.toml")
    add_log(run, message_names)
    return run


def add_log(run: RunData, message_names: tuple[str, ...]) -> None:
    """Read flight.tlog, and find the earliest stamp of all.

    Raises:
        RunFolderError: there is nothing in any of it.
    """
    stamps_us = [row.stamp_us for row in run.rows[:1]] + [note.stamp_us for note in run.notes[:1]]
    _read_log(run, message_names, min(stamps_us, default=None))
    if run.log is not None:
        stamps_us.append(run.log.start_us)
    if not stamps_us:
        why = "; ".join(run.remarks) or "all files are empty"
        raise RunFolderError(str(run.path), f"nothing of a flight is in it ({why})")
    run.start_us = min(stamps_us)


def _text(run: RunData, name: str) -> str:
    try:
        return (run.path / name).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        run.remarks.append(f"{name} cannot be read: {(error.strerror or str(error)).lower()}")
        return ""


def _read_trace(run: RunData) -> None:
    text = _text(run, "trace.csv")
    try:
        run.rows, damaged = read_whole_rows(text, "trace.csv")
    except LogError as error:
        run.remarks.append(error.message)
        return
    if damaged:
        run.remarks.append(f"trace.csv: {damaged} damaged line{'s' if damaged > 1 else ''} left out")


def _read_notes(run: RunData) -> None:
    damaged = 0
    for line in _text(run, "notes.jsonl").splitlines():
        try:
            run.notes.append(_note(**json.loads(line)))
        except (ValueError, TypeError):
            damaged += 1
    if damaged:
        run.remarks.append(f"notes.jsonl: {damaged} damaged line{'s' if damaged > 1 else ''} left out")


def _note(stamp_us: int, kind: str, text: str) -> Note:
    if type(stamp_us) is not int:
        raise ValueError("a stamp is a whole number")
    return Note(stamp_us, str(kind), str(text))


def _read_summary(run: RunData) -> None:
    """None where it is missing: the flight was cut off; that is said elsewhere."""
    if not (run.path / "summary.json").exists():
        return
    try:
        found = json.loads(_text(run, "summary.json"))
    except ValueError:
        found = None
    if isinstance(found, dict):
        run.summary = found
    else:
        run.remarks.append("summary.json is damaged")


def _read_log(run: RunData, message_names: tuple[str, ...], start_us: int | None) -> None:
    try:
        found = telemetry(run.path / "flight.tlog", message_names, start_us)
    except LogError as error:
        run.remarks.append(f"flight.tlog: {error.reason}")
        return
    if not found.has_stamps:
        run.remarks.append("flight.tlog: has lost its stamps, and is not shown")
        return
    run.log = found
    if found.log.bad_bytes:
        places = len(found.log.bad_ranges)
        run.remarks.append(
            f"flight.tlog: {found.log.bad_bytes} damaged bytes in {places} place{'s' if places > 1 else ''}"
        )
