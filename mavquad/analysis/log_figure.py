"""One page about a log of someone else: where its vehicle went, what the observer makes of it, and who spoke."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from mavquad.analysis import canvas
from mavquad.analysis.canvas import Axes, Figure
from mavquad.analysis.shadow import Shadow, ShadowTrack
from mavquad.analysis.survey import SenderSurvey, Survey

_PANEL_HEIGHTS = (1.2, 1.0, 1.0, 1.0, 1.0, 0.9)
_LEFT, _WIDTH = 0.045, 0.335


def survey_figure(survey: Survey, shadow: Shadow | None, path: Path | str, title: str) -> None:
    """Draw a log: path from above, messages, and over time altitude, velocity, acceleration and yaw rate.

    Args:
        survey: who is in it.
        shadow: the observer over the main vehicle's poses; None (or one without tracks) draws the messages alone.
        path: the PNG to write.
        title: first line of the page.

    Raises:
        RunFolderError: the PNG cannot be written.
    """
    tracks = [track for track in shadow.tracks if track.velocity_nwu_m_s] if shadow else []
    figure = canvas.new_figure(title, _subtitle(survey, located=bool(tracks)))
    vehicle = survey.main_vehicle()
    if shadow and tracks:
        _draw_map(figure, tracks)
        panels = canvas.time_panels(figure, _PANEL_HEIGHTS, left=0.445)
        _draw_panels(panels, shadow, tracks)
        canvas.shade_spans(panels, [(span.from_s, span.to_s) for span in vehicle.armed_spans] if vehicle else [])
        _clip_time(panels, tracks)
        _label_armed(panels[0], vehicle)
    if vehicle:
        _draw_messages(figure, vehicle, survey.duration_s, alone=not tracks)
    canvas.save_png(figure, Path(path))


def _subtitle(survey: Survey, located: bool) -> str:
    senders = ", ".join(_who(sender) for sender in survey.senders[:4])
    more = f" and {len(survey.senders) - 4} more" if len(survey.senders) > 4 else ""
    damage = f" · {survey.bad_bytes} bad bytes" if survey.bad_bytes else ""
    blind = "" if located else " · no usable positions"
    return f"{survey.frames} frames in {survey.duration_s:.0f} s{damage} · {senders}{more}{blind}"


def _who(sender: SenderSurvey) -> str:
    kind = sender.vehicle_type.removeprefix("MAV_TYPE_").replace("_", " ").lower()
    autopilot = sender.autopilot.removeprefix("MAV_AUTOPILOT_") if sender.is_vehicle else ""
    described = " ".join(filter(None, (autopilot.replace("ARDUPILOTMEGA", "ArduPilot"), kind)))
    return f"{sender.sender[0]}/{sender.sender[1]} {described}".strip()


def _draw_map(figure: Figure, tracks: Sequence[ShadowTrack]) -> None:
    axes = figure.add_axes((_LEFT, 0.415, _WIDTH, 0.47))
    for track in tracks:
        east_m = [-y for _, y, _ in track.position_nwu_m]
        axes.plot(east_m, [x for x, _, _ in track.position_nwu_m], color=canvas.BLUE, linewidth=1.5)
    for track, index, marker, text in ((tracks[0], 0, "o", "start"), (tracks[-1], -1, "s", "end")):
        x, y, _ = track.position_nwu_m[index]
        look = {"color": canvas.ORANGE, "markeredgecolor": "white", "markersize": 9, "linestyle": "none"}
        axes.plot(-y, x, marker, label=text, zorder=4, **look)
    canvas.true_scale(axes)
    axes.set_title("path from above", loc="left", fontsize=11, color=canvas.INK)
    canvas.legend(axes)


def _draw_panels(panels: Sequence[Axes], shadow: Shadow, tracks: Sequence[ShadowTrack]) -> None:
    altitude, north, west, up, acceleration, yaw_rate = panels
    for track in tracks:
        altitude.plot(track.times_s, [z for *_, z in track.position_nwu_m], color=canvas.GREEN, linewidth=1.4)
    canvas.least_span(altitude, 1.0)
    canvas.label(altitude, "altitude (m)")
    rms = shadow.velocity_rms_m_s
    for axis, (panel, name) in enumerate(((north, "north"), (west, "west"), (up, "up"))):
        colour = canvas.CHANNEL_COLOURS["xyz"[axis]]
        for track in tracks:
            observed = [velocity[axis] for velocity in track.velocity_nwu_m_s]
            logged = [velocity[axis] for velocity in track.logged_velocity_nwu_m_s]
            _compare(panel, track.times_s, observed, logged, colour, first=track is tracks[0])
        canvas.least_span(panel, 0.4)
        canvas.label(panel, f"{name}\n(m/s)")
        _note(panel, "velocity: RMS difference", rms[axis], "m/s")
    canvas.legend(north)
    _draw_accelerations(acceleration, tracks)
    for track in (track for track in shadow.tracks if track.yaw_rate_rad_s):
        rates = [[math.degrees(v) for v in s] for s in (track.yaw_rate_rad_s, track.logged_yaw_rate_rad_s)]
        _compare(yaw_rate, track.heading_times_s, rates[0], rates[1], canvas.PURPLE, first=track is tracks[0])
    canvas.least_span(yaw_rate, 4.0)
    canvas.label(yaw_rate, "yaw rate\n(°/s)")
    degrees = None if shadow.yaw_rate_rms_rad_s is None else math.degrees(shadow.yaw_rate_rms_rad_s)
    _note(yaw_rate, "RMS difference", degrees, "°/s")
    canvas.legend(yaw_rate)


def _compare(
    axes: Axes, times_s: Sequence[float], observed: Sequence[float], logged: Sequence[float], colour: str, first: bool
) -> None:
    """The log's own in thin dark, the observer's over it in colour."""
    axes.plot(times_s, logged, color=canvas.INK, linewidth=0.8, label="the log's own" if first else None)
    axes.plot(times_s, observed, color=colour, linewidth=1.2, alpha=0.85, label="observer" if first else None)


def _note(axes: Axes, what: str, value: float | None, unit: str) -> None:
    if value is not None:
        text = f"{what} {value:.2g} {unit}"
        axes.text(0.0, 1.02, text, transform=axes.transAxes, fontsize=8.5, color=canvas.MUTED, va="bottom")


def _draw_accelerations(axes: Axes, tracks: Sequence[ShadowTrack]) -> None:
    for axis, name in enumerate(("north", "west", "up")):
        for track in tracks:
            values = [acceleration[axis] for acceleration in track.acceleration_nwu_m_s2]
            label = name if track is tracks[0] else None
            axes.plot(track.times_s, values, color=canvas.CHANNEL_COLOURS["xyz"[axis]], linewidth=0.9, label=label)
    canvas.least_span(axes, 1.0)
    canvas.label(axes, "σ: acceler-\nation (m/s²)")
    canvas.legend(axes)


def _clip_time(panels: Sequence[Axes], tracks: Sequence[ShadowTrack]) -> None:
    panels[0].set_xlim(min(track.times_s[0] for track in tracks), max(track.times_s[-1] for track in tracks))


def _label_armed(axes: Axes, vehicle: SenderSurvey | None) -> None:
    low_s, high_s = axes.get_xlim()
    for span in _visible(vehicle, low_s, high_s):
        middle_s = (max(span[0], low_s) + min(span[1], high_s)) / 2
        look = {"fontsize": 9, "color": canvas.INK, "ha": "center", "va": "bottom"}
        axes.text(middle_s, 1.03, "armed", transform=axes.get_xaxis_transform(), **look)


def _visible(vehicle: SenderSurvey | None, low_s: float, high_s: float) -> Iterable[tuple[float, float]]:
    """Armed spans long enough on the page to carry their name."""
    for span in vehicle.armed_spans if vehicle else ():
        if min(span.to_s, high_s) - max(span.from_s, low_s) > 0.05 * (high_s - low_s):
            yield (span.from_s, span.to_s)


def _draw_messages(figure: Figure, vehicle: SenderSurvey, duration_s: float, alone: bool) -> None:
    """What the vehicle sent most, as mean rates over the whole log; alone, it has the page to itself."""
    messages = vehicle.messages[: 40 if alone else 14]
    if not messages or duration_s <= 0.0:
        return
    width, height = (0.8, 0.81) if alone else (_WIDTH - 0.125, 0.275)
    axes = figure.add_axes((_LEFT + 0.125, 0.06, width, height))
    canvas.style(axes)
    rates_hz = [message.count / duration_s for message in messages]
    rows = range(len(messages))
    bars = axes.barh(rows, rates_hz, color=canvas.SKY, height=0.68)
    axes.bar_label(bars, [f"{rate_hz:.3g}" for rate_hz in rates_hz], padding=3, fontsize=8, color=canvas.INK)
    axes.set_yticks(rows, [message.name for message in messages], fontsize=8)
    axes.set_ylim(len(messages) - 0.4, -0.6)
    axes.set_xlim(0.0, max(rates_hz) * 1.15)
    axes.grid(False, axis="y")
    axes.set_xlabel("messages per second, mean over the log", fontsize=10, color=canvas.INK)
    title = f"the most frequent messages from {vehicle.sender[0]}/{vehicle.sender[1]}"
    figure.text(_LEFT, 0.075 + height, title, fontsize=11, color=canvas.INK)
