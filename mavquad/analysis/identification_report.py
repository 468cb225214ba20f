"""Identification of a whole log: every kind of command in it, every axis, and what to put in a configuration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

import numpy as np

from mavquad.analysis.identification import AxisFit, Estimate, Kind, Refused, Signal, identify
from mavquad.analysis.identification_log import Answers, Commands, FlightData, flight_data, intersection, without_entry
from mavquad.analysis.identification_model import Array
from mavquad.analysis.identification_windows import Span
from mavquad.tlog import TlogContents
from mavquad.types import Depth

AXES = ("roll", "pitch", "yaw")
_LEAST_COMMANDS = 20
_PAUSE_OF_SPACING = 5.0


@dataclass(frozen=True, slots=True)
class DepthReport:
    """One kind of command in a log.

    Attributes:
        depth: what was commanded.
        own: whether the autopilot's own controllers commanded it (ATTITUDE_TARGET).
        commands: how many there are in the log.
        command_rate_hz: mean, pauses left out.
        spans: when the vehicle followed them, log time, s.
        commanded: commands of each axis in force from its time, in the wire's frames and units.
        axes: roll, pitch, yaw.
    """

    depth: Depth
    own: bool
    commands: int
    command_rate_hz: float
    spans: tuple[Span, ...]
    commanded: tuple[Signal, Signal, Signal]
    axes: tuple[AxisFit | Refused, AxisFit | Refused, AxisFit | Refused]

    @property
    def fits(self) -> dict[str, AxisFit]:
        """The axes that have figures."""
        return {name: fit for name, fit in zip(AXES, self.axes, strict=True) if isinstance(fit, AxisFit)}


@dataclass(frozen=True, slots=True)
class Identification:
    """What a log says of how its vehicle answers.

    Attributes:
        vehicle: (system, component).
        answer_rate_hz: of ATTITUDE by its stamps, mean, pauses left out.
        age_s: median age of ATTITUDE when it arrives, on the clock aligned as `round_trip_s` says.
        round_trip_s: median round trip of TIMESYNC; None where the clocks are aligned by the earliest arrivals: ages are
            then counted from the link's least delay on, and that delay is part of the dead times.
        boots: how often the vehicle started in the log.
        depths: commands sent to it; where there are none, its own.
    """

    vehicle: tuple[int, int]
    answer_rate_hz: float
    age_s: float
    round_trip_s: float | None
    boots: int
    depths: tuple[DepthReport, ...]

    def settings(self, report: DepthReport) -> dict[str, float | list[float]]:
        """Keys of a configuration with their values, s and rad/s^2.

        law.delay_s is the age of a measurement when it arrives plus the way up the link, law.dead_time_s what is left of
        the dead time (mean of roll and pitch). Without TIMESYNC the link's least delays, down and up, are in the dead
        times; the sum of both keys, which is what the law counts on, is the same.
        """
        fits, way_s = report.fits, (self.round_trip_s or 0.0) / 2.0
        level = [fits[name] for name in ("roll", "pitch") if name in fits]
        passed_s = 0.0 if report.own else way_s
        found: dict[str, float | list[float]] = {"law.delay_s": round(max(self.age_s + way_s, 0.0), 4)}
        if level:
            found["law.dead_time_s"] = _not_negative(fmean(fit.dead_s.value for fit in level) - passed_s)
            found["law.lag_s"] = _not_negative(fmean(fit.lag_s.value for fit in level))
        if "yaw" in fits:
            found["law.yaw_dead_time_s"] = _not_negative(fits["yaw"].dead_s.value - passed_s)
            found["law.yaw_lag_s"] = _not_negative(fits["yaw"].lag_s.value)
        if report.depth == "torque" and len(fits) == len(AXES):
            scale = [float(f"{fits[name].gain.value:.4g}") for name in AXES]
            found["airframe.torque_scale_frd_rad_s2"] = scale
        return found

    def to_json(self) -> dict[str, Any]:
        """Ready for `json.dumps`; times in s, the rest in the unit that its name says."""
        return {
            "system": self.vehicle[0],
            "component": self.vehicle[1],
            "answer_rate_hz": self.answer_rate_hz,
            "age_s": self.age_s,
            "clock": "arrivals" if self.round_trip_s is None else "timesync",
            "round_trip_s": self.round_trip_s,
            "boots": self.boots,
            "depths": [{**_depth_json(report), "settings": self.settings(report)} for report in self.depths],
        }


def identify_log(contents: TlogContents, own: bool = False) -> Identification | Refused:
    """Identify the main vehicle of a log.

    Args:
        contents: the log.
        own: from the autopilot's own commands, even if there are others.

    Returns:
        What was found, an axis without excitation having its reason in place of figures; or why nothing could be tried.
    """
    data = flight_data(contents)
    if data is None:
        return Refused("the log is empty")
    if len(data.answers.times_s) < 2:
        return Refused("no ATTITUDE of a vehicle in it")
    sent = {} if own else {d: commands for d, commands in data.sent.items() if len(commands.times_s) >= _LEAST_COMMANDS}
    if not sent and len(data.own.times_s) < _LEAST_COMMANDS:
        return Refused(_without_commands(data, own))
    depths = [_report(data.answers, depth, False, commands, data.offboard) for depth, commands in sent.items()]
    if not depths:
        depths.append(_report(data.answers, "rate", True, data.own, data.airborne))
    return Identification(
        vehicle=data.vehicle,
        answer_rate_hz=_rate_hz(data.answers.times_s),
        age_s=float(np.median(data.answers.ages_s)),
        round_trip_s=data.round_trip_s,
        boots=data.boots,
        depths=tuple(depths),
    )


def _without_commands(data: FlightData, own: bool) -> str:
    if own:
        return f"too few commands of the autopilot's own in it ({len(data.own.times_s)} ATTITUDE_TARGET)"
    count = sum(len(commands.times_s) for commands in data.sent.values())
    return (
        f"too few attitude, rate or torque setpoints in it ({count})"
        if count
        else ("no attitude, rate or torque setpoints in it, nor the autopilot's own (ATTITUDE_TARGET)")
    )


def _report(answers: Answers, depth: Depth, own: bool, commands: Commands, following: Sequence[Span]) -> DepthReport:
    spans = without_entry(intersection(following, commands.spans()))
    times_s = _middles(commands.times_s) if own else commands.times_s
    values = answers.angles_rad if depth == "attitude" else answers.rates_frd_rad_s
    kind: Kind = "integrating" if depth == "torque" else "static"
    roll, pitch, yaw = (Signal(times_s, commands.values[:, axis]) for axis in range(3))

    def fitted(axis: int, command: Signal) -> AxisFit | Refused:
        return identify(command, Signal(answers.times_s, values[:, axis]), spans, kind)

    return DepthReport(
        depth=depth,
        own=own,
        commands=len(times_s),
        command_rate_hz=_rate_hz(commands.times_s),
        spans=tuple(spans),
        commanded=(roll, pitch, yaw),
        axes=(fitted(0, roll), fitted(1, pitch), fitted(2, yaw)),
    )


def _middles(times_s: Array) -> Array:
    """Samples of something that changed more often stand for half a period before and after them."""
    return np.concatenate((times_s[:1], (times_s[1:] + times_s[:-1]) / 2.0))


def _not_negative(time_s: float) -> float:
    return round(max(time_s, 0.0), 4)


def _rate_hz(times_s: Array) -> float:
    """Mean rate, pauses left out."""
    spacings_s = np.diff(times_s)
    steady_s = spacings_s[spacings_s < _PAUSE_OF_SPACING * np.median(spacings_s)]
    return len(steady_s) / float(steady_s.sum()) if len(steady_s) and steady_s.sum() > 0.0 else 0.0


def _depth_json(report: DepthReport) -> dict[str, Any]:
    return {
        "depth": report.depth,
        "commands_of": "autopilot" if report.own else "offboard",
        "commands": report.commands,
        "command_rate_hz": report.command_rate_hz,
        "followed_s": sum(to_s - from_s for from_s, to_s in report.spans),
        "axes": {name: _axis_json(fit) for name, fit in zip(AXES, report.axes, strict=True)},
    }


def _axis_json(fit: AxisFit | Refused) -> dict[str, Any]:
    if isinstance(fit, Refused):
        return {"refused": fit.reason}
    pairs: dict[str, Estimate | None] = {
        "dead_s": fit.dead_s,
        "lag_s": fit.lag_s,
        "total_s": fit.total_s,
        "gain": fit.gain,
        "damping_1_s": fit.damping_1_s,
    }
    figures = {name: _estimate_json(estimate) for name, estimate in pairs.items()}
    return {
        **figures,
        "explained": fit.explained,
        "residual_sd": fit.residual,
        "command_sd": fit.command_sd,
        "samples": fit.samples,
        "windows": fit.windows,
        "seconds": fit.seconds,
    }


def _estimate_json(estimate: Estimate | None) -> dict[str, float | None] | None:
    if estimate is None:
        return None
    return {"value": estimate.value, "error": estimate.error if math.isfinite(estimate.error) else None}


def toml_lines(settings: dict[str, float | list[float]]) -> list[str]:
    """The settings as lines of a configuration, by table."""
    lines: list[str] = []
    table = ""
    for path, value in settings.items():
        section, key = path.rsplit(".", 1)
        if section != table:
            lines += [f"[{section}]"] if not lines else ["", f"[{section}]"]
            table = section
        lines.append(f"{key} = {value}")
    return lines
