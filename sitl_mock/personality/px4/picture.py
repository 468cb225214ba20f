"""All that one tick's telemetry tells, and how numbers fit into the messages' fields."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from mavquad.protocol.codec import Message
from sitl_mock.config import Px4Release
from sitl_mock.geodesy import Origin
from sitl_mock.geometry import Quaternion, Vec3, Vec4
from sitl_mock.inner_loops import Gains, PositionSetpoint, TorqueSetpoint
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.readings import Readings
from sitl_mock.sensors import Estimate


@dataclass(frozen=True, slots=True)
class Home:
    """Where and when the vehicle was armed last (at first: where it stands at boot), and its heading there."""

    position_ned_m: Vec3
    yaw_rad: float
    since_us: int


@dataclass(slots=True)  # frozen, it would take three times as long to make
class Picture:
    """What the messages of one tick are made from; drawn anew for the next one. What is seldom looked at is asked for.

    Attributes:
        estimate: the latest one.
        position: the one that the position topics were published with last.
        motor_commands: None when disarmed.
        followed: the position setpoint in force, if the position controller runs.
        unix_us: the calendar's time.
        system_status: MAV_STATE at a time since boot.
        is_ready: whether the preflight checks pass then.
        is_torque_control: whether nothing sets an attitude or rates.
        mission_current: makes the MISSION_CURRENT of now.
    """

    firmware: Px4Release
    boot_us: int
    unix_us: int
    estimate: Estimate
    position: Estimate
    mode: Mode
    armed: bool
    landed: bool
    home: Home
    attitude_target: Quaternion
    rates_target_rad_s: Vec3
    attitude_thrust_norm: float
    motor_commands: Vec4 | None
    gains: Gains
    controls: TorqueSetpoint
    followed: PositionSetpoint | None
    origin: Origin
    readings: Readings
    system_status: Callable[[int], int]
    is_ready: Callable[[int], bool]
    is_torque_control: Callable[[], bool]
    mission_current: Callable[[], Message]

    @property
    def is_113(self) -> bool:
        """Whether this is the oldest of the releases."""
        return self.firmware == "1.13"

    @property
    def home_altitude_m(self) -> float:
        """Altitude of home above mean sea level."""
        return self.origin.altitude_m - self.home.position_ned_m[2]


def degrees_e7(degrees: float) -> int:
    """Degrees in units of 1e-7."""
    return int32(degrees * 1e7)


def heading_cdeg(yaw_rad: float) -> int:
    """Hundredths of a degree from north, 0 to 35999."""
    return round(math.degrees(yaw_rad) * 100) % 36000


def int32(value: float) -> int:
    """The nearest whole number that a field of 32 bits can hold."""
    whole = round(value)
    return whole if -(2**31) <= whole < 2**31 else max(-(2**31), min(2**31 - 1, whole))


def int16(value: float) -> int:
    """The nearest whole number that a field of 16 bits can hold."""
    whole = round(value)
    return whole if -32768 <= whole < 32768 else max(-32768, min(32767, whole))


def uint16(value: float) -> int:
    """The nearest whole number that an unsigned field of 16 bits can hold."""
    return max(0, min(65535, round(value)))
