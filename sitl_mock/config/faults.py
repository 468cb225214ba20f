"""Scripted faults: one section a kind, told apart by their key `kind`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mavquad.schema import Section
from sitl_mock.config.numbers import NotNegative, Positive

ModeName = Literal["POSCTL", "OFFBOARD", "AUTO.TAKEOFF", "AUTO.LOITER", "AUTO.LAND", "AUTO.RTL"]


StreamName = Literal[
    "HEARTBEAT",
    "ATTITUDE",
    "ATTITUDE_QUATERNION",
    "LOCAL_POSITION_NED",
    "GLOBAL_POSITION_INT",
    "ATTITUDE_TARGET",
    "SERVO_OUTPUT_RAW",
    "TIMESYNC",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "SYSTEM_TIME",
    "BATTERY_STATUS",
    "HOME_POSITION",
]


class Timed(Section):
    """A scripted fault that starts at a moment."""

    since: Literal["boot", "offboard"] = "boot"
    """What `from_s` or `at_s` counts from: boot, or the first entry into OFFBOARD."""


class Refuse(Section):
    """The autopilot refuses a command."""

    kind: Literal["refuse"]
    """Discriminates the fault."""
    command: Annotated[int, Field(ge=0, le=65535)]
    """MAV_CMD number."""
    result: Annotated[int, Field(ge=0, le=9)] = 2
    """MAV_RESULT of the answer (2: DENIED)."""
    times: Annotated[int, Field(ge=1)] = 1_000_000
    """How many times, before it is obeyed."""
    text: Annotated[str, Field(max_length=50)] = ""
    """STATUSTEXT sent along, if any."""


class AckWithoutActing(Section):
    """The autopilot acknowledges a command and does nothing."""

    kind: Literal["ack_without_acting"]
    """Discriminates the fault."""
    command: Annotated[int, Field(ge=0, le=65535)]
    """MAV_CMD number."""
    times: Annotated[int, Field(ge=1)] = 1_000_000
    """How many times, before it is obeyed."""


class Silent(Timed):
    """No telemetry and no answer for a while; the vehicle still listens."""

    kind: Literal["silent"]
    """Discriminates the fault."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class StreamStops(Timed):
    """One message is not sent for a while."""

    kind: Literal["stream_stops"]
    """Discriminates the fault."""
    message: StreamName
    """Name of the message."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class NanPose(Timed):
    """LOCAL_POSITION_NED carries NaN for a while."""

    kind: Literal["nan_pose"]
    """Discriminates the fault."""
    from_s: NotNegative
    """Start in s."""
    for_s: Positive
    """Duration in s."""


class Die(Timed):
    """The autopilot neither sends nor obeys from then on, for ever."""

    kind: Literal["die"]
    """Discriminates the fault."""
    at_s: NotNegative
    """Moment in s."""


class ModeChange(Timed):
    """The pilot selects another mode."""

    kind: Literal["mode_change"]
    """Discriminates the fault."""
    at_s: NotNegative
    """Moment in s."""
    mode: ModeName
    """PX4's name of the mode."""


Fault = Annotated[
    Refuse | AckWithoutActing | Silent | StreamStops | NanPose | Die | ModeChange, Field(discriminator="kind")
]
