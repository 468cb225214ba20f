"""PX4's messages of where the vehicle is and how it moves, filled as PX4 fills them."""

from __future__ import annotations

import math

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.geometry import Vec3, conjugate, rotate
from sitl_mock.personality.px4.picture import Picture, degrees_e7, heading_cdeg, int16, int32
from sitl_mock.sensors import Estimate

_LEAST_CLEARANCE_M = 0.1
_NAN = math.nan
_POSE_VARIANCES_NEW = (0.0423, 0.042, 0.0845, 3.06e-4, 3.43e-4, 8.25e-3)
_VELOCITY_VARIANCES_NEW = (9.73e-3, 8.98e-3, 5.4e-3, _NAN, _NAN, _NAN)
_POSE_VARIANCES_113 = (0.0212, 0.0212, 2.17e-3, 0.0, 0.0, 0.0)
_VELOCITY_VARIANCES_113 = (7.11e-3, 7.1e-3, 2.52e-3, 0.0, 0.0, 0.0)
"""Variances in flight as recorded: x, y, z, roll, pitch, yaw and their rates of change."""
_RESETS_113, _RESETS_NEW = 11, 14
"""What ODOMETRY counts of the estimator's resets before a flight, as recorded."""


def _upper_triangle(variances: tuple[float, ...], elsewhere: float) -> list[float]:
    """A diagonal matrix of order 6 as the messages have it: 21 numbers, row by row from the diagonal on."""
    return [variances[row] if row == column else elsewhere for row in range(6) for column in range(row, 6)]


_COVARIANCES_113 = (_upper_triangle(_POSE_VARIANCES_113, 0.0), _upper_triangle(_VELOCITY_VARIANCES_113, 0.0))
_COVARIANCES_NEW = (_upper_triangle(_POSE_VARIANCES_NEW, _NAN), _upper_triangle(_VELOCITY_VARIANCES_NEW, _NAN))


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
    """LOCAL_POSITION_NED, stamped with the time of its sample."""
    estimate = picture.position
    return mavlink.MAVLink_local_position_ned_message(
        estimate.stamp_us // 1000, *estimate.position_ned_m, *estimate.velocity_ned_m_s
    )


def global_position_int(picture: Picture) -> Message:
    """GLOBAL_POSITION_INT of the same sample; `relative_alt` counts from home."""
    estimate = picture.position
    latitude, longitude, altitude_m = picture.origin.geographic(estimate.position_ned_m)
    vn, ve, vd = estimate.velocity_ned_m_s
    return mavlink.MAVLink_global_position_int_message(
        estimate.stamp_us // 1000,
        degrees_e7(latitude),
        degrees_e7(longitude),
        int32(1000 * altitude_m),
        int32(1000 * (altitude_m - picture.home_altitude_m)),
        int16(100 * vn),
        int16(100 * ve),
        int16(100 * vd),
        heading_cdeg(estimate.euler_rad[2]),
    )


def odometry(picture: Picture) -> Message:
    """ODOMETRY of the same sample. The velocity is along the body's axes on 1.13, along NED on 1.16."""
    estimate = picture.position
    resets = _RESETS_113 if picture.is_113 else _RESETS_NEW
    velocity = _body_velocity(estimate) if picture.is_113 else estimate.velocity_ned_m_s
    child = mavlink.MAV_FRAME_BODY_FRD if picture.is_113 else mavlink.MAV_FRAME_LOCAL_NED
    return mavlink.MAVLink_odometry_message(
        estimate.stamp_us,
        mavlink.MAV_FRAME_LOCAL_NED,
        child,
        *estimate.position_ned_m,
        list(estimate.quaternion),
        *velocity,
        *estimate.rates_frd_rad_s,
        *(_COVARIANCES_113 if picture.is_113 else _COVARIANCES_NEW),
        (resets + estimate.reset_count) % 256,
        mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT,
    )


def vfr_hud(picture: Picture) -> Message:
    """VFR_HUD: no airspeed; throttle in per cent, 0 when disarmed."""
    estimate = picture.position
    vn, ve, vd = estimate.velocity_ned_m_s
    return mavlink.MAVLink_vfr_hud_message(
        0.0,
        math.hypot(vn, ve),
        heading_cdeg(estimate.euler_rad[2]) // 100,
        int(100 * picture.controls.thrust_norm) if picture.armed else 0,
        picture.origin.altitude_m - estimate.position_ned_m[2],
        -vd,
    )


def altitude(picture: Picture) -> Message:
    """ALTITUDE: by the barometer, above sea level, above the origin, above home; of the ground, above the ground."""
    up_m = -picture.position.position_ned_m[2]
    clearance_m = max(_LEAST_CLEARANCE_M, height_above_ground_m(picture))
    amsl_m = picture.origin.altitude_m + up_m
    return mavlink.MAVLink_altitude_message(
        picture.boot_us,
        picture.readings.pressure_altitude_m(picture.estimate),
        amsl_m,
        up_m,
        amsl_m - picture.home_altitude_m,
        up_m - clearance_m,
        clearance_m,
    )


def height_above_ground_m(picture: Picture) -> float:
    """Height above the plane z = 0, where the simulated vehicle starts; what is landed is on it, whatever is estimated."""
    return 0.0 if picture.landed else max(0.0, -picture.estimate.position_ned_m[2])


def home_position(picture: Picture) -> Message:
    """HOME_POSITION: where the vehicle was armed last, and its heading there."""
    home = picture.home
    latitude, longitude, altitude_m = picture.origin.geographic(home.position_ned_m)
    facing = [math.cos(0.5 * home.yaw_rad), 0.0, 0.0, math.sin(0.5 * home.yaw_rad)]
    return mavlink.MAVLink_home_position_message(
        degrees_e7(latitude),
        degrees_e7(longitude),
        int32(1000 * altitude_m),
        *home.position_ned_m,
        facing,
        0.0,
        0.0,
        0.0,
        home.since_us,
    )


def gps_global_origin(picture: Picture) -> Message:
    """GPS_GLOBAL_ORIGIN: what LOCAL_POSITION_NED counts from."""
    origin = picture.origin
    return mavlink.MAVLink_gps_global_origin_message(
        degrees_e7(origin.latitude_deg),
        degrees_e7(origin.longitude_deg),
        int32(1000 * origin.altitude_m),
        picture.boot_us,
    )


def _body_velocity(estimate: Estimate) -> Vec3:
    return rotate(conjugate(estimate.quaternion), estimate.velocity_ned_m_s)


def _wrapped(euler_rad: Vec3) -> Vec3:
    roll, pitch, yaw = euler_rad
    return ((roll + math.pi) % math.tau - math.pi, pitch, (yaw + math.pi) % math.tau - math.pi)
