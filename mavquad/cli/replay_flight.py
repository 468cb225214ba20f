"""`mavquad replay` on a flight of ours: bit for bit, and, with another configuration, another law beside it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from mavquad.agent import Agent
from mavquad.analysis.what_if import INPUTS, Flown, WhatIf, units, what_if
from mavquad.cli.new_file import new_file
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.config import Config, Override, load
from mavquad.drivers.flown import Witness
from mavquad.drivers.key_file import key_of
from mavquad.drivers.replay import OperatorEvent, ReplayResult, replay
from mavquad.drivers.run_folder import read_events, to_json
from mavquad.errors import EXIT_OK, InputError, ReplayDiffers, RunFolderError
from mavquad.tlog import TlogContents


@dataclass(frozen=True, slots=True)
class OtherLaw:
    """Where another law comes from: a configuration, and what is laid over it (or over the flight's own)."""

    config: Path | None = None
    overrides: tuple[Override, ...] = ()

    def __bool__(self) -> bool:
        return self.config is not None or bool(self.overrides)

    def load(self, own: Path) -> Config:
        """The configuration with that law.

        Raises:
            ConfigError: it is wrong.
        """
        return load(self.config or own, self.overrides)


def is_ours(path: Path) -> bool:
    """Whether a log lies in a run folder."""
    return (path.parent / "config.toml").exists() and (path.parent / "events.jsonl").exists()


def replay_flight(path: Path, contents: TlogContents, other: OtherLaw, output: Path | None, as_json: bool) -> int:
    """Run a flight again; returns the exit code.

    Raises:
        ReplayDiffers: without another law, a frame is not the recorded one.
        ConfigError: a configuration is wrong.
        RunFolderError: the folder is incomplete, or the figure cannot be written.
        InputError: another law is asked for beside a flight that never was under the law.
    """
    config = load(path.parent / "config.toml")
    other_config = other.load(path.parent / "config.toml") if other else None
    events = read_events(path.parent)
    start_us = _start(events, path.parent)
    started = time.perf_counter()
    agent = Agent(config, start_us, key_of(config.link))
    witness = Witness(agent, config)
    result = replay(agent, start_us, contents, events, witness if other_config else lambda _: None)
    wall_s = time.perf_counter() - started
    summary = _summary(contents, result, wall_s)
    if other_config is not None:
        return _beside(path, summary, witness.flown, other_config, output, as_json)
    if as_json:
        say(to_json(summary))
    else:
        shown(lambda: _print_replay(summary))
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


def _summary(contents: TlogContents, result: ReplayResult, wall_s: float) -> dict[str, Any]:
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


def _print_replay(summary: dict[str, Any]) -> None:
    console = QuietConsole(highlight=False)
    table = Table(show_header=False, box=None, padding=(0, 2))
    table.add_column(style="dim")
    table.add_column()
    outbound = summary["outbound"]
    table.add_row("frames", f"{summary['frames']} ({summary['bad_bytes']} bad bytes)")
    table.add_row("inbound, fed to the agent", str(summary["inbound"]))
    table.add_row("outbound, recorded / replayed", f"{outbound['recorded']} / {outbound['replayed']}")
    share = 100.0 * outbound["matched"] / max(outbound["recorded"], 1)
    difference = outbound["first_mismatch"]
    style = "bold red" if difference else "bold green"
    table.add_row("equal in bytes and stamp", f"[{style}]{outbound['matched']} ({share:.2f} %)[/]")
    table.add_row("time", f"{summary['wall_s']:.2f} s")
    console.print(table)
    if difference:
        console.print(f"first difference, outbound frame {difference['index']}:")
        for side in ("recorded", "replayed"):
            item = difference[side]
            words = f"{item['stamp_us']}  {item['message']}" if item else "nothing"
            console.print(f"  {side}: {words}", markup=False, soft_wrap=True)


# ---------------------------------------------------------------------- another law


def _beside(
    path: Path, summary: dict[str, Any], flown: Flown, config: Config, output: Path | None, as_json: bool
) -> int:
    if not flown.steps:
        raise InputError(
            f"{path}: the law was never asked in this flight", "there is nothing to put another law beside"
        )
    depth = flown.steps[0].row.depth if config.law.depth == "auto" else config.law.depth
    found = what_if(flown, config.law, depth)
    figure = output or new_file(f"{path.resolve().parent.name}-beside", ".png")
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.what_if_figure import what_if_figure

    words = f"other law: depth {depth}, {config.law.form.replace('_', ' ')}, measurements {config.law.measured()}"
    what_if_figure(found, figure, f"{path}: another law beside it", words)
    if as_json:
        say(to_json({**summary, "beside": found.to_json(), "figure": str(figure)}))
        return EXIT_OK
    shown(lambda: _print_replay(summary))
    shown(lambda: _print_beside(found, words, figure))
    return EXIT_OK


def _print_beside(found: WhatIf, words: str, figure: Path) -> None:
    console = QuietConsole(highlight=False)
    acted = "the flown inputs" if found.same_inputs else f"the measured motion (flown at depth {found.flown_depth})"
    console.print(Text(f"\n{words}\nits inputs minus what acted ({acted}), {len(found.counted)} steps of its flying:"))
    table = Table(box=None, padding=(0, 2), header_style="dim")
    for name in ("input", "unit", "RMS", "largest"):
        table.add_column(name, justify="left" if name in ("input", "unit") else "right")
    differences = found.differences()
    names = units(found.depth, len(found.answers[0].other.zeta_hat[1]))
    for name, unit, rms, most in zip(INPUTS, names, differences.rms, differences.most, strict=True):
        table.add_row(name, unit, *("-" if value is None else f"{value:.3g}" for value in (rms, most)))
    console.print(table)
    flown, other = found.limits()
    for name in sorted({*flown, *other}):
        line = f"limit {name}: {flown.get(name, 0.0):.1%} of the steps as flown, {other.get(name, 0.0):.1%} in the other law"
        console.print(Text(line), soft_wrap=True)
    console.print(Text(f"figure: {figure}"), soft_wrap=True)
