"""`mavquad replay`: one of our flights bit for bit, or a survey of any other log."""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from mavquad.agent import Agent
from mavquad.analysis.shadow import Shadow, shadow
from mavquad.analysis.survey import Survey, survey
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.config import load
from mavquad.drivers.replay import OperatorEvent, ReplayResult
from mavquad.drivers.replay import replay as run_replay
from mavquad.drivers.run_folder import read_events, to_json
from mavquad.errors import EXIT_OK, InputError, ReplayDiffers, RunFolderError
from mavquad.tlog import TlogContents, read_records


def replay(path: Path, output: Path | None, as_json: bool) -> int:
    """Replay or survey; returns the exit code."""
    if output is not None and output.suffix.lower() != ".png":
        raise InputError(f"--output: {str(output)!r} does not end with .png", "figures are PNG")
    contents = read_records(path)
    if _is_ours(path):
        return _replay_ours(path, contents, as_json)
    return _survey(path, contents, output, as_json)


def _is_ours(path: Path) -> bool:
    return (path.parent / "config.toml").exists() and (path.parent / "events.jsonl").exists()


def _replay_ours(path: Path, contents: TlogContents, as_json: bool) -> int:
    config = load(path.parent / "config.toml")
    events = read_events(path.parent)
    start_us = _start(events, path.parent)
    started = time.perf_counter()
    result = run_replay(Agent(config, start_us), start_us, contents, events)
    wall_s = time.perf_counter() - started
    if as_json:
        say(to_json(_replay_json(contents, result, wall_s)))
    else:
        shown(lambda: _print_replay(contents, result, wall_s))
    if not result.equal:
        raise ReplayDiffers(
            "the replay differs from the recorded flight",
            "another version of mavquad or of Python's libraries, or a changed config.toml, may be why",
        )
    return EXIT_OK


def _start(events: list[OperatorEvent], folder: Path) -> int:
    for event in events:
        if event.name == "start":
            return event.stamp_us
    raise RunFolderError(str(folder / "events.jsonl"), "has no start event")


def _replay_json(contents: TlogContents, result: ReplayResult, wall_s: float) -> dict[str, Any]:
    mismatch = result.first_mismatch
    return {
        "frames": len(contents),
        "bad_bytes": contents.bad_bytes,
        "inbound": result.inbound,
        "outbound": {
            "recorded": result.recorded,
            "replayed": result.replayed,
            "matched": result.matched,
            "first_mismatch": mismatch.to_json() if mismatch else None,
        },
        "wall_s": wall_s,
    }


def _print_replay(contents: TlogContents, result: ReplayResult, wall_s: float) -> None:
    console = QuietConsole(highlight=False)
    table = Table(show_header=False, box=None, padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    table.add_row("frames", f"{len(contents)} ({contents.bad_bytes} bad bytes)")
    table.add_row("inbound, fed to the agent", str(result.inbound))
    table.add_row("outbound, recorded / replayed", f"{result.recorded} / {result.replayed}")
    share = 100.0 * result.matched / max(result.recorded, 1)
    style = "bold green" if result.equal else "bold red"
    table.add_row("equal in bytes and stamp", f"[{style}]{result.matched} ({share:.2f} %)[/]")
    table.add_row("time", f"{wall_s:.2f} s")
    console.print(table)
    if result.first_mismatch is not None:
        difference = result.first_mismatch.to_json()
        console.print(f"first difference, outbound frame {difference['index']}:")
        for side in ("recorded", "replayed"):
            item = difference[side]
            words = f"{item['stamp_us']}  {item['message']}" if item else "nothing"
            console.print(f"  {side}: {words}", markup=False, soft_wrap=True)


def _survey(path: Path, contents: TlogContents, output: Path | None, as_json: bool) -> int:
    found = survey(contents)
    vehicle = found.main_vehicle()
    observed = shadow(contents, vehicle.sender) if vehicle else None
    figure = output or _new_figure(path.stem)
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.log_figure import survey_figure

    survey_figure(found, observed, figure, path.name)
    if as_json:
        result = {**found.to_json(), "observer": observed.to_json() if observed else None, "figure": str(figure)}
        say(to_json(result))
    else:
        shown(lambda: _print_survey(found, observed, figure))
    return EXIT_OK


def _new_figure(stem: str) -> Path:
    """NAME.png, or the first of NAME-2.png, ... that does not exist."""
    names = (Path(f"{stem}{suffix}.png") for suffix in itertools.chain([""], (f"-{n}" for n in itertools.count(2))))
    return next(name for name in names if not name.exists())


def _print_survey(found: Survey, observed: Shadow | None, figure: Path) -> None:
    console = QuietConsole(highlight=False)
    console.print(
        f"{found.frames} frames over {found.duration_s:.1f} s, {found.bad_bytes} bad bytes"
        f" in {len(found.bad_ranges)} places, {found.unknown_frames} frames of unknown messages"
    )
    table = Table(box=None, padding=(0, 2), header_style="dim")
    for name in ("system/component", "autopilot", "type", "frames", "armed"):
        table.add_column(name)
    for sender in found.senders:
        armed_s = sum(span.to_s - span.from_s for span in sender.armed_spans)
        table.add_row(
            "/".join(map(str, sender.sender)),
            sender.autopilot.removeprefix("MAV_AUTOPILOT_") or "-",
            sender.vehicle_type.removeprefix("MAV_TYPE_") or "-",
            str(sender.frames),
            f"{armed_s:.0f} s" if sender.armed_spans else "-",
        )
    console.print(table)
    if observed is not None and observed.tracks:
        console.print(_observer_words(observed))
    console.print(Text(f"figure: {figure}"), soft_wrap=True)


def _observer_words(observed: Shadow) -> str:
    words = f"observer over {observed.source or 'no position stream'} of {observed.sender[0]}/{observed.sender[1]}"
    if observed.position_rate_hz is not None and observed.kappa_rad_s is not None:
        words += f" at {observed.position_rate_hz:.1f} Hz, kappa {observed.kappa_rad_s:.1f} rad/s"
    rms = observed.velocity_rms_m_s
    if None not in rms:
        words += f"; velocity against the log's own, RMS N/W/U: {rms[0]:.2f} / {rms[1]:.2f} / {rms[2]:.2f} m/s"
    return words
