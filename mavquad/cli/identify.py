"""`mavquad identify`: how a vehicle answers commands, from a log of a flight."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table
from rich.text import Text

from mavquad.analysis.identification import Estimate, Refused
from mavquad.analysis.identification_report import AXES, DepthReport, Identification, identify_log, toml_lines
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, InputError, LogError
from mavquad.tlog import read_records


def identify(path: Path, output: Path | None, own: bool, as_json: bool) -> int:
    """Identify and show; returns the exit code.

    Raises:
        InputError: the figure's name is not a PNG's.
        LogError: the log cannot be read, or says nothing about any axis.
    """
    if output is not None and output.suffix.lower() != ".png":
        raise InputError(f"--output: {str(output)!r} does not end with .png", "figures are PNG")
    found = identify_log(read_records(path), own)
    if isinstance(found, Refused):
        raise LogError(str(path), found.reason, "identification needs a flight with setpoints and ATTITUDE")
    if not any(report.fits for report in found.depths):
        raise LogError(str(path), _nothing(found), "fly something livelier: steps, a box, 20 s or more")
    if output is not None:
        _draw(found, output, path.name)
    if as_json:
        say(to_json({**found.to_json(), "figure": str(output) if output else None}))
    else:
        shown(lambda: _print(found, output))
    return EXIT_OK


def _nothing(found: Identification) -> str:
    named = [
        (name, fit.reason)
        for report in found.depths
        for name, fit in zip(AXES, report.axes, strict=True)
        if isinstance(fit, Refused)
    ]
    reasons = {reason for _, reason in named}
    words = reasons if len(reasons) == 1 else [f"{name}: {reason}" for name, reason in named]
    begin = "nothing can be identified"
    if all(report.own for report in found.depths):
        begin += " from the autopilot's own commands, and others are not in it, or not wanted"
    return f"{begin}: {'; '.join(words)}"


def _draw(found: Identification, output: Path, title: str) -> None:
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.identification_figure import identification_figure

    best = max(found.depths, key=lambda report: len(report.fits))
    identification_figure(found, best, output, title)


def _print(found: Identification, output: Path | None) -> None:
    console = QuietConsole(highlight=False)
    console.print(Text(_vehicle_words(found)), soft_wrap=True)
    for report in found.depths:
        console.print()
        console.print(Text(_command_words(report)), soft_wrap=True)
        console.print(_table(report))
        for name, fit in zip(AXES, report.axes, strict=True):
            if isinstance(fit, Refused):
                console.print(Text.assemble((f"{name}: ", "yellow"), fit.reason), soft_wrap=True)
        if report.fits:
            console.print()
            lines = [_delay_words(found, report), *toml_lines(found.settings(report))]
            console.print(Text("\n".join(lines)), soft_wrap=True)
    if output is not None:
        console.print(Text(f"\nfigure: {output}"), soft_wrap=True)


def _vehicle_words(found: Identification) -> str:
    words = (
        f"vehicle {found.vehicle[0]}/{found.vehicle[1]}, ATTITUDE at {found.answer_rate_hz:.1f} Hz,"
        f" {found.age_s * 1e3:.1f} ms old when it arrives"
    )
    if found.round_trip_s is None:
        return words + "\nclocks aligned by the earliest arrivals: ages leave out, and dead times include, the way down"
    return words + f"\nclocks aligned by TIMESYNC, round trip {found.round_trip_s * 1e3:.1f} ms"


def _command_words(report: DepthReport) -> str:
    followed_s = sum(to_s - from_s for from_s, to_s in report.spans)
    if report.own:
        return (
            f"the autopilot's own rate commands (ATTITUDE_TARGET), sampled at {report.command_rate_hz:.0f} Hz,"
            f" {followed_s:.0f} s in the air; dead times without the way up the link, coarse where it is below 50 Hz"
        )
    gain = "; gain in rad/s² at a control of 1" if report.depth == "torque" else ""
    return (
        f"depth {report.depth}: {report.commands} commands at {report.command_rate_hz:.0f} Hz, followed for"
        f" {followed_s:.0f} s; dead time from sending to the answer{gain}"
    )


def _table(report: DepthReport) -> Table:
    table = Table(box=None, padding=(0, 1), header_style="dim")
    for name in ("axis", "dead, ms", "lag, ms", "both, ms", "gain", "explained"):
        table.add_column(name, justify="left" if name == "axis" else "right", no_wrap=True)
    for name, fit in report.fits.items():
        times = (_milliseconds(estimate) for estimate in (fit.dead_s, fit.lag_s, fit.total_s))
        table.add_row(name, *times, f"{fit.gain.value:.4g} ± {fit.gain.error:.1g}", f"{fit.explained:.1%}")
    return table


def _milliseconds(estimate: Estimate) -> str:
    return f"{estimate.value * 1e3:.1f} ± {estimate.error * 1e3:.1f}"


def _delay_words(found: Identification, report: DepthReport) -> str:
    if found.round_trip_s is not None:
        up_ms = found.round_trip_s * 500.0
        return f"# delay: {found.age_s * 1e3:.1f} ms of age + {up_ms:.1f} ms up the link; the dead time is without the link"
    if report.own:
        return "# delay: the age beyond the link's least delay; add the link's way down and up"
    return "# delay: the age beyond the link's least delay; the link's ways down and up are in the dead times"
