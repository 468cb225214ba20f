"""ArduCopter's telemetry of its own state: messages filled as recorded. (What it measures: `measurements`.)"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.geometry import Vec3, wrap_pi
from sitl_mock.personality.ardupilot import measurements
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, Picture, geodetic, int16, int32, uint16

_CUSTOM_ENABLED, _STABILIZE, _MANUAL_INPUT, _GUIDED, _ARMED = 0x01, 0x10, 0x40, 0x08, 0x80
_PRESENT, _GPS = 0x5371FC0F, 0x20
_ENABLED, _HEALTH = 0x5241FC0F, 0x4751FC0F
"""SYS_STATUS's sensors at the start, as recorded; what changes is added."""
_AHRS, _LOGGING, _PREARM = 0x200000, 0x1000000, 0x10000000
_HEIGHT_CONTROL, _POSITION_CONTROL = 0x2000, 0x4000
_EKF_STARTING, _EKF_WITHOUT_GPS, _EKF_WITH_GPS = 0x400, 0xA7, 0x33F
_NAN = math.nan
_CAPABILITIES = 64495
_VERSION = 67567616
"""AUTOPILOT_VERSION's flight_sw_version of 4.7.0-dev."""


def heartbeat(picture: Picture) -> Message:
    """HEARTBEAT; the flag GUIDED says that the position control is at work, as ArduCopter has it."""
    flags = _CUSTOM_ENABLED | _STABILIZE | _MANUAL_INPUT
    flags |= (_GUIDED if picture.is_position_control else 0) | (_ARMED if picture.armed else 0)
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, flags, int(picture.mode), picture.status, 3
    )


def sys_status(picture: Picture) -> Message:
    """SYS_STATUS; its health has PREARM_CHECK once arming in the mode in force is allowed."""
    gps = _GPS if picture.boot_us >= picture.at.gps_us else 0
    ahrs = _AHRS if picture.boot_us >= picture.at.settled_us else 0
    idle = (0 if picture.is_position_control else _POSITION_CONTROL) | (
        0 if picture.is_height_control else _HEIGHT_CONTROL
    )
    enabled = (_ENABLED | gps | ahrs | (_LOGGING if picture.armed else 0)) & ~idle
    health = (_HEALTH | gps | ahrs | (_PREARM if picture.ready else 0)) & ~idle
    battery = picture.estimate.battery
    return mavlink.MAVLink_sys_status_message(
        _PRESENT | gps,
        enabled,
        health,
        0,
        uint16(1000 * battery.voltage_v),
        int16(100 * battery.current_a),
        int(100 * battery.remaining),
        *(0,) * 6,
    )


def attitude(picture: Picture) -> Message:
    """ATTITUDE."""
    roll, pitch, yaw = picture.estimate.euler_rad
    return mavlink.MAVLink_attitude_message(
        picture.boot_ms, wrap_pi(roll), pitch, wrap_pi(yaw), *picture.estimate.rates_frd_rad_s
    )


def attitude_quaternion(picture: Picture) -> Message:
    """ATTITUDE_QUATERNION."""
    estimate = picture.estimate
    return mavlink.MAVLink_attitude_quaternion_message(picture.boot_ms, *estimate.quaternion, *estimate.rates_frd_rad_s)


def local_position_ned(picture: Picture) -> Message | None:
    """LOCAL_POSITION_NED, once the estimator uses GPS."""
    if picture.boot_us < picture.at.position_us:
        return None
    estimate = picture.estimate
    return mavlink.MAVLink_local_position_ned_message(
        picture.boot_ms, *estimate.position_ned_m, *estimate.velocity_ned_m_s
    )


def global_position_int(picture: Picture) -> Message:
    """GLOBAL_POSITION_INT; zeros until there is GPS."""
    heading = round(math.degrees(picture.estimate.euler_rad[2]) * 100) % 36000
    if picture.boot_us < picture.at.gps_us:
        return mavlink.MAVLink_global_position_int_message(picture.boot_ms, 0, 0, 0, 0, 0, 0, 0, heading)
    estimate = picture.estimate
    down = estimate.position_ned_m[2]
    speeds = (int16(100 * v) for v in estimate.velocity_ned_m_s)
    above_home = int32(1000 * (picture.home_ned_m[2] - down))
    return mavlink.MAVLink_global_position_int_message(
        picture.boot_ms,
        *geodetic(estimate.position_ned_m),
        int32(1000 * (HOME_ALTITUDE_M - down)),
        above_home,
        *speeds,
        heading,
    )


def attitude_target(picture: Picture) -> Message:
    """ATTITUDE_TARGET: the attitude that is followed, and its rates."""
    return mavlink.MAVLink_attitude_target_message(
        picture.boot_ms, 0, list(picture.attitude_target), *picture.rates_target_rad_s, picture.thrust_norm
    )


def position_target_local_ned(picture: Picture) -> Message | None:
    """POSITION_TARGET_LOCAL_NED while the position control is at work."""
    if picture.target_ned_m is None:
        return None
    velocity = picture.target_velocity_ned_m_s
    return mavlink.MAVLink_position_target_local_ned_message(
        picture.boot_ms, 1, 0x0DC0, *picture.target_ned_m, *velocity, 0.0, 0.0, 0.0, 0.0, 0.0
    )


def position_target_global_int(picture: Picture) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT while the position control is at work."""
    if picture.target_ned_m is None:
        return None
    place, down = geodetic(picture.target_ned_m), picture.target_ned_m[2]
    return mavlink.MAVLink_position_target_global_int_message(
        picture.boot_ms, 0, 0x0FF8, *place, HOME_ALTITUDE_M - down, *(0.0,) * 8
    )


def servo_output_raw(picture: Picture) -> Message:
    """SERVO_OUTPUT_RAW: the four motors."""
    return mavlink.MAVLink_servo_output_raw_message(picture.boot_us & 0xFFFFFFFF, 0, *picture.outputs_us, 0, 0, 0, 0)


def extended_sys_state(picture: Picture) -> Message:
    """EXTENDED_SYS_STATE."""
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_MC, picture.landed_state)


def vfr_hud(picture: Picture) -> Message:
    """VFR_HUD."""
    estimate = picture.estimate
    vn, ve, vd = estimate.velocity_ned_m_s
    has_gps = picture.boot_us >= picture.at.gps_us
    altitude = HOME_ALTITUDE_M - estimate.position_ned_m[2] if has_gps else 0.0
    heading = int(math.degrees(estimate.euler_rad[2])) % 360
    speed, throttle = math.hypot(vn, ve), max(0, min(100, int(100 * picture.thrust_norm)))
    return mavlink.MAVLink_vfr_hud_message(speed, speed, heading, throttle, altitude, -vd)


def ekf_status_report(picture: Picture) -> Message:
    """EKF_STATUS_REPORT: its flags over time, with the small variances of a calm flight."""
    flags = _EKF_STARTING if picture.boot_us < picture.at.ekf_us else 0
    if picture.boot_us >= picture.at.yaw_us:
        flags = _EKF_WITH_GPS if picture.boot_us >= picture.at.position_us else _EKF_WITHOUT_GPS
    variance = 0.006 if flags == _EKF_WITH_GPS else 0.0
    return mavlink.MAVLink_ekf_status_report_message(flags, variance, 0.002, 0.001, 0.02, 0.0)


def nav_controller_output(picture: Picture) -> Message:
    """NAV_CONTROLLER_OUTPUT: lean angles in degrees, and the way to the target in m."""
    roll, pitch, _ = (math.degrees(angle) for angle in picture.estimate.euler_rad)
    to_go = _to_go(picture)
    bearing = int16(math.degrees(math.atan2(to_go[1], to_go[0])))
    distance = uint16(math.hypot(to_go[0], to_go[1]))
    return mavlink.MAVLink_nav_controller_output_message(roll, pitch, bearing, bearing, distance, -to_go[2], 0.0, 0.0)


def _to_go(picture: Picture) -> Vec3:
    if picture.target_ned_m is None:
        return (0.0, 0.0, 0.0)
    n, e, d = (there - here for there, here in zip(picture.target_ned_m, picture.estimate.position_ned_m, strict=True))
    return (n, e, d)


def mission_current(picture: Picture) -> Message:
    """MISSION_CURRENT."""
    return mavlink.MAVLink_mission_current_message(*picture.mission)


def fence_status(picture: Picture) -> Message:
    """FENCE_STATUS."""
    return mavlink.MAVLink_fence_status_message(int(picture.is_outside), picture.fence_breaches & 0xFFFF, 0, 0)


def home_position(picture: Picture) -> Message | None:
    """HOME_POSITION, once there is one."""
    if picture.boot_us < picture.at.origin_us:
        return None
    place, home = geodetic(picture.home_ned_m), picture.home_ned_m
    altitude = int32(1000 * (HOME_ALTITUDE_M - home[2]))
    return mavlink.MAVLink_home_position_message(*place, altitude, *home, [_NAN] * 4, 0.0, 0.0, 0.0, picture.boot_us)


def gps_global_origin(picture: Picture) -> Message | None:
    """GPS_GLOBAL_ORIGIN, once there is one."""
    if picture.boot_us < picture.at.origin_us:
        return None
    place = geodetic((0.0, 0.0, 0.0))
    return mavlink.MAVLink_gps_global_origin_message(*place, int32(1000 * HOME_ALTITUDE_M), picture.boot_us)


def autopilot_version(picture: Picture) -> Message:
    """AUTOPILOT_VERSION of 4.7.0-dev."""
    uid2 = [*b"3d1219c7c4c5404aa", 0]
    return mavlink.MAVLink_autopilot_version_message(
        _CAPABILITIES, _VERSION, 0, 0, 0, list(b"8fdb6a37"), [0] * 8, [0] * 8, 0, 0, 0, uid2
    )


def timesync(picture: Picture) -> Message:
    """TIMESYNC as a question of our own (tc1 = 0)."""
    return mavlink.MAVLink_timesync_message(0, picture.boot_us * 1000 + 1)


BUILDERS: dict[int, Callable[[Picture], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: attitude_quaternion,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: attitude_target,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: position_target_local_ned,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: position_target_global_int,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: servo_output_raw,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: vfr_hud,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ekf_status_report,
    mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: nav_controller_output,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: mission_current,
    mavlink.MAVLINK_MSG_ID_FENCE_STATUS: fence_status,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: home_position,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: gps_global_origin,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    **measurements.BUILDERS,
}
"""How each message is made, by its id; None: nothing to send now."""
