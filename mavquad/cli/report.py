"""`mavquad report`: the page and the columns of a flight of ours, or of any other log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.text import Text

from mavquad import tlog
from mavquad.analysis.metrics import error_samples, flight_metrics
from mavquad.analysis.report.foxglove import write_mcap
from mavquad.analysis.report.model import Report
from mavquad.analysis.report.of_log import LogData, read_log, report_of_log
from mavquad.analysis.report.of_run import MESSAGES, report_of_run
from mavquad.analysis.report.run_data import RunData, is_run_folder, read_run
from mavquad.analysis.report.write import PAGE, Parts, write_report
from mavquad.cli.log_part import LogPart
from mavquad.cli.new_file import new_file
from mavquad.cli.replay_flight import OtherLaw
from mavquad.cli.replay_shadow import shadow_of
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, InputError, LogError, RunFolderError

EXPORTS = ("mcap",)
_FLYING = ("flying",)


def report(path: Path, part: LogPart, output: Path | None, export: str | None, as_json: bool) -> int:
    """Write the report of a run folder (into it) or of a log (into NAME-report); returns the exit code."""
    if export is not None and export not in EXPORTS:
        raise InputError(f"--export: {export!r} is not a format that can be written", f"one of: {', '.join(EXPORTS)}")
    run = _run_folder(path)
    if run is not None and not part.is_all:
        raise InputError("--system, --from, --to: a flight of ours is shown whole", "its page can be zoomed")
    folder = output or (run if run is not None else new_file(f"{_stem(path)}-report", ""))
    _refuse_another(folder, run)
    parts = _parts_of_run(run, folder, export) if run is not None else _parts_of_log(path, part, export)
    names = write_report(folder, parts)
    if as_json:
        say(to_json(_json(parts.report, folder, names)))
    else:
        shown(lambda: _print(parts.report, folder, names))
    return EXIT_OK


def _stem(path: Path) -> str:
    name = path.name
    for suffix in (".gz", ".tlog", ".raw"):
        name = name.removesuffix(suffix)
    return name


def _run_folder(path: Path) -> Path | None:
    """The run folder that is meant, by its own name or by its log's."""
    if path.is_dir():
        return path
    is_inside = path.name == "flight.tlog" and (path.parent / "config.toml").exists()
    return path.parent if is_inside and is_run_folder(path.parent) else None


def _refuse_another(folder: Path, run: Path | None) -> None:
    """A folder with something else in it is not ours to write into; one with a report is."""
    try:
        is_ours = folder == run or (folder / PAGE).exists() or not folder.exists() or not any(folder.iterdir())
    except OSError as error:
        raise RunFolderError(str(folder), f"cannot be used ({(error.strerror or str(error)).lower()})") from None
    if not is_ours:
        raise RunFolderError(str(folder), "is not empty, and has no report in it", "choose another with --output")


def _parts_of_run(path: Path, folder: Path, export: str | None) -> Parts:
    run = read_run(path, MESSAGES)
    found = report_of_run(run)
    log = _whole_log(path / "flight.tlog") if run.log is not None else None
    return Parts(
        report=found,
        log=log,
        rows=run.rows,
        figure=None if (folder / "flight.png").exists() else ("flight.png", lambda part: _draw_run(run, found, part)),
        with_summary=folder != path or run.summary is None,
        mcap=(lambda part: write_mcap(part, log, run.rows, found)) if export else None,
    )


def _whole_log(path: Path) -> tlog.Log | None:
    try:
        return tlog.read(path)
    except LogError:
        return None


def _parts_of_log(path: Path, part: LogPart, export: str | None) -> Parts:
    selection = part.selection(path)
    data = read_log(path, selection, lambda contents, vehicle: shadow_of(contents, vehicle, OtherLaw()))
    found = report_of_log(data)
    log = tlog.read(path, system=selection.system, from_us=selection.from_us, to_us=selection.to_us)
    return Parts(
        report=found,
        log=log,
        rows=(),
        figure=("replay.png", lambda part: _draw_log(data, part)),
        with_summary=True,
        mcap=(lambda part: write_mcap(part, log, (), found)) if export else None,
    )


def _draw_run(run: RunData, found: Report, part: Path) -> None:
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.figures import flight_figure

    marks = [(note.stamp_us, note.text) for note in run.notes if note.kind in ("guard", "operator")]
    flight_figure(run.rows, marks, part, found.title, flight_metrics(error_samples(run.rows, _FLYING)))


def _draw_log(data: LogData, part: Path) -> None:
    from mavquad.analysis.log_figure import survey_figure

    survey_figure(data.who, data.observed, part, data.path.name)


def _json(found: Report, folder: Path, names: list[str]) -> dict[str, Any]:
    points = {panel.key: sum(len(line.values) for line in panel.lines) for panel in found.panels}
    return {
        "folder": str(folder),
        "page": str(folder / PAGE),
        "files": names,
        "points": points,
        "remarks": list(found.remarks),
        "summary": found.summary,
    }


def _print(found: Report, folder: Path, names: list[str]) -> None:
    console = QuietConsole(highlight=False)
    console.print(Text(found.title), soft_wrap=True)
    for name, value in found.facts:
        console.print(Text.assemble((f"  {name}: ", "dim"), value), soft_wrap=True)
    for remark in found.remarks:
        console.print(Text(f"  {remark}"), soft_wrap=True)
    others = [name for name in names if name != PAGE]
    console.print(Text(f"page: {folder / PAGE}"), soft_wrap=True)
    console.print(Text.assemble(("beside it: ", "dim"), ", ".join(others)), soft_wrap=True)
