"""ArduCopter's telemetry of what it measures: inertial units, barometer, GPS, battery, its processor, the pilot."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.geometry import Vec3, conjugate, rotate, to_euler, wrap_pi
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, Picture, geodetic, int16, int32, uint16

_FIELD_NED_MGAUSS = (232.1732, 52.7375, -528.9117)
"""The magnetic field at SITL's home, as recorded from a vehicle that looks north."""
_GRAVITY_M_S2 = 9.80665
_PRESSURE_HPA = 945.028
_GPS_EVERY_MS, _GPS_PHASE_MS, _GPS_LAG_MS = 200, 173, 60
_STICKS = (1500, 1500, None, 1500, 1800, 1000, 1000, 1800)
"""What SITL feeds itself while nobody sends RC; the throttle is the third."""
_CAPACITY_MAH = 3300.0
_NO_CELL = 65535


def raw_imu(picture: Picture) -> Message:
    """RAW_IMU: milli-g, mrad/s, milli-gauss."""
    stamp = picture.boot_us & 0xFFFFFFFFFFFFFFFF
    return mavlink.MAVLink_raw_imu_message(stamp, *_inertial(picture), 0, _temperature_cdeg(picture))


def scaled_imu2(picture: Picture) -> Message:
    """SCALED_IMU2."""
    return mavlink.MAVLink_scaled_imu2_message(picture.boot_ms, *_inertial(picture), _temperature_cdeg(picture))


def scaled_imu3(picture: Picture) -> Message:
    """SCALED_IMU3."""
    return mavlink.MAVLink_scaled_imu3_message(picture.boot_ms, *_inertial(picture), _temperature_cdeg(picture))


def highres_imu(picture: Picture) -> Message:
    """HIGHRES_IMU: m/s^2, rad/s, and the field in thousandths of what MAVLink says (milli-gauss times 1000), as recorded."""
    estimate = picture.estimate
    field = (1000.0 * part for part in _field_frd(picture))
    return mavlink.MAVLink_highres_imu_message(
        picture.boot_us,
        *estimate.specific_force_frd_m_s2,
        *estimate.rates_frd_rad_s,
        *field,
        _pressure_hpa(picture),
        0.0,
        0.0,
        _temperature_cdeg(picture) / 100.0,
        8191,
        0,
    )


def scaled_pressure(picture: Picture) -> Message:
    """SCALED_PRESSURE."""
    return mavlink.MAVLink_scaled_pressure_message(picture.boot_ms, _pressure_hpa(picture), 0.0, 3112)


def scaled_pressure2(picture: Picture) -> Message:
    """SCALED_PRESSURE2."""
    return mavlink.MAVLink_scaled_pressure2_message(picture.boot_ms, _pressure_hpa(picture), 0.0, 3112)


def gps_raw_int(picture: Picture) -> Message:
    """GPS_RAW_INT: the sample of up to 260 ms ago; no receiver at first."""
    if picture.boot_us < picture.at.gps_us:
        return mavlink.MAVLink_gps_raw_int_message(0, 0, 0, 0, 0, 65535, 65535, 0, 0, 0)
    sample_ms = picture.boot_us // 1000 - _GPS_LAG_MS - _GPS_PHASE_MS
    stamp_us = max(0, 1000 * (sample_ms // _GPS_EVERY_MS * _GPS_EVERY_MS + _GPS_PHASE_MS))
    estimate = picture.estimate
    vn, ve, _ = estimate.velocity_ned_m_s
    altitude = int32(1000 * (HOME_ALTITUDE_M - estimate.position_ned_m[2]))
    course = round(100 * math.degrees(math.atan2(ve, vn))) % 36000
    place, speed = geodetic(estimate.position_ned_m), uint16(100 * math.hypot(vn, ve))
    return mavlink.MAVLink_gps_raw_int_message(
        stamp_us, 6, *place, altitude, 121, 200, speed, course, 10, altitude, 300, 300, 0, 0, 0
    )


def battery_status(picture: Picture) -> Message:
    """BATTERY_STATUS."""
    battery = picture.estimate.battery
    used = _CAPACITY_MAH * (1.0 - battery.remaining)
    cells = [uint16(1000 * battery.voltage_v), *[_NO_CELL] * 9]
    return mavlink.MAVLink_battery_status_message(
        0, 0, 0, 32767, cells, int16(100 * battery.current_a), int32(used), -1, int(100 * battery.remaining), 0, 1
    )


def power_status(picture: Picture) -> Message:
    """POWER_STATUS."""
    return mavlink.MAVLink_power_status_message(5000, 0, 0)


def mcu_status(picture: Picture) -> Message:
    """MCU_STATUS."""
    return mavlink.MAVLink_mcu_status_message(0, 2500, 5000, 5000, 5000)


def meminfo(picture: Picture) -> Message:
    """MEMINFO."""
    return mavlink.MAVLink_meminfo_message(0, 65535, 131072)


def vibration(picture: Picture) -> Message:
    """VIBRATION: SITL has next to none."""
    return mavlink.MAVLink_vibration_message(picture.boot_us, 0.002, 0.002, 0.002, 0, 0, 0)


def rc_channels(picture: Picture) -> Message:
    """RC_CHANNELS."""
    sticks = [picture.stick_us if pulse is None else pulse for pulse in _STICKS]
    return mavlink.MAVLink_rc_channels_message(picture.boot_ms, 16, *sticks, *(0,) * 10, 255)


def system_time(picture: Picture) -> Message:
    """SYSTEM_TIME; the mock knows no calendar, only its time since boot."""
    return mavlink.MAVLink_system_time_message(0, picture.boot_ms)


def ahrs(picture: Picture) -> Message:
    """AHRS."""
    return mavlink.MAVLink_ahrs_message(0.0, 0.0, 0.0, 0.0, 0.0, 0.002, 0.002)


def ahrs2(picture: Picture) -> Message:
    """AHRS2: the second estimator's attitude and place, here the same as the first's."""
    roll, pitch, yaw = picture.estimate.euler_rad
    altitude = HOME_ALTITUDE_M - picture.estimate.position_ned_m[2]
    place = geodetic(picture.estimate.position_ned_m)
    return mavlink.MAVLink_ahrs2_message(wrap_pi(roll), pitch, wrap_pi(yaw), altitude, *place)


def simstate(picture: Picture) -> Message:
    """SIMSTATE: what is true in the simulation."""
    truth = picture.truth
    roll, pitch, yaw = to_euler(truth.quaternion)
    place = geodetic(truth.position_ned_m)
    force = picture.estimate.specific_force_frd_m_s2
    return mavlink.MAVLink_simstate_message(roll, pitch, yaw, *force, *truth.rates_frd_rad_s, *place)


def wind(picture: Picture) -> Message:
    """WIND as the estimator has it: calm."""
    return mavlink.MAVLink_wind_message(180.0, 0.0, 0.0)


def _inertial(picture: Picture) -> tuple[int, ...]:
    force = (1000.0 * part / _GRAVITY_M_S2 for part in picture.estimate.specific_force_frd_m_s2)
    rates = (1000.0 * rate for rate in picture.estimate.rates_frd_rad_s)
    return tuple(int16(value) for value in (*force, *rates, *_field_frd(picture)))


def _field_frd(picture: Picture) -> Vec3:
    return rotate(conjugate(picture.truth.quaternion), _FIELD_NED_MGAUSS)


def _temperature_cdeg(picture: Picture) -> int:
    """The board warms up: 24.8 degrees C at boot, 36 in the end, 145 s in between, as recorded."""
    return int16(2480.0 + 1120.0 * (1.0 - math.exp(-picture.boot_us / 145e6)))


def _pressure_hpa(picture: Picture) -> float:
    """The standard atmosphere's pressure at the vehicle's height above home."""
    part = 1.0 + 0.0065 * picture.truth.position_ned_m[2] / 284.35
    return _PRESSURE_HPA * math.pow(max(0.01, part), 5.2559)


BUILDERS: dict[int, Callable[[Picture], Message | None]] = {
    mavlink.MAVLINK_MSG_ID_RAW_IMU: raw_imu,
    mavlink.MAVLINK_MSG_ID_SCALED_IMU2: scaled_imu2,
    mavlink.MAVLINK_MSG_ID_SCALED_IMU3: scaled_imu3,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: highres_imu,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: scaled_pressure,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2: scaled_pressure2,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: gps_raw_int,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_POWER_STATUS: power_status,
    mavlink.MAVLINK_MSG_ID_MCU_STATUS: mcu_status,
    mavlink.MAVLINK_MSG_ID_MEMINFO: meminfo,
    mavlink.MAVLINK_MSG_ID_VIBRATION: vibration,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: rc_channels,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: system_time,
    mavlink.MAVLINK_MSG_ID_AHRS: ahrs,
    mavlink.MAVLINK_MSG_ID_AHRS2: ahrs2,
    mavlink.MAVLINK_MSG_ID_SIMSTATE: simstate,
    mavlink.MAVLINK_MSG_ID_WIND: wind,
}
"""How each message is made, by its id."""
