"""One page about the law in the shadow of somebody's flight: verdicts, estimates against the log's own, setpoints."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.law_shadow import LawShadow, LawTrack, Numbers, ShadowPhase, setpoint_names
from mavquad.analysis.rate_verdict import Verdict
from mavquad.types import Vec3

_PANEL_HEIGHTS = (1.0, 0.9, 0.9, 0.9, 1.0, 1.1, 1.1, 1.1)
_LEFT, _WIDTH = 0.03, 0.36
_AXES = (("north", "x"), ("west", "y"), ("up", "z"))
_NAMED_PHASE = 0.06
_TABLE_ROWS = 14


def law_shadow_figure(found: LawShadow, path: Path | str, title: str) -> None:
    """Draw it.

    Args:
        found: at least one phase.
        path: the PNG to write.
        title: first line of the page.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    figure = canvas.new_figure(title, _subtitle(found))
    _draw_table(figure, found.phases, ", ".join(found.takes))
    phases = [phase for phase in found.phases if phase.track.times_s]
    if phases:
        _draw_map(figure, phases)
        panels = canvas.time_panels(figure, _PANEL_HEIGHTS, left=0.465)
        _draw_panels(panels, phases)
        _draw_phases(panels, phases)
    canvas.save_png(figure, Path(path))


def _subtitle(found: LawShadow) -> str:
    thrust = "thrust taken to hold the hover" if found.hover_thrust_norm is None else "thrust from ATTITUDE_TARGET"
    depth = found.phases[0].depth if found.phases else "attitude"
    return (
        f"our law beside {found.sender[0]}/{found.sender[1]}, depth {depth} · {found.source or 'no positions'}, "
        f"{found.attitude_source or 'no attitudes'} · {thrust}"
    )


def _draw_table(figure: Figure, phases: Sequence[ShadowPhase], takes: str) -> None:
    """Whether the data would have done, phase by phase."""
    figure.text(_LEFT, 0.905, f"would this data have done? (takes {takes})", fontsize=11, color=canvas.INK)
    columns = (0.0, 0.2, 0.31, 0.42, 0.62, 0.82)
    rows = [("mode", "s", "Hz", *(verdict.depth for verdict in _some_verdicts(phases)))]
    for phase in phases[:_TABLE_ROWS]:
        hz = "/".join("–" if of.rate_hz is None else f"{of.rate_hz:.3g}" for of in (phase.positions, phase.attitudes))
        span = f"{phase.phase.from_s:.0f}–{phase.phase.to_s:.0f}"
        rows.append((phase.phase.mode, span, hz, *(verdict.words for verdict in phase.verdicts)))
    for number, row in enumerate(rows):
        for column, words in zip(columns, row, strict=False):
            colour = canvas.MUTED if number == 0 else canvas.VERMILLION if words.startswith("no:") else canvas.INK
            text = words.removeprefix("no: ").replace("omega0 ", "ω0 ≤ ").replace(" at most", "")
            figure.text(_LEFT + column * _WIDTH, 0.88 - 0.021 * number, text, fontsize=7.5, color=colour)
    if len(phases) > _TABLE_ROWS:
        figure.text(
            _LEFT, 0.88 - 0.021 * len(rows), f"and {len(phases) - _TABLE_ROWS} more", fontsize=7.5, color=canvas.MUTED
        )


def _some_verdicts(phases: Sequence[ShadowPhase]) -> Sequence[Verdict]:
    return next((phase.verdicts for phase in phases if phase.verdicts), ())


def _draw_map(figure: Figure, phases: Sequence[ShadowPhase]) -> None:
    axes = figure.add_axes((_LEFT + 0.02, 0.06, _WIDTH - 0.02, 0.44))
    for number, phase in enumerate(phases):
        for points, look, text in (
            (
                phase.track.reference_nwu_m,
                {"color": canvas.INK, "linestyle": (0, (4, 3)), "linewidth": 1.0},
                "reference",
            ),
            (phase.track.position_nwu_m, {"color": canvas.BLUE, "linewidth": 1.3}, "flown"),
        ):
            axes.plot([-y for _, y, _ in points], [x for x, _, _ in points], label="" if number else text, **look)
    canvas.true_scale(axes)
    canvas.legend(axes)
    axes.set_title("path from above", loc="left", fontsize=11, color=canvas.INK)


def _draw_panels(panels: Sequence[Axes], phases: Sequence[ShadowPhase]) -> None:
    altitude, *velocities, disturbance = panels[:5]
    _draw(altitude, phases, lambda track: [z for *_, z in track.reference_nwu_m], canvas.INK, "reference")
    _draw(altitude, phases, lambda track: [z for *_, z in track.position_nwu_m], canvas.GREEN, "flown")
    canvas.least_span(altitude, 1.0)
    canvas.label(altitude, "altitude (m)")
    for axis, (panel, (name, channel)) in enumerate(zip(velocities, _AXES, strict=True)):
        _draw(
            panel,
            phases,
            _axis_of(lambda track: track.logged_velocity_nwu_m_s, axis),
            canvas.INK,
            "the autopilot's own",
        )
        _draw(
            panel,
            phases,
            _axis_of(lambda track: track.velocity_nwu_m_s, axis),
            canvas.CHANNEL_COLOURS[channel],
            "observer",
        )
        canvas.least_span(panel, 0.4)
        canvas.label(panel, f"{name}\n(m/s)")
    for axis, (name, channel) in enumerate(_AXES):
        _draw(
            disturbance,
            phases,
            _axis_of(lambda track: track.disturbance_nwu_m_s2, axis),
            canvas.CHANNEL_COLOURS[channel],
            name,
        )
    canvas.least_span(disturbance, 1.0)
    canvas.label(disturbance, "disturbance\n(m/s²)")
    _draw_setpoints(panels[5:], phases)
    for panel in (altitude, velocities[0], disturbance, panels[5]):
        canvas.legend(panel)


def _draw_setpoints(panels: Sequence[Axes], phases: Sequence[ShadowPhase]) -> None:
    """Roll, pitch, and thrust where the depth has it, or yaw."""
    names = setpoint_names(phases[0].depth)
    shown = (0, 1, len(names) - 1)
    for panel, k in zip(panels, shown, strict=True):
        name, unit = names[k]
        factor, unit = (57.29578, unit.replace("rad", "°")) if "rad" in unit else (1.0, unit)
        colour = canvas.CHANNEL_COLOURS[("y", "x", "z")[shown.index(k)]]
        _draw(panel, phases, _column(lambda track: track.moved, k, factor), canvas.MUTED, "measured motion")
        _draw(panel, phases, _column(lambda track: track.own, k, factor), canvas.INK, "its own target")
        _draw(panel, phases, _column(lambda track: track.setpoints, k, factor), colour, "our law")
        canvas.least_span(panel, 4.0 if "°" in unit else 1.0)
        canvas.label(panel, f"{name.replace(' acceleration', ' acc.')}\n({unit})")


def _axis_of(vectors: Callable[[LawTrack], Sequence[Vec3]], axis: int) -> Callable[[LawTrack], Sequence[float]]:
    return lambda track: [vector[axis] for vector in vectors(track)]


def _column(
    rows: Callable[[LawTrack], Sequence[Numbers | None]], k: int, factor: float
) -> Callable[[LawTrack], Sequence[float]]:
    return lambda track: [math.nan if row is None else row[k] * factor for row in rows(track)]


def _draw(
    axes: Axes, phases: Sequence[ShadowPhase], values: Callable[[LawTrack], Sequence[float]], colour: str, text: str
) -> None:
    """One line a phase; the first has the name, if there is anything to see."""
    named = False
    for phase in phases:
        numbers = values(phase.track)
        seen = any(map(math.isfinite, numbers))
        axes.plot(
            phase.track.times_s,
            numbers,
            color=colour,
            linewidth=1.0,
            alpha=0.9,
            label=text if seen and not named else "_",
        )
        named = named or seen


def _draw_phases(panels: Sequence[Axes], phases: Sequence[ShadowPhase]) -> None:
    spans = [(phase.track.times_s[0], phase.track.times_s[-1]) for phase in phases]
    panels[0].set_xlim(spans[0][0], spans[-1][1])
    canvas.shade_spans(panels, spans[::2])
    whole_s = spans[-1][1] - spans[0][0]
    for phase, (from_s, to_s) in zip(phases, spans, strict=True):
        if to_s - from_s > _NAMED_PHASE * whole_s:
            look = {"fontsize": 8.5, "color": canvas.INK, "ha": "center", "va": "bottom"}
            axes = panels[0]
            axes.text((from_s + to_s) / 2, 1.2, phase.phase.mode, transform=axes.get_xaxis_transform(), **look)
