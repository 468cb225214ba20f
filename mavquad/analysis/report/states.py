"""What a vehicle was in and what was said: modes, arming, texts, commands and their answers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy

from mavquad.analysis.modes import mode_name
from mavquad.analysis.report.model import Lane, Mark, Numbers, Span
from mavquad.analysis.report.telemetry import Rows, Sender, Telemetry
from mavquad.protocol.codec import mavlink

STATE_NAMES = ("HEARTBEAT", "STATUSTEXT", "COMMAND_LONG", "COMMAND_ACK")
"""The messages that this module reads."""

_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_QUIET_COMMANDS = (
    mavlink.MAV_CMD_REQUEST_MESSAGE,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
)
_FINE = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS)
_WARNING = mavlink.MAV_SEVERITY_WARNING


def lanes(found: Telemetry, sender: Sender) -> list[Lane]:
    """Mode and arming by HEARTBEAT; the heartbeats of one claim to be an autopilot, should there be several."""
    beats = found.of("HEARTBEAT", sender)
    if beats is None:
        return []
    real = beats["autopilot"] != mavlink.MAV_AUTOPILOT_INVALID
    rows = numpy.stack((real, beats["type"], beats["autopilot"]))
    claims, counts = numpy.unique(rows, axis=1, return_counts=True)
    is_real, vehicle_type, autopilot = claims[:, numpy.lexsort((counts, claims[0]))[-1]].tolist()
    if not is_real:
        return []
    kept = (beats["type"] == vehicle_type) & (beats["autopilot"] == autopilot)
    names = [mode_name(autopilot, vehicle_type, mode) for mode in beats["custom_mode"][kept].tolist()]
    armed = ["armed" if flags & _ARMED else "" for flags in beats["base_mode"][kept].tolist()]
    return [Lane("mode", spans(beats.times_s[kept], names)), Lane("armed", spans(beats.times_s[kept], armed))]


def spans(times_s: Numbers, names: Iterable[str]) -> tuple[Span, ...]:
    """Stretches of one name, each to the first moment of the next; an empty name is no state."""
    found: list[Span] = []
    begun_s, current = 0.0, ""
    for time_s, name in zip(times_s.tolist(), names, strict=True):
        if name != current:
            if current:
                found.append(Span(begun_s, time_s, current))
            begun_s, current = time_s, name
    if current:
        found.append(Span(begun_s, float(times_s[-1]), current))
    return tuple(found)


def marks(found: Telemetry, sender: Sender) -> Iterator[Mark]:
    """What the vehicle said (STATUSTEXT), what it was commanded and how it answered."""
    if (texts := found.of("STATUSTEXT", sender)) is not None:
        for time_s, said, severity in _zipped(texts, "text", "severity"):
            yield Mark(time_s, "vehicle", said.strip(), severity)
    for other in found.senders_of("COMMAND_LONG"):
        if (commands := found.of("COMMAND_LONG", other)) is not None:
            yield from _commands(commands, sender)
    if (acks := found.of("COMMAND_ACK", sender)) is not None:
        for time_s, command, result in _zipped(acks, "command", "result"):
            if result not in _FINE or command not in _QUIET_COMMANDS:
                text = f"{_command(command)}: {_result(result)}"
                yield Mark(time_s, "answer", text, None if result in _FINE else _WARNING)


def _commands(commands: Rows, vehicle: Sender) -> Iterator[Mark]:
    mine = commands.addressed(vehicle)
    params = (f"param{number}" for number in range(1, 8))
    for is_mine, (time_s, command, *values) in zip(mine, _zipped(commands, "command", *params), strict=True):
        if is_mine and command not in _QUIET_COMMANDS:
            yield Mark(time_s, "command", f"{_command(command)} {_plain(values)}".strip())


def _zipped(rows: Rows, *names: str) -> Iterator[tuple[Any, ...]]:
    return zip(rows.times_s.tolist(), *(rows[name].tolist() for name in names), strict=True)


def _plain(values: Iterable[float]) -> str:
    """Parameters without the zeros at the end."""
    words = [f"{value:g}" for value in values]
    while words and words[-1] in ("0", "nan"):
        words.pop()
    return ", ".join(words)


def _command(number: float) -> str:
    entry = mavlink.enums["MAV_CMD"].get(number)
    return str(entry.name).removeprefix("MAV_CMD_") if entry else f"command {number}"


def _result(number: float) -> str:
    entry = mavlink.enums["MAV_RESULT"].get(number)
    return str(entry.name).removeprefix("MAV_RESULT_").lower().replace("_", " ") if entry else f"result {number}"
