"""`mavquad replay` on a log of others: our law in the shadow of its flights."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from mavquad.analysis.law_shadow import LawShadow, ShadowPhase, law_shadow, setpoint_names
from mavquad.analysis.survey import SenderSurvey
from mavquad.cli.new_file import new_file
from mavquad.cli.replay_flight import OtherLaw
from mavquad.config import default_path
from mavquad.control.defaults import Autopilot
from mavquad.tlog import TlogContents


def shadow_of(contents: TlogContents, vehicle: SenderSurvey, other: OtherLaw) -> LawShadow:
    """The law of a configuration, by default of the one that comes with the package, over a log's flights.

    Raises:
        ConfigError: the configuration is wrong.
    """
    config = other.load(default_path())
    autopilot: Autopilot = "arducopter" if vehicle.autopilot == "MAV_AUTOPILOT_ARDUPILOTMEGA" else "px4"
    return law_shadow(contents, vehicle.sender, config.law.of(autopilot), config.guards)


def draw_shadow(found: LawShadow, path: Path, output: Path | None) -> Path | None:
    """The page of the shadow, beside that of the survey; None where there is no flight.

    Raises:
        RunFolderError: it cannot be written.
    """
    if not found.phases:
        return None
    figure = output.with_name(f"{output.stem}-shadow.png") if output else new_file(f"{path.stem}-shadow", ".png")
    # matplotlib takes half a second to import; nothing before this needs it.
    from mavquad.analysis.law_shadow_figure import law_shadow_figure

    law_shadow_figure(found, figure, f"{path.name}: our law in its shadow")
    return figure


def print_shadow(console: Console, found: LawShadow, figure: Path | None) -> None:
    """The verdicts, and what law and observer made of each phase."""
    if not found.phases:
        return
    console.print(Text("\nwould these poses have done for the law? (margins as of tune, and the guard on old poses)"))
    console.print(_verdicts(found))
    console.print(Text(f"whatever the data, this autopilot takes: {', '.join(found.takes)}"))
    for phase in found.phases:
        if phase.track.times_s:
            console.print(Text(_estimates(phase)), soft_wrap=True)
    if figure is not None:
        console.print(Text(f"figure: {figure}"), soft_wrap=True)


def _table(*columns: str) -> Table:
    table = Table(box=None, padding=(0, 1), pad_edge=False, header_style="dim")
    for name in columns:
        table.add_column(name)
    return table


def _verdicts(found: LawShadow) -> Table:
    depths = next(([verdict.depth for verdict in phase.verdicts] for phase in found.phases if phase.verdicts), [])
    table = _table("mode", "s", "position", "attitude", *depths)
    for phase in found.phases:
        cells = [Text(verdict.words, style="green" if verdict.would_do else "red") for verdict in phase.verdicts]
        rates = ["-" if of.rate_hz is None else f"{of.rate_hz:.3g} Hz" for of in (phase.positions, phase.attitudes)]
        table.add_row(phase.phase.mode, _span(phase), *rates, *cells)
    return table


def _estimates(phase: ShadowPhase) -> str:
    """What observer and law made of one phase."""
    has_own = any(value is not None for value in phase.own_rms)
    names = setpoint_names(phase.depth)
    differences = phase.own_rms if has_own else phase.moved_rms
    setpoints = ", ".join(
        f"{name} {value:.2f} {unit}"
        for (name, unit), value in zip(names, differences, strict=True)
        if value is not None
    )
    lines = [
        f"\n{phase.phase.mode} {_span(phase)} s, reference: {phase.reference}, at most {phase.away_m:.1f} m away",
        f"  velocity minus the autopilot's own, RMS N/W/U: {_numbers(phase.velocity_rms_m_s)} m/s",
        f"  disturbance N/W/U: mean {_numbers(phase.disturbance_mean_m_s2)}, RMS difference to what its own velocity "
        f"amounts to {_numbers(phase.disturbance_rms_m_s2)} m/s²",
        f"  setpoints minus {'its own' if has_own else 'the motion measured'}, RMS: {setpoints or '-'}",
    ]
    if phase.limits:
        lines.append("  at limits: " + ", ".join(f"{name} {share:.0%}" for name, share in phase.limits.items()))
    return "\n".join(lines)


def _span(phase: ShadowPhase) -> str:
    return f"{phase.phase.from_s:.0f}-{phase.phase.to_s:.0f}"


def _numbers(values: tuple[float | None, ...]) -> str:
    return "-" if all(value is None for value in values) else "/".join("-" if v is None else f"{v:.2f}" for v in values)
