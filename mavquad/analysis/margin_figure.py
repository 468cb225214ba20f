"""`mavquad tune --output`: maps of the margins over omega0 and kappa, the gains in force and the fastest ones marked.

kappa is drawn as its ratio to omega0: the observer leads the law, and what lies below a ratio of 1 is of no use.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.gain_search import PLACE, TURN, Gains
from mavquad.analysis.loop_spec import Kind
from mavquad.analysis.margin_map import MarginMap, margin_map
from mavquad.analysis.tune_report import TuneReport
from mavquad.protocol.streams import StreamParams

_PEAKS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
_SHADES = ("#08519c", "#2171b5", "#4292c6", "#6baed6", "#9ecae1", "#c6dbef", "#eaf1f8")
"""Blues of one hue, dark where the margin is good; the last is for all that is stable and above the last Ms."""
_DELAYS_MS = (5.0, 20.0, 50.0, 100.0, 200.0)
_UNSTABLE = "#f3e6df"


def margin_figure(reports: Sequence[TuneReport], streams: StreamParams, path: Path | str, title: str) -> None:
    """Draw the maps: a column for each depth, z, x and y above, yaw below.

    Args:
        reports: one for each depth.
        streams: rates of the measurements.
        path: the PNG to write.
        title: first line of the page.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    figure = canvas.new_figure(title, _subtitle(reports[0]))
    grid = figure.add_gridspec(2, len(reports), left=0.055, right=0.9, top=0.885, bottom=0.065, hspace=0.3, wspace=0.17)
    filled = None
    for column, report in enumerate(reports):
        for row, (kinds, words) in enumerate(((PLACE, "the worse of z and x, y"), (TURN, "yaw"))):
            axes = figure.add_subplot(grid[row, column])
            filled = _draw(axes, report, kinds, streams)
            axes.set_title(f"depth {report.depth}: {words}", loc="left", fontsize=11, color=canvas.INK)
    _explain(figure)
    scale = figure.add_axes((0.92, 0.065, 0.014, 0.82))
    bar = figure.colorbar(filled, cax=scale, ticks=_PEAKS)
    bar.set_label("Ms, peak of the sensitivity", fontsize=10, color=canvas.INK)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9, color=canvas.MUTED, labelcolor=canvas.INK)
    canvas.save_png(figure, Path(path))


def _explain(figure: Figure) -> None:
    """What the lines and the empty ground are, once for all maps."""
    from matplotlib.lines import Line2D

    figure.legend(
        handles=[
            Line2D([], [], color=canvas.INK, linewidth=0.9, label="delay margin"),
            Line2D([], [], color=canvas.ORANGE, linewidth=1.6, linestyle="dashed", label="limit of noise"),
            Line2D([], [], color=_UNSTABLE, marker="s", ms=10, linestyle="none", label="unstable"),
        ],
        loc="lower right",
        bbox_to_anchor=(0.905, 0.955),
        ncols=3,
        fontsize=9.5,
        frameon=False,
    )


def _subtitle(report: TuneReport) -> str:
    limits = report.limits
    law = report.law
    return (
        f"measurements {law.measured()}, delay {law.delay() * 1e3:g} ms; fastest gains with phase margin "
        f"{limits.phase_deg:g}° or more, delay margin {limits.delay_s * 1e3:g} ms or more, Ms {limits.peak:g} or less, "
        f"noise {limits.noise_share:.0%} of the input's level or less"
    )


def _draw(axes: Axes, report: TuneReport, kinds: tuple[Kind, ...], streams: StreamParams) -> object:
    in_force = report.channels[kinds[0]].gains
    fastest = report.turn if kinds is TURN else report.place
    marked = [in_force] if fastest is None else [in_force, fastest]
    found = margin_map(report.law, report.depth, streams, kinds, marked)
    filled = _shade(axes, found, report)
    _mark(axes, in_force, "o", canvas.ORANGE, "in force")
    if fastest is not None:
        _mark(axes, fastest, "*", canvas.VERMILLION, "fastest")
    axes.legend(loc="upper left", fontsize=8.5, frameon=True, framealpha=0.85, edgecolor="none")
    return filled


def _shade(axes: Axes, found: MarginMap, report: TuneReport) -> object:
    """Ms in shades, delay margins as lines, the limit of noise as a dashed one."""
    plane = (found.omega0_rad_s, found.ratio)
    axes.set_facecolor(_UNSTABLE)
    filled = axes.contourf(*plane, np.ma.masked_invalid(found.peak), levels=_PEAKS, colors=_SHADES, extend="max")
    delay_ms = np.ma.masked_where(~np.isfinite(found.peak), found.delay_s * 1e3)
    lines = axes.contour(*plane, delay_ms, levels=_DELAYS_MS, colors=canvas.INK, linewidths=0.9)
    axes.clabel(lines, fmt="%g ms", fontsize=8)
    share = np.ma.masked_invalid(found.noise_share)
    axes.contour(
        *plane,
        share,
        levels=[report.limits.noise_share],
        colors=canvas.ORANGE,
        linewidths=1.6,
        linestyles="dashed",
    )
    canvas.style(axes)
    axes.grid(False)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _plain_ticks(axes)
    axes.set_xlabel("omega0 (rad/s)", fontsize=10, color=canvas.INK)
    canvas.label(axes, "kappa / omega0")
    return filled


def _plain_ticks(axes: Axes) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def _mark(axes: Axes, gains: Gains, marker: str, colour: str, words: str) -> None:
    axes.plot(
        [gains.omega0_rad_s],
        [gains.kappa_rad_s / gains.omega0_rad_s],
        marker,
        color=colour,
        markeredgecolor="white",
        ms=15 if marker == "*" else 10,
        linestyle="none",
        label=f"{words}: {gains.omega0_rad_s:.3g}, {gains.kappa_rad_s:.3g} rad/s",
        zorder=5,
    )
