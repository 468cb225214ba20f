"""`flight.png`: one flight of ours on one page; the path from above, and everything else over one time axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.log_figure import survey_figure
from mavquad.analysis.metrics import (
    SETTLED_POSITION_M,
    SETTLED_YAW_RAD,
    FlightMetrics,
    error_samples,
    flight_metrics,
    trace_error,
)
from mavquad.flight_record import TraceRow
from mavquad.types import CHANNELS

__all__ = ["flight_figure", "survey_figure"]

Z, YAW, X, Y = range(4)
_PANEL_HEIGHTS = (1.15, 1.4, 1.0, 1.2, 1.0, 1.0, 0.55)
_POWERS = {1: "", 2: "²", 3: "³", 4: "⁴"}
_NAMED_PHASE = 0.05  # part of the time axis that a phase must fill to carry its name
_CONTROL_LABELS = {"torque": "torque (norm.)", "rate": "body rates\n(rad/s)", "attitude": "attitude (rad)"}
_LEFT_COLUMN = (0.045, 0.06, 0.335, 0.835)  # left, bottom, width, height of the page


def flight_figure(
    rows: Sequence[TraceRow],
    events: Sequence[tuple[int, str]],
    path: Path | str,
    title: str,
    metrics: FlightMetrics | None = None,
) -> None:
    """Draw a flight.

    Args:
        rows: the trace, in the order of time.
        events: (stamp_us, text) of what happened, on the agent's clock; drawn as marks on the time axis.
        path: the PNG to write.
        title: first line of the page.
        metrics: the figures to print; of all the rows if not given.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    figure = canvas.new_figure(title, _subtitle(rows))
    if rows:
        times_s = [(row.stamp_us - rows[0].stamp_us) * 1e-6 for row in rows]
        _draw_map(figure, rows)
        _draw_metrics(figure, metrics or flight_metrics(error_samples(rows)))
        panels = canvas.time_panels(figure, _PANEL_HEIGHTS, left=0.445)
        _draw_panels(panels, times_s, rows)
        _draw_phases(panels, times_s, rows)
        _draw_events(panels, [((stamp_us - rows[0].stamp_us) * 1e-6, text) for stamp_us, text in events])
    canvas.save_png(figure, Path(path))


def _subtitle(rows: Sequence[TraceRow]) -> str:
    if not rows:
        return "the law was never in control: nothing to draw"
    return f"{(rows[-1].stamp_us - rows[0].stamp_us) * 1e-6:.1f} s under the law, {len(rows)} steps"


def _draw_map(figure: Figure, rows: Sequence[TraceRow]) -> None:
    left, bottom, width, height = _LEFT_COLUMN
    axes = figure.add_axes((left, bottom + 0.24, width, height - 0.24))
    for vectors, look in (
        ([row.reference for row in rows], {"color": canvas.INK, "linestyle": (0, (4, 3)), "linewidth": 1.1}),
        ([row.measured for row in rows], {"color": canvas.BLUE, "linewidth": 1.5}),
    ):
        axes.plot([-vector[Y] for vector in vectors], [vector[X] for vector in vectors], **look)
    axes.lines[0].set(label="reference", zorder=3)
    axes.lines[1].set_label("measured")
    for row, marker, text in ((rows[0], "o", "start"), (rows[-1], "s", "end")):
        axes.plot(
            -row.measured[Y],
            row.measured[X],
            marker,
            color=canvas.ORANGE,
            markeredgecolor="white",
            ms=9,
            label=text,
            linestyle="none",
            zorder=4,
        )
    canvas.true_scale(axes)
    axes.set_title("path from above", loc="left", fontsize=11, color=canvas.INK)
    canvas.legend(axes)


def _draw_metrics(figure: Figure, metrics: FlightMetrics) -> None:
    left, bottom, *_ = _LEFT_COLUMN
    degrees = None if metrics.yaw_rms_rad is None else math.degrees(metrics.yaw_rms_rad)
    lines = (
        ("position error, RMS", _quantity(metrics.position_rms_m, 100.0, " cm")),
        ("position error, largest", _quantity(metrics.position_max_m, 100.0, " cm")),
        ("yaw error, RMS", _quantity(degrees, 1.0, "°")),
        ("within 5 cm and 3° for 3 s after", _quantity(metrics.settle_s, 1.0, " s")),
    )
    for number, (name, value) in enumerate(lines):
        height = bottom + 0.135 - 0.032 * number
        figure.text(left, height, name, fontsize=11, color=canvas.INK)
        figure.text(left + 0.27, height, value, fontsize=13, fontweight="bold", color=canvas.INK, ha="right")
    note = "3-D norm against the reference, first 5 s of the law left out"
    figure.text(left, bottom, note, fontsize=9, color=canvas.MUTED)


def _quantity(value: float | None, factor: float, unit: str) -> str:
    return "–" if value is None else f"{value * factor:.1f}{unit}"


def _draw_panels(panels: Sequence[Axes], times_s: Sequence[float], rows: Sequence[TraceRow]) -> None:
    altitude, position, yaw, sigma, torque, thrust, limits = panels
    _draw_altitude(altitude, times_s, rows)
    errors = [trace_error(row) for row in rows]
    for channel in (X, Y, Z):
        _line(position, times_s, [error[channel] * 100.0 for error in errors], CHANNELS[channel])
    _line(yaw, times_s, [math.degrees(error[YAW]) for error in errors], "yaw")
    for panel, settled, least, text in (
        (position, SETTLED_POSITION_M * 100.0, 14.0, "position\nerror (cm)"),
        (yaw, math.degrees(SETTLED_YAW_RAD), 8.0, "yaw error (°)"),
    ):
        panel.axhspan(-settled, settled, color=canvas.GREEN, alpha=0.08, linewidth=0)
        canvas.least_span(panel, least)
        canvas.label(panel, text)
    _draw_disturbance(sigma, times_s, rows)
    for number, name in enumerate(("roll", "pitch", "yaw")):
        colour = canvas.CHANNEL_COLOURS[("y", "x", "yaw")[number]]
        torque.plot(times_s, [row.controls[number] for row in rows], color=colour, linewidth=0.7, label=name)
    canvas.label(torque, _CONTROL_LABELS[rows[0].depth])
    thrust.plot(times_s, [row.controls[3] for row in rows], color=canvas.CHANNEL_COLOURS["z"], linewidth=1.0)
    canvas.label(thrust, "thrust (norm.)")
    for panel in panels[1:-1]:
        canvas.legend(panel)
    _draw_limits(limits, times_s, rows)


def _line(axes: Axes, times_s: Sequence[float], values: Sequence[float], channel: str) -> None:
    axes.plot(times_s, values, color=canvas.CHANNEL_COLOURS[channel], linewidth=1.1, label=channel)


def _draw_altitude(axes: Axes, times_s: Sequence[float], rows: Sequence[TraceRow]) -> None:
    wanted = [row.reference[Z] for row in rows]
    axes.plot(times_s, [row.measured[Z] for row in rows], color=canvas.GREEN, linewidth=1.4, label="measured")
    axes.plot(times_s, wanted, color=canvas.INK, linestyle=(0, (4, 3)), linewidth=1.0, label="reference")
    canvas.least_span(axes, 1.0)
    canvas.label(axes, "altitude (m)")


def _draw_disturbance(axes: Axes, times_s: Sequence[float], rows: Sequence[TraceRow]) -> None:
    for channel in (X, Y, Z, YAW):
        _line(axes, times_s, [row.sigma[channel] for row in rows], CHANNELS[channel])
    place, yaw = (_POWERS[len(rows[0].zeta_hat[channel])] for channel in (Z, YAW))
    canvas.label(axes, f"σ (m/s{place};\nyaw rad/s{yaw})")


def _draw_limits(axes: Axes, times_s: Sequence[float], rows: Sequence[TraceRow]) -> None:
    """One line of marks for each limit that was ever active."""
    names = sorted({name for row in rows for name in row.limits})
    for height, name in enumerate(names):
        active_s = [time_s for time_s, row in zip(times_s, rows, strict=True) if name in row.limits]
        axes.plot(active_s, [height] * len(active_s), "|", color=canvas.VERMILLION, ms=7)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(-0.6, max(len(names), 1) - 0.4)
    axes.grid(False, axis="y")
    canvas.label(axes, "limits")
    if not names:
        axes.text(0.5, 0.5, "none was active", transform=axes.transAxes, ha="center", va="center", color=canvas.MUTED)


def _draw_phases(panels: Sequence[Axes], times_s: Sequence[float], rows: Sequence[TraceRow]) -> None:
    """Every other phase tinted, the name of each above the top panel."""
    pairs = list(zip(times_s, rows, strict=True))
    spans = [(name, list(group)) for name, group in groupby(pairs, key=lambda pair: pair[1].phase)]
    begins_s = [group[0][0] for _, group in spans] + [times_s[-1]]
    canvas.shade_spans(panels, [(begins_s[i], begins_s[i + 1]) for i in range(0, len(spans), 2)])
    for i, (name, _) in enumerate(spans):
        if begins_s[i + 1] - begins_s[i] < _NAMED_PHASE * (times_s[-1] - times_s[0]):
            continue
        middle_s = (begins_s[i] + begins_s[i + 1]) / 2
        panels[0].text(
            middle_s,
            1.03,
            name,
            transform=panels[0].get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=9,
            color=canvas.INK,
        )


def _draw_events(panels: Sequence[Axes], events: Sequence[tuple[float, str]]) -> None:
    """A thin line through all panels for each event, its text beside it in the altitude panel."""
    low_s, high_s = panels[0].get_xlim()
    for time_s, text in events:
        if not low_s <= time_s <= high_s:
            continue
        for panel in panels:
            panel.axvline(time_s, color=canvas.MUTED, linewidth=0.8, linestyle=":")
        panels[0].text(
            time_s,
            0.04,
            text,
            transform=panels[0].get_xaxis_transform(),
            rotation=90,
            va="bottom",
            ha="left",
            fontsize=8,
            color=canvas.MUTED,
        )
