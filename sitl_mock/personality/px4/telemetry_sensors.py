"""PX4's messages of what sensors measure, filled as PX4 fills them for its simulator SIH.

Constants without a source are as recorded from SIH in flight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.geometry import Vec3
from sitl_mock.personality.px4.picture import Picture, degrees_e7, int16, int32, uint16
from sitl_mock.personality.px4.readings import GpsFix, standard_pressure_pa, standard_temperature_c
from sitl_mock.personality.px4.telemetry_pose import height_above_ground_m

_INERTIAL, _MAGNETIC, _BAROMETRIC = 0x003F, 0x01C0, 0x1A00
"""HIGHRES_IMU.fields_updated of accelerometer and gyroscope, of the magnetometer, of the barometer."""
_MAX_DISTANCE_CM = 10_000
_FACING_DOWN = mavlink.MAV_SENSOR_ROTATION_PITCH_270
_NO_ID = [0] * 20
_NO_EPOCH_S = 2_748_666_496
"""OPEN_DRONE_ID_SYSTEM.timestamp of a clock at 1970, which its epoch of 2019 turns negative."""


class _Quality(NamedTuple):
    """ESTIMATOR_STATUS: flags, the test ratios, and the accuracies in m."""

    flags: int
    ratios: tuple[float, float, float, float, float, float]
    horizontal_m: float
    vertical_m: float


_QUALITY_113 = _Quality(895, (0.058, 0.057, 0.0135, 0.074, 0.0012, 0.0), 0.206, 0.0466)
_QUALITY_NEW = _Quality(895, (0.142, 0.053, 0.025, 0.093, 0.007, math.nan), 0.294, 0.293)
_CONSTANT_POSITION: int = mavlink.ESTIMATOR_CONST_POS_MODE
"""A flag that 1.16 has besides while it stands."""
_VIBRATION_FLYING, _VIBRATION_STANDING = (0.0, 0.1, 1.42), (0.0, 0.011, 0.114)
_ON_GROUND, _AIRBORNE = 1, 3
_UTM_FLAGS, _UTM_NEXT_WAYPOINT = 0x7D, 0x80
"""UTM_GLOBAL_POSITION: all but the UAS id is there; the next waypoint only when there is one."""


def highres_imu(picture: Picture) -> Message:
    """HIGHRES_IMU: m/s^2, rad/s, gauss; the pressure is in Pa, as PX4 sends it."""
    estimate, readings = picture.estimate, picture.readings
    altitude_m = readings.pressure_altitude_m(estimate)
    has_pressure, has_field = readings.is_new(picture.boot_us)
    return mavlink.MAVLink_highres_imu_message(
        estimate.stamp_us,
        *readings.shaken(estimate.specific_force_frd_m_s2, not picture.landed),
        *estimate.rates_frd_rad_s,
        *readings.magnetic_field_frd_gauss(estimate),
        standard_pressure_pa(altitude_m),
        0.0,
        altitude_m,
        standard_temperature_c(altitude_m) if picture.is_113 else 15.0,
        _INERTIAL | (_MAGNETIC if has_field else 0) | (_BAROMETRIC if has_pressure else 0),
    )


def scaled_pressure(picture: Picture) -> Message:
    """SCALED_PRESSURE: hPa and hundredths of a degree."""
    altitude_m = picture.readings.pressure_altitude_m(picture.estimate)
    return mavlink.MAVLink_scaled_pressure_message(
        picture.estimate.stamp_us // 1000,
        0.01 * standard_pressure_pa(altitude_m),
        0.0,
        int16(100 * standard_temperature_c(altitude_m)),
    )


def gps_raw_int(picture: Picture) -> Message:
    """GPS_RAW_INT of the latest fix."""
    fix = picture.readings.gps(picture.position, picture.boot_us)
    altitude_mm = int32(1000 * fix.altitude_m)
    return mavlink.MAVLink_gps_raw_int_message(
        fix.stamp_us,
        mavlink.GPS_FIX_TYPE_3D_FIX,
        degrees_e7(fix.latitude_deg),
        degrees_e7(fix.longitude_deg),
        altitude_mm,
        70,
        110,
        _ground_speed_cm_s(fix),
        _course_cdeg(fix.velocity_ned_m_s),
        10,
        altitude_mm,
        900,
        1780,
        500 if picture.is_113 else 400,
    )


def distance_sensor(picture: Picture) -> Message:
    """DISTANCE_SENSOR: a laser that looks down; cm."""
    return mavlink.MAVLink_distance_sensor_message(
        picture.boot_us // 1000,
        0,
        _MAX_DISTANCE_CM,
        min(_MAX_DISTANCE_CM, round(100 * height_above_ground_m(picture))),
        mavlink.MAV_DISTANCE_SENSOR_LASER,
        0,
        _FACING_DOWN,
        0,
    )


def estimator_status(picture: Picture) -> Message:
    """ESTIMATOR_STATUS: all is well."""
    quality = _QUALITY_113 if picture.is_113 else _QUALITY_NEW
    return mavlink.MAVLink_estimator_status_message(
        picture.position.stamp_us,
        quality.flags | (_CONSTANT_POSITION if picture.landed and not picture.is_113 else 0),
        *quality.ratios,
        quality.horizontal_m,
        quality.vertical_m,
    )


def vibration(picture: Picture) -> Message:
    """VIBRATION, standing or flying."""
    shaking = _VIBRATION_STANDING if picture.landed else _VIBRATION_FLYING
    return mavlink.MAVLink_vibration_message(picture.boot_us, *shaking, 0, 0, 0)


def utm_global_position(picture: Picture) -> Message:
    """UTM_GLOBAL_POSITION, of 1.13."""
    estimate = picture.position
    latitude, longitude, altitude_m = picture.origin.geographic(estimate.position_ned_m)
    vn, ve, vd = estimate.velocity_ned_m_s
    has_next = picture.armed and picture.followed is not None
    return mavlink.MAVLink_utm_global_position_message(
        picture.unix_us,
        [0] * 18,
        degrees_e7(latitude),
        degrees_e7(longitude),
        int32(1000 * altitude_m),
        max(100, int32(1000 * height_above_ground_m(picture))),
        int16(100 * vn),
        int16(100 * ve),
        int16(100 * vd),
        923,
        1780,
        12,
        *(_next_waypoint(picture) if has_next else (0, 0, 0)),
        0,
        _ON_GROUND if picture.landed else _AIRBORNE,
        _UTM_FLAGS | (_UTM_NEXT_WAYPOINT if has_next else 0),
    )


def open_drone_id_location(picture: Picture) -> Message:
    """OPEN_DRONE_ID_LOCATION, of 1.14 and later: mostly the GPS's."""
    readings = picture.readings
    fix = readings.gps(picture.position, picture.boot_us)
    down_m_s = fix.velocity_ned_m_s[2]
    return mavlink.MAVLink_open_drone_id_location_message(
        0,
        0,
        _NO_ID,
        mavlink.MAV_ODID_STATUS_GROUND if picture.landed else mavlink.MAV_ODID_STATUS_AIRBORNE,
        _course_cdeg(fix.velocity_ned_m_s) // 100 * 100,
        _ground_speed_cm_s(fix),
        int16(-100 * down_m_s),
        degrees_e7(fix.latitude_deg),
        degrees_e7(fix.longitude_deg),
        readings.pressure_altitude_m(picture.estimate),
        float(math.floor(fix.altitude_m)),
        mavlink.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF,
        picture.origin.altitude_m - picture.position.position_ned_m[2] - picture.home_altitude_m,
        mavlink.MAV_ODID_HOR_ACC_1_METER,
        mavlink.MAV_ODID_VER_ACC_3_METER,
        0,
        mavlink.MAV_ODID_SPEED_ACC_1_METERS_PER_SECOND,
        65535.0,
        0,
    )


def open_drone_id_system(picture: Picture) -> Message:
    """OPEN_DRONE_ID_SYSTEM, of 1.14 and later: the operator stands at home."""
    latitude, longitude, altitude_m = picture.origin.geographic(picture.home.position_ned_m)
    return mavlink.MAVLink_open_drone_id_system_message(
        0,
        0,
        _NO_ID,
        mavlink.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF,
        0,
        degrees_e7(latitude),
        degrees_e7(longitude),
        1,
        0,
        -1000.0,
        -1000.0,
        0,
        0,
        altitude_m,
        _NO_EPOCH_S,
    )


def _next_waypoint(picture: Picture) -> tuple[int, int, int]:
    n, e, d = picture.followed.position_ned_m if picture.followed is not None else (None, None, None)
    here = picture.position.position_ned_m
    target = (here[0] if n is None else n, here[1] if e is None else e, here[2] if d is None else d)
    latitude, longitude, altitude_m = picture.origin.geographic(target)
    return degrees_e7(latitude), degrees_e7(longitude), int32(1000 * altitude_m)


def _ground_speed_cm_s(fix: GpsFix) -> int:
    vn, ve, _ = fix.velocity_ned_m_s
    return uint16(100 * math.hypot(vn, ve))


def _course_cdeg(velocity_ned_m_s: Vec3) -> int:
    vn, ve, _ = velocity_ned_m_s
    return round(math.degrees(math.atan2(ve, vn)) * 100) % 36000
