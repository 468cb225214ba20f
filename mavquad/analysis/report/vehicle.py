"""Lines of what any log says of its vehicle: attitude, rates, torques, thrust; and dashed what was asked of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy

from mavquad.analysis.report.model import Colour, Line, Numbers, Panel
from mavquad.analysis.report.telemetry import Rows, Sender, Telemetry
from mavquad.protocol.codec import mavlink

VEHICLE_NAMES = (
    "ATTITUDE",
    "ATTITUDE_QUATERNION",
    "ATTITUDE_TARGET",
    "SET_ATTITUDE_TARGET",
    "SET_ACTUATOR_CONTROL_TARGET",
    "ACTUATOR_CONTROL_TARGET",
    "VFR_HUD",
)
"""The messages that this module reads."""

_CHANNELS: tuple[tuple[str, Colour], ...] = (("roll", "y"), ("pitch", "x"), ("yaw", "yaw"))
_DEGREES = 180.0 / math.pi
_NO_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
_NO_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
_NO_RATE = (1, 2, 4)  # ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE and on


def attitude_panels(found: Telemetry, sender: Sender) -> Iterator[Panel]:
    """Attitude and body rates as measured (FRD), and dashed what ATTITUDE_TARGET or SET_ATTITUDE_TARGET asked."""
    measured = _measured(found, sender)
    if measured is None:
        return
    times_s, angles, rates = measured
    target = _target(found, sender)
    wanted, wanted_rates = _wanted(target) if target is not None else ([], [])
    roll, pitch, yaw = (Line(n, times_s, angles[i], c) for i, (n, c) in enumerate(_CHANNELS))
    tilts, headings = [line for line in wanted if line.colour != "yaw"], [w for w in wanted if w.colour == "yaw"]
    yield Panel("attitude", "Roll and pitch", "° (FRD)", (roll, pitch, *tilts), 4.0)
    yield Panel("yaw", "Yaw", "° (FRD)", (_broken_where_it_wraps(yaw), *map(_broken_where_it_wraps, headings)), 4.0)
    turning = [Line(name, times_s, rates[i], colour) for i, (name, colour) in enumerate(_CHANNELS)]
    yield Panel("rates", "Body rates", "°/s (FRD)", (*turning, *wanted_rates), 10.0)


def _measured(found: Telemetry, sender: Sender) -> tuple[Numbers, Numbers, Numbers] | None:
    """Times, Euler angles (3, n) and body rates (3, n), degrees, of ATTITUDE or else ATTITUDE_QUATERNION."""
    if (rows := found.of("ATTITUDE", sender)) is not None:
        angles = numpy.stack([rows[name] for name, _ in _CHANNELS])
    elif (rows := found.of("ATTITUDE_QUATERNION", sender)) is not None:
        angles = euler_rad(numpy.stack([rows[f"q{i}"] for i in range(1, 5)], axis=1))
    else:
        return None
    rates = numpy.stack([rows[f"{name}speed"] for name, _ in _CHANNELS])
    return rows.times_s, angles * _DEGREES, rates * _DEGREES


def _broken_where_it_wraps(line: Line) -> Line:
    """A heading without a stroke through the panel from 180 to -180 degrees."""
    values = line.values.astype(float)
    values[numpy.flatnonzero(numpy.abs(numpy.diff(values)) > 180.0) + 1] = numpy.nan
    return Line(line.name, line.times_s, values, line.colour, line.dashed)


def _target(found: Telemetry, sender: Sender) -> Rows | None:
    """What it was sent, or else its own word on what it follows (PX4's has zeros for what it is not asked)."""
    return _sent(found, "SET_ATTITUDE_TARGET", sender) or found.of("ATTITUDE_TARGET", sender)


def _wanted(target: Rows) -> tuple[list[Line], list[Line]]:
    """Dashed lines of the attitude and of the rates that are wanted; none where the type mask ignores them."""
    mask = target["type_mask"].astype(int)
    angles = numpy.where(mask & _NO_ATTITUDE, numpy.nan, euler_rad(target["q"]) * _DEGREES)
    rates = [
        numpy.where(mask & bit, numpy.nan, target[f"body_{name}_rate"] * _DEGREES)
        for bit, (name, _) in zip(_NO_RATE, _CHANNELS, strict=True)
    ]
    return _dashed(target, angles), _dashed(target, rates)


def _dashed(target: Rows, columns: Sequence[Numbers] | Numbers) -> list[Line]:
    lines = [Line(f"{n}, wanted", target.times_s, v, c, True) for (n, c), v in zip(_CHANNELS, columns, strict=True)]
    return with_numbers(lines)


def with_numbers(lines: Iterable[Line]) -> list[Line]:
    """Those that are not NaN all along."""
    return [line for line in lines if numpy.isfinite(line.values).any()]


def euler_rad(quaternions: Numbers) -> Numbers:
    """Roll, pitch, yaw (3, n) of quaternions w, x, y, z (n, 4) as MAVLink has them (FRD to NED)."""
    w, x, y, z = quaternions.astype(float).T
    return numpy.stack(
        (
            numpy.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            numpy.arcsin(numpy.clip(2 * (w * y - z * x), -1.0, 1.0)),
            numpy.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        )
    )


def control_panels(found: Telemetry, sender: Sender) -> Iterator[Panel]:
    """Torques of (SET_)ACTUATOR_CONTROL_TARGET; thrust by whoever names it: setpoint, target, throttle."""
    torques: list[Line] = []
    thrusts: list[Line] = []
    if (rows := _actuator_controls(found, sender)) is not None:
        controls = rows["controls"]
        torques = [Line(axis, rows.times_s, controls[:, i], colour) for i, (axis, colour) in enumerate(_CHANNELS)]
        thrusts = [Line("commanded", rows.times_s, controls[:, 3], "z")]
    if (target := _target(found, sender)) is not None:
        ignored = target["type_mask"].astype(int) & _NO_THRUST
        thrusts.append(Line("wanted", target.times_s, numpy.where(ignored, numpy.nan, target["thrust"]), "z"))
    if (hud := found.of("VFR_HUD", sender)) is not None:
        thrusts.append(Line("throttle, VFR_HUD", hud.times_s, hud["throttle"] / 100.0, "ink", dashed=True))
    if torques:
        yield Panel("commands", "Torques commanded", "normalised", tuple(torques), 0.02)
    if thrusts := with_numbers(thrusts):
        yield Panel("thrust", "Thrust", "0 to 1", tuple(thrusts), 0.1)


def _actuator_controls(found: Telemetry, sender: Sender) -> Rows | None:
    """What the vehicle was sent, or else what it says that it does."""
    return _sent(found, "SET_ACTUATOR_CONTROL_TARGET", sender) or found.of("ACTUATOR_CONTROL_TARGET", sender)


def _sent(found: Telemetry, name: str, vehicle: Sender) -> Rows | None:
    """The first sender's messages of that name, if any of them is to the vehicle."""
    for other in found.senders_of(name):
        rows = found.of(name, other)
        if rows is not None and rows.addressed(vehicle).any():
            return rows
    return None
