"""What a check found, in words and numbers."""

from __future__ import annotations

import statistics
from dataclasses import asdict, dataclass
from typing import Any

from mavquad.check.arrivals import RoundTrips, Stream, round_trips
from mavquad.check.asking import POSE_STREAMS, back_to_default
from mavquad.check.checker import Checker
from mavquad.check.words import bit_names, enum_name, git_hash, version_name
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.firmware import ARDUCOPTER, PX4, Firmware, firmware_of
from mavquad.types import Depth

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
LEAST_SHARE = 0.6
"""Of the rate asked for: what a flight wants by default (streams.least_share)."""
_PREARM = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_THRUST_IS_THRUST = 8
"""Bit of ArduCopter's GUID_OPTIONS: the thrust of SET_ATTITUDE_TARGET is thrust, and not a climb rate."""


@dataclass(frozen=True, slots=True)
class Version:
    """AUTOPILOT_VERSION."""

    release: str
    numbers: tuple[int, int, int]
    git: str
    board: str
    capabilities: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Clock:
    """The vehicle's clock, from TIMESYNC.

    Attributes:
        round_trips: None where it did not answer.
        drift_ms_s: what it gains on ours (negative: loses).
        drift_bound_ms_s: by how much that may be wrong.
        uncertainty_ms: bound of the error of an age.
        boot_s: what it shows.
        steps, reboots: how often it stepped, or started again.
    """

    round_trips: RoundTrips | None
    drift_ms_s: float | None
    drift_bound_ms_s: float | None
    uncertainty_ms: float | None
    boot_s: float | None
    steps: int
    reboots: int


@dataclass(frozen=True, slots=True)
class Findings:
    """All of it; see `to_json` for the keys."""

    vehicle: tuple[int, int]
    autopilot: str
    kind: str
    mode: str
    armed: bool
    landed: str
    version: Version | None
    streams: dict[str, Stream]
    bytes_s: float
    clock: Clock
    parameters: dict[str, float]
    hover_thrust: dict[str, float]
    depths: dict[str, str]
    reasons: tuple[str, ...]
    unhealthy: tuple[str, ...]
    texts: tuple[str, ...]
    not_restored: tuple[str, ...]

    @property
    def ready(self) -> bool:
        """Whether nothing keeps it from arming."""
        return not self.reasons

    def to_json(self) -> dict[str, Any]:
        """For programs."""
        return {**asdict(self), "ready": self.ready}


def findings(checker: Checker) -> Findings:
    """What a check that found a vehicle says of it."""
    assert checker.link.vehicle is not None
    beat = checker.latest[mavlink.MAVLINK_MSG_ID_HEARTBEAT]
    version = _version(checker.latest.get(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION))
    from_us, to_us = checker.measured_us
    state = checker.latest.get(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    streams = {_name(number): arrivals.stream(from_us, to_us) for number, arrivals in checker.arrivals.items()}
    return Findings(
        vehicle=checker.link.vehicle,
        autopilot=enum_name("MAV_AUTOPILOT", beat.autopilot),
        kind=enum_name("MAV_TYPE", beat.type),
        mode=mode_name(beat),
        armed=checker.is_armed,
        landed=enum_name("MAV_LANDED_STATE", state.landed_state) if state is not None else "",
        version=version,
        streams=dict(sorted(streams.items(), key=lambda item: -item[1].count)),
        bytes_s=checker.measured_bytes * 1e6 / max(to_us - from_us, 1),
        clock=_clock(checker),
        parameters=dict(checker.reader.values),
        hover_thrust=_hover_thrust(checker),
        depths=depths(beat, version, checker.reader.values),
        reasons=_reasons(checker, streams),
        unhealthy=_unhealthy(checker.latest.get(mavlink.MAVLINK_MSG_ID_SYS_STATUS)),
        texts=checker.texts.said,
        not_restored=_not_restored(checker),
    )


def _name(number: int) -> str:
    kind = mavlink.mavlink_map.get(number)
    return str(kind.msgname) if kind is not None else str(number)


def _version(message: Message | None) -> Version | None:
    if message is None:
        return None
    number = int(message.flight_sw_version)
    return Version(
        release=version_name(number),
        numbers=(number >> 24 & 0xFF, number >> 16 & 0xFF, number >> 8 & 0xFF),
        git=git_hash(message),
        board=f"{message.vendor_id:04x}:{message.product_id:04x}",
        capabilities=bit_names("MAV_PROTOCOL_CAPABILITY", message.capabilities),
    )


def mode_name(beat: Message) -> str:
    """The mode that a HEARTBEAT shows, in its firmware's words; its number where that is not known here."""
    firmware = firmware_of(beat.autopilot, beat.type)
    return str(beat.custom_mode) if firmware is None else firmware.mode(beat.custom_mode).name


def _clock(checker: Checker) -> Clock:
    sync, now_us = checker.sync, checker.measured_us[1]
    line, boot_us = sync.clock.line, sync.vehicle_us(now_us)
    return Clock(
        round_trips=round_trips(checker.round_trips_us),
        drift_ms_s=line.drift * 1000 if line else None,
        drift_bound_ms_s=line.drift_bound * 1000 if line else None,
        uncertainty_ms=sync.uncertainty_us(now_us) / 1000 if line else None,
        boot_s=boot_us * 1e-6 if boot_us is not None else None,
        steps=sync.clock.steps,
        reboots=sync.clock.reboots,
    )


def _hover_thrust(checker: Checker) -> dict[str, float]:
    """By its source: a parameter, or what is flown."""
    hover = {firmware.hover_parameter for firmware in (PX4, ARDUCOPTER)}
    found = {name: value for name, value in checker.reader.values.items() if name in hover}
    if checker.thrusts:
        found["ATTITUDE_TARGET"] = statistics.median(checker.thrusts)
    return found


def depths(beat: Message, version: Version | None, parameters: dict[str, float]) -> dict[str, str]:
    """Of each depth of the law, "yes" with what goes with it, "no: why" or "?: why"."""
    firmware = firmware_of(beat.autopilot, beat.type)
    if firmware is None:
        words = f"{enum_name('MAV_AUTOPILOT', beat.autopilot)} on a {enum_name('MAV_TYPE', beat.type)}"
        return dict.fromkeys(DEPTHS, f"no: {words} is not flown by mavquad")
    if version is None:
        taken = firmware.depths((1 << 16, 0, 0))  # what the latest takes
        return {depth: "yes" if depth in taken else "?: its version is not known" for depth in DEPTHS}
    return {depth: _depth(firmware, version, depth, parameters) for depth in DEPTHS}


def _depth(firmware: Firmware, version: Version, depth: Depth, parameters: dict[str, float]) -> str:
    if depth not in firmware.depths(version.numbers):
        return f"no: {firmware.name} {version.release} takes no {depth} over MAVLink"
    if depth == "torque":
        return "yes, unless it was built with lockstep (a simulator)"
    options = parameters.get("GUID_OPTIONS")
    if options is None or int(options) & _THRUST_IS_THRUST:
        return "yes"
    return f"yes, with bit 3 of GUID_OPTIONS (now {options:g}), which fly sets and puts back"


def _reasons(checker: Checker, streams: dict[str, Stream]) -> tuple[str, ...]:
    """Why it cannot be armed and flown by us now."""
    status = checker.latest.get(mavlink.MAVLINK_MSG_ID_SYS_STATUS)
    reasons = []
    if checker.is_armed:
        reasons.append("it is armed already")
    if status is None:
        reasons.append("SYS_STATUS does not come, so what its pre-arm checks say is not known")
    elif not status.onboard_control_sensors_health & _PREARM:
        reasons.append("its own pre-arm checks have not passed")
    for name, _ in POSE_STREAMS:
        stream = streams.get(name)
        if stream is None or stream.rate_hz is None:
            no_estimate = " (no position estimate yet?)" if name == "LOCAL_POSITION_NED" else ""
            reasons.append(f"{name} does not come{no_estimate}")
        elif stream.rate_hz < LEAST_SHARE * checker.rate_hz:
            reasons.append(f"{name} comes at {stream.rate_hz:.0f} Hz, {checker.rate_hz:g} Hz asked")
    return tuple(reasons)


def _unhealthy(status: Message | None) -> tuple[str, ...]:
    """What SYS_STATUS shows as there and switched on and not healthy."""
    if status is None:
        return ()
    ill = (
        status.onboard_control_sensors_present
        & status.onboard_control_sensors_enabled
        & ~status.onboard_control_sensors_health
    )
    return bit_names("MAV_SYS_STATUS_SENSOR", ill, "MAV_SYS_STATUS_")


def _not_restored(checker: Checker) -> tuple[str, ...]:
    """Streams that were asked for and whose default was not taken back with an acknowledgement."""
    accepted = "ACCEPTED"
    changed = [
        command
        for command in checker.asking.asked
        if command.command_id == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        and command.params[1] > 0
        and checker.asking.results.get(command.words) == accepted
    ]
    results = checker.asking.results
    return tuple(c.words.split()[0] for c in changed if results.get(back_to_default(c).words) != accepted)
