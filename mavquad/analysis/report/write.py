"""The report folder: everything is made beside its place and moved there when all of it is whole."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mavquad.analysis.report.columns import all_tables, write_csv, write_npz
from mavquad.analysis.report.model import Report
from mavquad.analysis.report.page import page
from mavquad.errors import RunFolderError
from mavquad.flight_record import TraceRow
from mavquad.tlog import Log

PAGE = "report.html"
COLUMNS = "columns"


@dataclass(frozen=True, slots=True)
class Parts:
    """What a report folder is made of.

    Attributes:
        report: for the page and the summary.
        log: all messages; None where there is no log.
        rows: of the law; none of a log of others.
        figure: its name, and what draws it into a file.
        with_summary: whether `summary.json` is written (that of a flight is the flight's own).
        mcap: what writes an MCAP file; None where none is wanted.
    """

    report: Report
    log: Log | None
    rows: Sequence[TraceRow]
    figure: tuple[str, Callable[[Path], None]] | None
    with_summary: bool
    mcap: Callable[[Path], None] | None = None


def write_report(folder: Path, parts: Parts) -> list[str]:
    """Write the folder; returns the names of what is new in it. What stood there under these names is replaced.

    Raises:
        RunFolderError: it cannot be written; nothing in it has changed then.
    """
    is_new = not folder.exists()
    staging = folder / f".report.{os.getpid()}.part"
    try:
        staging.mkdir(parents=True)
        _make(staging, parts)
        names = sorted(path.name for path in staging.iterdir())
        for name in names:
            _move(staging / name, folder / name)
    except BaseException as error:
        shutil.rmtree(staging if not is_new else folder, ignore_errors=True)
        if isinstance(error, OSError):
            reason = (error.strerror or str(error)).lower()
            hint = "is there room, and may you write there? --output takes another folder"
            raise RunFolderError(str(folder), f"the report cannot be written ({reason})", hint) from None
        raise
    staging.rmdir()
    return names


def _make(staging: Path, parts: Parts) -> None:
    (staging / PAGE).write_text(page(parts.report), encoding="utf-8")
    if parts.with_summary:
        text = json.dumps(parts.report.summary, indent=2, allow_nan=False) + "\n"
        (staging / "summary.json").write_text(text, encoding="utf-8")
    if parts.figure is not None:
        name, draw = parts.figure
        draw(staging / name)
    tables = list(all_tables(parts.log, parts.rows))
    write_npz(staging / f"{COLUMNS}.npz", tables)
    (staging / COLUMNS).mkdir()
    for name, columns in tables:
        write_csv(staging / COLUMNS / f"{name}.csv", columns)
    if parts.mcap is not None:
        parts.mcap(staging / "report.mcap")


def _move(source: Path, target: Path) -> None:
    if target.is_dir():
        shutil.rmtree(target)
    source.replace(target)
