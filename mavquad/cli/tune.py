"""`mavquad tune`: margins of the law on the configured link, and the fastest gains that keep given ones."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mavquad.analysis.gain_search import Gains, Limits
from mavquad.analysis.margin_check import is_short
from mavquad.analysis.margins import DELAY_MAX_S
from mavquad.analysis.tune_report import NAMES, ChannelReport, TuneReport, tune_report
from mavquad.cli.flight import load_config
from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.config import Config, Override, with_overrides
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, InputError
from mavquad.schema import parse_section, read_toml

_OUTPUT_UNITS = {"vertical": (1e3, "mm"), "horizontal": (1e3, "mm"), "yaw": (57.29578, "deg")}
_INPUT_UNITS = {"torque": "rad/s²", "rate": "rad/s", "attitude": "rad"}


@dataclass(frozen=True, slots=True)
class TuneOptions:
    """What is done with the result: the map, the file of the fastest gains, whether it may be overwritten."""

    output: Path | None = None
    write: Path | None = None
    force: bool = False
    as_json: bool = False


def limits_of(phase_deg: float | None, delay_ms: float | None, peak: float | None) -> Limits:
    """The margins to keep; what is not given is as usual.

    Raises:
        InputError: a margin that no loop can have.
    """
    usual = Limits()
    limits = Limits(
        phase_deg=usual.phase_deg if phase_deg is None else phase_deg,
        delay_s=usual.delay_s if delay_ms is None else delay_ms * 1e-3,
        peak=usual.peak if peak is None else peak,
    )
    if not 0.0 <= limits.phase_deg <= 90.0:
        raise InputError(f"--phase-margin-deg: {limits.phase_deg:g} is not between 0 and 90")
    if not 0.0 <= limits.delay_s <= DELAY_MAX_S:
        raise InputError(f"--delay-margin-ms: {limits.delay_s * 1e3:g} is not between 0 and {DELAY_MAX_S * 1e3:g}")
    if not limits.peak > 1.0:
        raise InputError(f"--ms: {limits.peak:g} is not greater than 1, and every loop's peak is")
    return limits


def tune(path: Path | None, overrides: list[Override], limits: Limits, options: TuneOptions) -> int:
    """Analyse and show; returns the exit code.

    Raises:
        ConfigError: the configuration is wrong.
        InputError: a file is in the way, or no gains keep the margins and a file of them is wanted.
        RunFolderError: the figure cannot be written.
    """
    _check_files(options)
    config, _ = load_config(path, overrides)
    if options.write is not None and config.law.depth == "auto":
        raise InputError("--write: law.depth is auto, and gains are for one depth", "say which: --depth torque")
    reports = [tune_report(config.law, depth, config.streams, limits) for depth in config.law.depths]
    if options.output is not None:
        _draw(reports, config, options.output)
    if options.as_json:
        say(to_json(_summary(reports, options)))
    else:
        shown(lambda: _print(reports, config))
    if options.write is not None:
        _write(path, overrides, reports[0], options.write)
    if not options.as_json:
        for name, file in (("map", options.output), ("gains", options.write)):
            if file is not None:
                shown(lambda words=f"{name}: {file}": QuietConsole(highlight=False).print(Text(words), soft_wrap=True))  # type: ignore[misc]
    return EXIT_OK


def _check_files(options: TuneOptions) -> None:
    """Before seconds of work: what would only fail after them."""
    if options.output is not None and options.output.suffix.lower() != ".png":
        raise InputError(f"--output: {str(options.output)!r} does not end with .png", "figures are PNG")
    if options.write is not None and options.write.exists() and not options.force:
        raise InputError(f"--write: {options.write} exists", "--force overwrites it")


def _draw(reports: Sequence[TuneReport], config: Config, output: Path) -> None:
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.margin_figure import margin_figure

    margin_figure(reports, config.streams, output, "Margins of the law")


def _summary(reports: Sequence[TuneReport], options: TuneOptions) -> dict[str, Any]:
    return {
        "depths": [report.to_json() for report in reports],
        "map": str(options.output) if options.output else None,
        "written": str(options.write) if options.write else None,
    }


# ---------------------------------------------------------------------- the file


def _write(path: Path | None, overrides: Sequence[Override], report: TuneReport, target: Path) -> None:
    """The user's own configuration with the fastest gains in it; whole or not at all."""
    settings = report.settings()
    if settings is None:
        raise InputError("--write: no gains keep these margins", "ask for less with --ms, --phase-margin-deg or --set")
    tables = with_overrides(read_toml(path) if path else {}, overrides)
    tables["law"] = {**tables.get("law", {}), **settings}
    parse_section(Config, tables, str(target))
    text = f"# {_limits_words(report.limits)}\n{tomli_w.dumps(tables)}"
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputError(f"--write: {target} cannot be written: {error.strerror or error}") from None


# ---------------------------------------------------------------------- the tables


def _limits_words(limits: Limits) -> str:
    return (
        f"fastest gains with phase margin >= {limits.phase_deg:g} deg, delay margin >= {limits.delay_s * 1e3:g} ms, "
        f"Ms <= {limits.peak:g}; noise <= {limits.noise_share:.0%} of the input's level, "
        f"full speed of approach <= {limits.approach_share:.0%} of it"
    )


def _print(reports: Sequence[TuneReport], config: Config) -> None:
    console = QuietConsole(highlight=False)
    law, streams = config.law, config.streams
    console.print(
        Text(
            f"measurements {law.measured()}, position {streams.position_hz:g} Hz, attitude {streams.attitude_hz:g} Hz, "
            f"delay {law.delay() * 1e3:g} ms; dead time and lag as the law is told"
        ),
        soft_wrap=True,
    )
    console.print(_margin_table(reports))
    console.print(_noise_table(reports))
    console.print(Text(f"\n{_limits_words(reports[0].limits)}"), soft_wrap=True)
    _print_fastest(console, reports)


def _table(columns: Sequence[str]) -> Table:
    table = Table(box=None, padding=(0, 1), collapse_padding=True, pad_edge=False, header_style="dim")
    for number, name in enumerate(columns):
        table.add_column(name, justify="left" if number < 2 else "right", no_wrap=True)
    return table


def _margin_table(reports: Sequence[TuneReport]) -> Table:
    table = _table(
        ("\ndepth", "\nchannel", "omega0\nrad/s", "kappa\nrad/s", "largest\n|λ|", "slowest\ns", "gain\nfactor",
         "phase\ndeg", "delay\nms", "\nMs")
    )  # fmt: skip
    for report in reports:
        for kind, channel in report.channels.items():
            table.add_row(
                report.depth, NAMES[kind], *_margin_cells(channel), style="red" if is_short(channel.margins) else ""
            )
    return table


def _margin_cells(channel: ChannelReport) -> list[str]:
    found, gains = channel.margins, channel.gains
    cells = [f"{gains.omega0_rad_s:.3g}", f"{gains.kappa_rad_s:.3g}"]
    if not found.stable:
        return [*cells, f"{found.spectral_radius:.4f}", "unstable", "-", "-", "-", "-"]
    more = "> " if found.delay_s >= DELAY_MAX_S else ""
    return [
        *cells,
        f"{found.spectral_radius:.4f}",
        f"{found.slowest_s:.2f}",
        f"{found.gain_low:.2f}-{found.gain_high:.2f}",
        f"{found.phase_deg:.0f}",
        f"{more}{found.delay_s * 1e3:.0f}",
        f"{found.peak:.2f}",
    ]


def _noise_table(reports: Sequence[TuneReport]) -> Table:
    table = _table(("\ndepth", "\nchannel", "noise, RMS\nof the output", "\nof w", "\nof the input", "of its level\n%"))
    for report in reports:
        for kind, channel in report.channels.items():
            table.add_row(report.depth, NAMES[kind], *_noise_cells(report, channel))
    return table


def _noise_cells(report: TuneReport, channel: ChannelReport) -> list[str]:
    if channel.noise is None or channel.share is None:
        return ["-"] * 4
    kind = channel.spec.kind
    scale, unit = _OUTPUT_UNITS[kind]
    length = channel.spec.tune.spec.length
    angle = "rad" if kind == "yaw" else "m"
    inputs = {"vertical": "m/s²", "horizontal": _INPUT_UNITS[report.depth], "yaw": "rad/s²" if length > 1 else "rad/s"}
    return [
        f"{channel.noise.output * scale:.2f} {unit}",
        f"{channel.noise.command:.3g} {angle}/s{_power(length)}",
        f"{channel.noise.physical:.2g} {inputs[kind]}",
        f"{channel.share * 100.0:.1f}",
    ]


def _power(length: int) -> str:
    return {1: "", 2: "²", 3: "³", 4: "⁴"}[length]


def _print_fastest(console: Console, reports: Sequence[TuneReport]) -> None:
    table = _table(("depth", "channels", "omega0", "kappa"))
    for report in reports:
        for names, gains in (("z, x, y", report.place), ("yaw", report.turn)):
            table.add_row(report.depth, names, *_gain_cells(gains))
    console.print(table)


def _gain_cells(gains: Gains | None) -> list[str]:
    return ["none", "-"] if gains is None else [f"{gains.omega0_rad_s:.3g}", f"{gains.kappa_rad_s:.3g}"]
