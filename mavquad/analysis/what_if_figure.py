"""Another law beside a flight, on one page: its inputs over those that acted, its estimates over the flown ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.what_if import INPUTS, Answer, WhatIf, units
from mavquad.flight_record import TraceRow

_PANEL_HEIGHTS = (1.0, 1.2, 1.2, 1.2, 1.0, 0.55, 0.55)
_SHOWN = (2, 3, 0, 1)  # roll, pitch, thrust, yaw of U
_COLOURS = {"roll": canvas.VERMILLION, "pitch": canvas.BLUE, "thrust": canvas.GREEN, "yaw": canvas.PURPLE}
_LEFT, _WIDTH = 0.045, 0.3
_LINES_FROM = 0.86
_EXCERPT_S = 3.0


def what_if_figure(found: WhatIf, path: Path | str, title: str, other: str) -> None:
    """Draw it.

    Args:
        found: at least one step.
        path: the PNG to write.
        title: first line of the page.
        other: what the other law is, in words.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    figure = canvas.new_figure(title, f"{len(found.answers)} steps, {len(found.counted)} of them flying · {other}")
    if found.answers:
        _draw_words(figure, found)
        panels = canvas.time_panels(figure, _PANEL_HEIGHTS, left=0.43)
        start_us = found.answers[0].flown.stamp_us
        times_s = [(answer.flown.stamp_us - start_us) * 1e-6 for answer in found.answers]
        _draw_panels(panels, found, times_s)
        _draw_excerpt(figure, found, times_s)
    canvas.save_png(figure, Path(path))


def _draw_words(figure: Figure, found: WhatIf) -> None:
    """Differences and limits in numbers."""
    acted = "the flown inputs" if found.same_inputs else f"the motion measured (flown at depth {found.flown_depth})"
    lines: list[tuple[str, ...]] = [
        ("law, other minus what acted", "", ""),
        (f"acted: {acted}", "", ""),
        ("", "", ""),
        ("", "RMS", "largest"),
    ]
    differences = found.differences()
    names = units(found.depth, len(found.answers[0].other.zeta_hat[1]))
    for k in _SHOWN:
        values = [_number(of[k]) for of in (differences.rms, differences.most)]
        lines.append((f"{INPUTS[k]} ({names[k]})", *values))
    flown, other = found.limits()
    lines += [("", "", ""), ("steps at a limit", "flown", "other")]
    for name in sorted({*flown, *other}) or ["none"]:
        lines.append((name, f"{flown.get(name, 0.0):.1%}", f"{other.get(name, 0.0):.1%}"))
    for number, (name, *values) in enumerate(lines):
        height = _LINES_FROM - 0.027 * number
        figure.text(_LEFT, height, name, fontsize=10.5, color=canvas.INK)
        for value, right in zip(values, (0.75, 1.0), strict=True):
            figure.text(_LEFT + right * _WIDTH, height, value, fontsize=10.5, color=canvas.INK, ha="right")
    note = "the other law is asked at each step and told what acted:\neach answer has the flown past behind it"
    figure.text(_LEFT, 0.395, note, fontsize=8.5, color=canvas.MUTED, va="bottom")


def _draw_excerpt(figure: Figure, found: WhatIf, times_s: Sequence[float]) -> None:
    """The seconds around the largest difference in roll or pitch, where single steps can be told apart."""
    answers = found.answers
    differences = {
        (abs(a.other.input[k] - a.acted[k]), number, k) for number, a in enumerate(answers) if a.counts for k in (2, 3)
    }
    if not differences:
        return
    _, middle, k = max(differences)
    chosen = [i for i, time_s in enumerate(times_s) if abs(time_s - times_s[middle]) <= _EXCERPT_S / 2]
    axes = figure.add_axes((_LEFT, 0.06, _WIDTH, 0.27))
    canvas.style(axes)
    at_s = [times_s[i] for i in chosen]
    words = _words(found)
    _compare(
        axes, at_s, [answers[i].acted[k] for i in chosen], [answers[i].other.input[k] for i in chosen],
        _COLOURS[INPUTS[k]], words,
    )  # fmt: skip
    unit = units(found.depth, len(answers[0].other.zeta_hat[1]))[k]
    axes.set_title(f"{INPUTS[k]} ({unit}) around the largest difference", loc="left", fontsize=10, color=canvas.INK)
    axes.set_xlabel("time (s)", fontsize=10, color=canvas.INK)
    axes.legend(fontsize=8.5, frameon=False, loc="upper right")


def _words(found: WhatIf) -> tuple[str, str]:
    return ("acted" if found.same_inputs else "measured motion", "other law")


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _draw_panels(panels: Sequence[Axes], found: WhatIf, times_s: Sequence[float]) -> None:
    height, *inputs, limits_flown, limits_other = panels
    answers = found.answers
    _compare(height, times_s, [a.flown.reference[0] for a in answers], [a.flown.measured[0] for a in answers], canvas.GREEN,
             ("reference", "measured"))  # fmt: skip
    canvas.least_span(height, 1.0)
    canvas.label(height, "altitude (m)")
    canvas.legend(height)
    names = units(found.depth, len(answers[0].other.zeta_hat[1]))
    words = _words(found)
    for panel, k in zip(inputs, _SHOWN, strict=True):
        name = INPUTS[k]
        _compare(
            panel, times_s, [a.acted[k] for a in answers], [a.other.input[k] for a in answers], _COLOURS[name], words
        )
        canvas.label(panel, f"{name}\n({names[k]})")
    canvas.legend(inputs[0])
    _draw_limits(limits_flown, times_s, [a.flown for a in answers], "limits,\nflown")
    _draw_limits(limits_other, times_s, [a.other for a in answers], "limits,\nother")
    _draw_control(panels, times_s, answers)


def _compare(
    axes: Axes,
    times_s: Sequence[float],
    dark: Sequence[float],
    coloured: Sequence[float],
    colour: str,
    labels: tuple[str, str],
) -> None:
    axes.plot(times_s, dark, color=canvas.INK, linewidth=0.8, label=labels[0])
    axes.plot(times_s, coloured, color=colour, linewidth=1.0, alpha=0.85, label=labels[1])


def _draw_limits(axes: Axes, times_s: Sequence[float], rows: Sequence[TraceRow], text: str) -> None:
    names = sorted({name for row in rows for name in row.limits})
    for height, name in enumerate(names):
        active_s = [time_s for time_s, row in zip(times_s, rows, strict=True) if name in row.limits]
        axes.plot(active_s, [height] * len(active_s), "|", color=canvas.VERMILLION, ms=7)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(-0.6, max(len(names), 1) - 0.4)
    axes.grid(False, axis="y")
    canvas.label(axes, text)


def _draw_control(panels: Sequence[Axes], times_s: Sequence[float], answers: Sequence[Answer]) -> None:
    """The time before the flown law was flying is tinted."""
    begun = next((time_s for time_s, a in zip(times_s, answers, strict=True) if a.counts), times_s[-1])
    canvas.shade_spans(panels, [(times_s[0], begun)])
