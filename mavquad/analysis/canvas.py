"""What the figures share: palette, axes that look alike, and a PNG that is there whole or not at all.

Colours are Okabe and Ito's, which stay apart for every kind of colour vision. matplotlib is imported by the functions
that need it, and only its Agg canvas: no display, no global state.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from mavquad.errors import RunFolderError

Axes = Any
Figure = Any

INK = "#222222"
MUTED = "#8a8a8a"
GRID = "#e6e6e6"
SHADE = "#f3f5f8"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
ORANGE = "#E69F00"
SKY = "#56B4E9"
CHANNEL_COLOURS = {"x": BLUE, "y": VERMILLION, "z": GREEN, "yaw": PURPLE}

_SIZE_INCHES = (16.0, 10.0)
_DOTS_PER_INCH = 110
_LEAST_EXTENT_M = 1.0  # a hover is not blown up until its millimetres fill the page


def new_figure(title: str, subtitle: str = "") -> Figure:
    """An empty page with its title."""
    # Where it cannot keep its font cache, matplotlib says so at length: nothing that concerns a flight.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as AggFigure

    figure = AggFigure(figsize=_SIZE_INCHES, dpi=_DOTS_PER_INCH, facecolor="white")
    FigureCanvasAgg(figure)
    figure.text(0.045, 0.97, title, fontsize=17, fontweight="bold", color=INK, va="center")
    figure.text(0.045, 0.942, subtitle, fontsize=11, color=MUTED, va="center")
    return figure


def time_panels(figure: Figure, heights: Sequence[float], left: float) -> list[Axes]:
    """Panels one above the other on one time axis, from `left` (fraction of the page) to its right edge."""
    grid = figure.add_gridspec(
        len(heights), 1, height_ratios=heights, left=left, right=0.985, top=0.895, bottom=0.06, hspace=0.14
    )
    panels = [figure.add_subplot(grid[0])]
    panels += [figure.add_subplot(grid[row], sharex=panels[0]) for row in range(1, len(heights))]
    for panel in panels:
        style(panel)
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("time (s)", fontsize=10, color=INK)
    # The last panel may carry long names instead of numbers.
    figure.align_ylabels(panels[:-1])
    return panels


def style(axes: Axes) -> None:
    """Quiet axes: no box, a light grid behind the data."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(MUTED)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=9, color=MUTED, labelcolor=INK)
    axes.margins(x=0.0)


def label(axes: Axes, text: str) -> None:
    """The quantity and its unit, on the left."""
    axes.set_ylabel(text, fontsize=10, color=INK)


def legend(axes: Axes, columns: int = 4) -> None:
    """A legend in one line right above the axes' upper right corner, off the data; none for a single line."""
    if len(axes.get_legend_handles_labels()[0]) > 1:
        axes.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 0.955),
            ncols=columns,
            fontsize=8.5,
            frameon=False,
            handlelength=1.6,
            columnspacing=1.4,
            borderaxespad=0.1,
        )


def least_span(axes: Axes, least: float) -> None:
    """Widen the vertical axis to at least `least`, so that noise about zero looks as small as it is."""
    low, high = axes.get_ylim()
    if (missing := least - (high - low)) > 0.0:
        axes.set_ylim(low - missing / 2, high + missing / 2)


def shade_spans(panels: Iterable[Axes], spans: Iterable[tuple[float, float]]) -> None:
    """Tint stretches of time (s) behind the data."""
    spans = list(spans)
    for panel in panels:
        for from_s, to_s in spans:
            panel.axvspan(from_s, to_s, color=SHADE, linewidth=0, zorder=0)


def true_scale(axes: Axes) -> None:
    """A map: east to the right, north up, one metre the same length on both; the limits fill the axes' box."""
    style(axes)
    axes.margins(0.08)
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    box = axes.get_position()
    ratio = box.width * _SIZE_INCHES[0] / (box.height * _SIZE_INCHES[1])
    height = max(north - south, (east - west) / ratio, _LEAST_EXTENT_M)
    axes.set_xlim((west + east - height * ratio) / 2, (west + east + height * ratio) / 2)
    axes.set_ylim((south + north - height) / 2, (south + north + height) / 2)
    axes.set_aspect("equal")
    axes.set_xlabel("east (m)", fontsize=10, color=INK)
    label(axes, "north (m)")


def save_png(figure: Figure, path: Path) -> None:
    """Write the page beside `path` and move it there when it is whole.

    Raises:
        RunFolderError: the folder cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        figure.savefig(part, format="png", metadata={"Software": "mavquad"})
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise RunFolderError(str(path), f"the figure cannot be written: {error.strerror or error}") from error
