"""PX4's messages of its own state, and how every stream's message is made."""

from __future__ import annotations

from collections.abc import Callable

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.battery import Battery
from sitl_mock.config import Px4Release
from sitl_mock.personality.px4 import telemetry_pose as pose
from sitl_mock.personality.px4 import telemetry_sensors as sensors
from sitl_mock.personality.px4 import telemetry_targets as targets
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.picture import Picture, int16, uint16

_PREARM_CHECK = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_SENSORS_NEW = (0x0300402F, 0x0301402F, 0x1320C83F)
_SENSORS: dict[Px4Release, tuple[int, int, int]] = {
    "1.13": (0x9020802C, 0x9020800C, 0x9020802F),
    "1.14": _SENSORS_NEW,
    "1.15": _SENSORS_NEW,
    "1.16": _SENSORS_NEW,
    "1.17": _SENSORS_NEW,
}
"""SYS_STATUS's sensors present, enabled and healthy when ready to arm, as recorded from SIH.

Those of 1.14 and 1.15 are taken to be 1.16's."""
_LOAD_113, _LOAD_NEW = 290, 176
"""SYS_STATUS.load in per mille, as recorded."""
_UNKNOWN_CURRENT_CA = -100
"""What SIH shows of a battery that does not tell its current."""
_CELLS_UNUSED = 65535
_CHARGE_STATES = (
    (0.05, mavlink.MAV_BATTERY_CHARGE_STATE_EMERGENCY),
    (0.07, mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL),
    (0.15, mavlink.MAV_BATTERY_CHARGE_STATE_LOW),
)
"""Below which share of the charge (PX4's BAT_EMERGEN_THR, BAT_CRIT_THR, BAT_LOW_THR at their defaults) it is what."""
_OS_VERSION = 101854463
_BOARD_UID = 5283920058631409231
_VERSION: dict[Px4Release, tuple[int, int, tuple[int, ...]]] = {
    "1.13": (17629952, 58623, (0, 0, 0, 215, 160, 178, 138, 28)),
    "1.14": (17695999, 60671, (0, 0, 0, 34, 189, 242, 85, 21)),
    "1.15": (17761535, 59647, (0, 0, 0, 127, 64, 4, 196, 153)),
    "1.16": (17826559, 59647, (0, 0, 0, 252, 95, 69, 240, 84)),
    "1.17": (17891583, 59647, (0, 0, 0, 196, 209, 42, 241, 214)),
}
"""AUTOPILOT_VERSION.flight_sw_version, capabilities and flight_custom_version of 1.13.3, 1.14.4, 1.15.4, 1.16.2, 1.17.0."""


def heartbeat(picture: Picture) -> Message:
    """HEARTBEAT of a PX4 quadrotor."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_AUTOPILOT_PX4,
        picture.mode.base_mode(picture.armed),
        picture.mode.custom_mode,
        picture.system_status(picture.boot_us),
        3,
    )


def timesync(picture: Picture) -> Message:
    """TIMESYNC as a question of our own (tc1 = 0)."""
    return mavlink.MAVLink_timesync_message(0, picture.boot_us * 1000)


def ping(picture: Picture) -> Message:
    """PING to whoever hears it; numbered by the seconds since boot."""
    return mavlink.MAVLink_ping_message(picture.boot_us, picture.boot_us // 1_000_000, 0, 0)


def system_time(picture: Picture) -> Message:
    """SYSTEM_TIME: the calendar's time, and the time since boot."""
    return mavlink.MAVLink_system_time_message(picture.unix_us, picture.boot_us // 1000)


def sys_status(picture: Picture) -> Message:
    """SYS_STATUS; its health has PREARM_CHECK once arming is allowed."""
    present, enabled, health = _SENSORS[picture.firmware]
    if not picture.is_ready(picture.boot_us):
        health &= ~_PREARM_CHECK
    battery = picture.estimate.battery
    return mavlink.MAVLink_sys_status_message(
        present,
        enabled,
        health,
        _LOAD_113 if picture.is_113 else _LOAD_NEW,
        uint16(1000 * battery.voltage_v),
        _current_ca(battery),
        _percent(battery),
        *(0,) * 8,
        0 if picture.is_113 else 1,
    )


def battery_status(picture: Picture) -> Message:
    """BATTERY_STATUS: the voltage of all cells together, and what the charge left means."""
    battery = picture.estimate.battery
    states = [state for share, state in _CHARGE_STATES if battery.remaining < share]
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        32767,
        [uint16(1000 * battery.voltage_v), *(_CELLS_UNUSED,) * 9],
        _current_ca(battery),
        0,
        -1,
        _percent(battery),
        0,
        states[0] if states else mavlink.MAV_BATTERY_CHARGE_STATE_OK,
        [_CELLS_UNUSED] * 4 if picture.is_113 else [0] * 4,
    )


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


def mission_current(picture: Picture) -> Message:
    """MISSION_CURRENT, which 1.16 sends all the time."""
    return picture.mission_current()


def autopilot_version(picture: Picture) -> Message:
    """AUTOPILOT_VERSION of the imitated release."""
    version, capabilities, custom = _VERSION[picture.firmware]
    return mavlink.MAVLink_autopilot_version_message(
        capabilities,
        version,
        version,
        _OS_VERSION,
        1,
        list(custom),
        list(custom),
        [0] * 8,
        0,
        0,
        _BOARD_UID,
    )


def _current_ca(battery: Battery) -> int:
    return int16(100 * battery.current_a) if battery.current_a else _UNKNOWN_CURRENT_CA


def _percent(battery: Battery) -> int:
    return max(0, min(100, round(100 * battery.remaining)))


BUILDERS: dict[int, Callable[[Picture], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mavlink.MAVLINK_MSG_ID_TIMESYNC: timesync,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: sensors.highres_imu,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: pose.local_position_ned,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: pose.attitude,
    mavlink.MAVLINK_MSG_ID_ALTITUDE: pose.altitude,
    mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR: sensors.distance_sensor,
    mavlink.MAVLINK_MSG_ID_ODOMETRY: pose.odometry,
    mavlink.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: targets.actuator_control_target,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: pose.attitude_quaternion,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: targets.attitude_target,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: sensors.estimator_status,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: pose.global_position_int,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: sensors.gps_raw_int,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: pose.home_position,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: mission_current,
    mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION: sensors.open_drone_id_location,
    mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM: sensors.open_drone_id_system,
    mavlink.MAVLINK_MSG_ID_PING: ping,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: targets.position_target_global_int,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: targets.position_target_local_ned,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: sensors.scaled_pressure,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: targets.servo_output_raw,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: system_time,
    mavlink.MAVLINK_MSG_ID_UTM_GLOBAL_POSITION: sensors.utm_global_position,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: pose.vfr_hud,
    mavlink.MAVLINK_MSG_ID_VIBRATION: sensors.vibration,
    mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS: targets.actuator_output_status,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: pose.gps_global_origin,
}
"""How each message is made, those of streams and those sent on request only; None: nothing to send now."""

ON_REQUEST = frozenset({mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN})
"""Messages without a stream."""
