"""One page about an identification: command, answer and fitted model of each axis over its liveliest stretch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.identification import AxisFit, Refused, Signal
from mavquad.analysis.identification_model import Array
from mavquad.analysis.identification_report import AXES, DepthReport, Identification
from mavquad.types import Depth

STRETCH_S = 6.0
_COLOURS = (canvas.BLUE, canvas.VERMILLION, canvas.PURPLE)
_ANSWERS: dict[Depth, tuple[str, float]] = {
    "torque": ("rate (°/s)", math.degrees(1.0)),
    "rate": ("rate (°/s)", math.degrees(1.0)),
    "attitude": ("angle (°)", math.degrees(1.0)),
}


def identification_figure(found: Identification, report: DepthReport, path: Path | str, title: str) -> None:
    """Draw one kind of command: a row for each axis, what it answered on the left, its figures on the right.

    Args:
        found: the whole log.
        report: the commands to draw.
        path: the PNG to write.
        title: first line of the page.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    figure = canvas.new_figure(title, _subtitle(found, report))
    grid = figure.add_gridspec(len(AXES), 1, left=0.06, right=0.775, top=0.885, bottom=0.06, hspace=0.32)
    for row, (name, fit, command) in enumerate(zip(AXES, report.axes, report.commanded, strict=True)):
        axes = figure.add_subplot(grid[row])
        canvas.style(axes)
        box = axes.get_position()
        _write_figures(figure, fit, report.depth, box.y1)
        if isinstance(fit, Refused):
            axes.text(0.5, 0.5, fit.reason, transform=axes.transAxes, ha="center", color=canvas.MUTED, fontsize=11)
            canvas.label(axes, name)
            axes.set_xticks([])
            axes.set_yticks([])
        else:
            _draw(axes, fit, command, report.depth, _COLOURS[row])
            quantity, _ = _ANSWERS[report.depth]
            canvas.label(axes, f"{name} {quantity}")
    axes.set_xlabel("time since the log began (s)", fontsize=10, color=canvas.INK)
    canvas.save_png(figure, Path(path))


def _subtitle(found: Identification, report: DepthReport) -> str:
    whose = "the autopilot's own commands" if report.own else f"commands of depth {report.depth}"
    clock = "by arrivals" if found.round_trip_s is None else "by TIMESYNC"
    return (
        f"{whose} at {report.command_rate_hz:.0f} Hz, ATTITUDE at {found.answer_rate_hz:.0f} Hz,"
        f" {found.age_s * 1e3:.0f} ms old when it arrives · clocks aligned {clock}"
    )


def _draw(axes: Axes, fit: AxisFit, command: Signal, depth: Depth, colour: str) -> None:
    from_s, to_s = liveliest(fit.times_s, fit.answer - np.mean(fit.answer))
    _, unit = _ANSWERS[depth]
    shown = (fit.times_s >= from_s) & (fit.times_s <= to_s)
    times_s = _with_gaps(fit.times_s[shown])
    axes.plot(
        times_s, _gapped(fit.times_s[shown], fit.answer[shown]) * unit, color=canvas.INK, linewidth=0.9, label="answer"
    )
    axes.plot(times_s, _gapped(fit.times_s[shown], fit.model[shown]) * unit, color=colour, linewidth=1.6, label="model")
    _draw_command(axes, command, (from_s, to_s), depth, unit)
    axes.set_xlim(from_s, to_s)
    canvas.legend(axes)


def _draw_command(axes: Axes, command: Signal, stretch: tuple[float, float], depth: Depth, unit: float) -> None:
    """Commands in the answer's unit share its axis; torques have one of their own."""
    inside = (command.times_s >= stretch[0]) & (command.times_s <= stretch[1])
    look = {"color": canvas.MUTED, "linewidth": 0.8, "drawstyle": "steps-post"}
    if depth != "torque":
        axes.plot(command.times_s[inside], command.values[inside] * unit, label="command", **look)
        return
    own = axes.twinx()
    for side in ("top", "left", "right", "bottom"):
        own.spines[side].set_visible(False)
    own.tick_params(labelsize=8, color=canvas.MUTED, labelcolor=canvas.MUTED)
    own.plot(command.times_s[inside], command.values[inside], **look)
    own.set_ylabel("torque, normalised", fontsize=9, color=canvas.MUTED)
    axes.plot([], [], label="command (right)", **look)
    axes.set_zorder(own.get_zorder() + 1)
    axes.patch.set_visible(False)


def liveliest(times_s: Array, values: Array) -> tuple[float, float]:
    """The `STRETCH_S` in which the values have the most power, s."""
    starts_s = np.arange(times_s[0], max(times_s[-1] - STRETCH_S, times_s[0]) + 1e-9, 0.5)
    power = np.concatenate(([0.0], np.cumsum(values * values)))
    bounds = np.searchsorted(times_s, np.stack([starts_s, starts_s + STRETCH_S]))
    best_s = float(starts_s[int(np.argmax(power[bounds[1]] - power[bounds[0]]))])
    return best_s, min(best_s + STRETCH_S, float(times_s[-1]))


def _breaks(times_s: Array) -> npt.NDArray[np.intp]:
    return np.flatnonzero(np.diff(times_s) > 5.0 * np.median(np.diff(times_s))) + 1


def _with_gaps(times_s: Array) -> Array:
    return np.insert(times_s, _breaks(times_s), np.nan)


def _gapped(times_s: Array, values: Array) -> Array:
    return np.insert(values, _breaks(times_s), np.nan)


def _write_figures(figure: Figure, fit: AxisFit | Refused, depth: Depth, top: float) -> None:
    if isinstance(fit, Refused):
        return
    per = "rad/s² per unit" if depth == "torque" else ""
    lines: Sequence[tuple[str, str]] = (
        ("dead time", f"{fit.dead_s.value * 1e3:.1f} ± {fit.dead_s.error * 1e3:.1f} ms"),
        ("lag", f"{fit.lag_s.value * 1e3:.1f} ± {fit.lag_s.error * 1e3:.1f} ms"),
        ("both", f"{fit.total_s.value * 1e3:.1f} ± {fit.total_s.error * 1e3:.1f} ms"),
        ("gain", f"{fit.gain.value:.3g} ± {fit.gain.error:.2g} {per}".strip()),
        ("explained", f"{fit.explained:.1%} of {fit.seconds:.0f} s"),
    )
    for number, (name, value) in enumerate(lines):
        height = top - 0.022 - 0.034 * number
        figure.text(0.822, height, name, fontsize=10, color=canvas.MUTED)
        figure.text(0.985, height, value, fontsize=10, color=canvas.INK, ha="right")
