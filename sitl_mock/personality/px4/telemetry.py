"""The mock's telemetry messages, filled as PX4 fills them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.geometry import Quaternion, Vec3, Vec4
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.sensors import Estimate

HOME_LATITUDE_DEG = 45.4671182
HOME_LONGITUDE_DEG = -73.7578241
HOME_ALTITUDE_M = 32.5
"""Where PX4 1.13's SIH starts; altitude above mean sea level."""

_PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_SENSORS: dict[Px4Release, tuple[int, int, int]] = {
    "1.13": (0x9020802C, 0x9020800C, 0x9020802F),
    "1.15": (0x0300402F, 0x0301402F, 0x1320C83F),
    "1.16": (0x0300402F, 0x0301402F, 0x1320C83F),
}
"""SYS_STATUS's sensors present, enabled and healthy when ready to arm, as recorded from SIH (1.15: taken to be as 1.16)."""
_SERVOS_5_TO_8: dict[Px4Release, tuple[int, int, int, int]] = {
    "1.13": (1500, 1500, 900, 900),
    "1.15": (900,) * 4,
    "1.16": (900,) * 4,
}
"""What the outputs without a motor show when armed, as recorded; 900 disarmed."""
_LEAST_THRUST = 0.001
"""What ATTITUDE_TARGET shows at rest, disarmed or armed, as recorded."""
_EARTH_RADIUS_M = 6371000.0
_VERSION: dict[Px4Release, tuple[int, int]] = {
    "1.13": (17629952, 58623),
    "1.15": (17761535, 59647),
    "1.16": (17826559, 59647),
}
"""AUTOPILOT_VERSION.flight_sw_version and capabilities of 1.13.3, 1.15.4 (not recorded) and 1.16.2."""


@dataclass(frozen=True, slots=True)
class Picture:
    """All that one tick's messages tell. `motor_commands` is None when disarmed.

    `is_torque_control`: nothing sets an attitude or rates.
    """

    firmware: Px4Release
    boot_us: int
    estimate: Estimate
    mode: Mode
    armed: bool
    failsafe: bool
    ready: bool
    landed: bool
    home_ned_m: Vec3
    attitude_target: Quaternion
    rates_target_rad_s: Vec3
    attitude_thrust_norm: float
    motor_commands: Vec4 | None
    is_torque_control: bool = False


def heartbeat(picture: Picture) -> Message:
    """HEARTBEAT of a PX4 quadrotor."""
    status = mavlink.MAV_STATE_STANDBY
    if picture.armed:
        status = mavlink.MAV_STATE_CRITICAL if picture.failsafe else mavlink.MAV_STATE_ACTIVE
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_AUTOPILOT_PX4,
        picture.mode.base_mode(picture.armed),
        picture.mode.custom_mode,
        status,
        3,
    )


def attitude(picture: Picture) -> Message:
    """ATTITUDE, stamped with the time of its sample."""
    estimate = picture.estimate
    return mavlink.MAVLink_attitude_message(
        estimate.stamp_us // 1000, *_wrapped(estimate.euler_rad), *estimate.rates_frd_rad_s
    )


def attitude_quaternion(picture: Picture) -> Message:
    """ATTITUDE_QUATERNION of the same sample."""
    estimate = picture.estimate
    return mavlink.MAVLink_attitude_quaternion_message(
        estimate.stamp_us // 1000, *estimate.quaternion, *estimate.rates_frd_rad_s
    )


def local_position_ned(picture: Picture) -> Message:
    """LOCAL_POSITION_NED of the same sample."""
    estimate = picture.estimate
    return mavlink.MAVLink_local_position_ned_message(
        estimate.stamp_us // 1000, *estimate.position_ned_m, *estimate.velocity_ned_m_s
    )


def global_position_int(picture: Picture) -> Message:
    """GLOBAL_POSITION_INT: the local position around the home point, on a sphere."""
    estimate = picture.estimate
    n, e, d = estimate.position_ned_m
    latitude, longitude = _geodetic(n, e)
    vn, ve, vd = (round(100 * v) for v in estimate.velocity_ned_m_s)
    return mavlink.MAVLink_global_position_int_message(
        estimate.stamp_us // 1000,
        latitude,
        longitude,
        _int32(1000 * (HOME_ALTITUDE_M - d)),
        _int32(1000 * (picture.home_ned_m[2] - d)),
        _int16(vn),
        _int16(ve),
        _int16(vd),
        round(math.degrees(estimate.euler_rad[2]) * 100) % 36000,
    )


def attitude_target(picture: Picture) -> Message | None:
    """ATTITUDE_TARGET: the rates that are followed (NaN: an axis left alone), and the last input of the attitude loop.

    While body rates come from outside, that attitude and thrust stand still, and the thrust is not the one in force
    (seen on 1.16.2). Pauses under torque control.
    """
    if picture.is_torque_control:
        return None
    return mavlink.MAVLink_attitude_target_message(
        picture.boot_us // 1000,
        0,
        list(picture.attitude_target),
        *picture.rates_target_rad_s,
        max(picture.attitude_thrust_norm, _LEAST_THRUST),
    )


def servo_output_raw(picture: Picture) -> Message:
    """SERVO_OUTPUT_RAW: 1000 + 1000 u of each motor command; 900 when disarmed."""
    servos = [900] * 8
    if picture.motor_commands is not None:
        servos = [*(round(1000 + 1000 * u) for u in picture.motor_commands), *_SERVOS_5_TO_8[picture.firmware]]
    return mavlink.MAVLink_servo_output_raw_message(picture.boot_us & 0xFFFFFFFF, 0, *servos)


def timesync(picture: Picture) -> Message:
    """TIMESYNC as a question of our own (tc1 = 0)."""
    return mavlink.MAVLink_timesync_message(0, picture.boot_us * 1000)


def sys_status(picture: Picture) -> Message:
    """SYS_STATUS; its health has PREARM_CHECK once arming is allowed."""
    present, enabled, health = _SENSORS[picture.firmware]
    if not picture.ready:
        health &= ~_PREARM_CHECK
    return mavlink.MAVLink_sys_status_message(present, enabled, health, 244, 16199, -100, 100, 0, 0, 0, 0, 0, 0)


def extended_sys_state(picture: Picture) -> Message:
    """EXTENDED_SYS_STATE: on ground, taking off, in air, landing."""
    if picture.landed:
        state = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif picture.mode is Mode.TAKEOFF:
        state = mavlink.MAV_LANDED_STATE_TAKEOFF
    elif picture.mode is Mode.LAND:
        state = mavlink.MAV_LANDED_STATE_LANDING
    else:
        state = mavlink.MAV_LANDED_STATE_IN_AIR
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, state)


def system_time(picture: Picture) -> Message:
    """SYSTEM_TIME; the mock knows no calendar, only its time since boot."""
    return mavlink.MAVLink_system_time_message(0, picture.boot_us // 1000)


def battery_status(picture: Picture) -> Message:
    """BATTERY_STATUS of SIH's battery, always full."""
    return mavlink.MAVLink_battery_status_message(0, 1, 1, 32767, [16199] + [65535] * 9, -100, 0, -1, 100, 0, 1)


def home_position(picture: Picture) -> Message:
    """HOME_POSITION: where the vehicle was armed last."""
    n, e, d = picture.home_ned_m
    latitude, longitude = _geodetic(n, e)
    altitude_mm = _int32(1000 * (HOME_ALTITUDE_M - d))
    return mavlink.MAVLink_home_position_message(
        latitude, longitude, altitude_mm, n, e, d, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, picture.boot_us
    )


def autopilot_version(firmware: Px4Release) -> Message:
    """AUTOPILOT_VERSION of the imitated release."""
    version, capabilities = _VERSION[firmware]
    return mavlink.MAVLink_autopilot_version_message(
        capabilities, version, version, 101854463, 1, [0] * 8, [0] * 8, [0] * 8, 0, 0, 5283920058631409231
    )


def statustext(severity: int, text: str) -> Message:
    """STATUSTEXT; PX4 ends those that it also sends as events with a tab, and so do these."""
    return mavlink.MAVLink_statustext_message(severity, f"{text[:49]}\t".encode())


BUILDERS: dict[int, Callable[[Picture], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: attitude_quaternion,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: attitude_target,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: servo_output_raw,
    mavlink.MAVLINK_MSG_ID_TIMESYNC: timesync,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: system_time,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: home_position,
}
"""How each stream's message is made; None: nothing to send now."""


def _geodetic(north_m: float, east_m: float) -> tuple[int, int]:
    latitude = HOME_LATITUDE_DEG + math.degrees(north_m / _EARTH_RADIUS_M)
    parallel_m = _EARTH_RADIUS_M * math.cos(math.radians(HOME_LATITUDE_DEG))
    longitude = HOME_LONGITUDE_DEG + math.degrees(east_m / parallel_m)
    return _int32(latitude * 1e7), _int32(longitude * 1e7)


def _int32(value: float) -> int:
    return max(-(2**31), min(2**31 - 1, round(value)))


def _int16(value: int) -> int:
    return max(-32768, min(32767, value))


def _wrapped(euler_rad: Vec3) -> Vec3:
    roll, pitch, yaw = euler_rad
    return ((roll + math.pi) % math.tau - math.pi, pitch, (yaw + math.pi) % math.tau - math.pi)
