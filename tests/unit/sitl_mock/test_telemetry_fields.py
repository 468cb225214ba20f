"""Every message's fields against what is estimated: signs, units, frames; asymmetric numbers, worked out by hand."""

import math
import random
import statistics
from dataclasses import replace

import pytest

from mavquad.protocol.codec import Encoder, decode, mavlink
from sitl_mock.battery import Battery
from sitl_mock.inner_loops import Gains, PositionSetpoint, TorqueSetpoint
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.picture import Home, Picture
from sitl_mock.personality.px4.readings import Readings, standard_pressure_pa, standard_temperature_c
from sitl_mock.personality.px4.sites import ORIGINS
from sitl_mock.personality.px4.telemetry import BUILDERS
from sitl_mock.sensors import Estimate

IDS = {cls.msgname: i for i, cls in mavlink.mavlink_map.items()}
ROLL, PITCH, YAW = math.radians(10.0), math.radians(-20.0), math.radians(250.0)
METRES_PER_DEGREE = math.pi * 6371000.0 / 180.0


def quaternion(roll, pitch, yaw):
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def to_body(roll, pitch, yaw, vector):
    """Rx(roll) Ry(pitch) Rz(yaw): NED to FRD."""
    n, e, d = vector
    a, b = math.cos(yaw) * n + math.sin(yaw) * e, -math.sin(yaw) * n + math.cos(yaw) * e
    x, c = math.cos(pitch) * a - math.sin(pitch) * d, math.sin(pitch) * a + math.cos(pitch) * d
    return x, math.cos(roll) * b + math.sin(roll) * c, -math.sin(roll) * b + math.cos(roll) * c


ESTIMATE = Estimate(
    12_345_000,
    (100.0, -200.0, -30.0),
    (1.5, -2.5, 0.75),
    quaternion(ROLL, PITCH, YAW),
    (ROLL, PITCH, YAW),
    (0.1, -0.2, 0.3),
    (0.5, -0.6, -9.7),
    Battery(15.123, 12.34, 0.456),
    3,
)


def picture(firmware="1.16", **changes):
    origin = ORIGINS[firmware]
    return replace(
        Picture(
            firmware=firmware,
            boot_us=12_348_000,
            unix_us=1_700_000_012_348_000,
            estimate=ESTIMATE,
            position=ESTIMATE,
            mode=Mode.LOITER,
            armed=True,
            system_status=lambda boot_us: 4,
            is_ready=lambda boot_us: True,
            landed=False,
            home=Home((3.0, 4.0, -5.0), math.radians(60.0), 2_000_000),
            origin=origin,
            readings=Readings(firmware, origin, ESTIMATE, 0.0),
            attitude_target=quaternion(0.1, -0.2, 0.3),
            rates_target_rad_s=(0.4, 0.5, -0.6),
            attitude_thrust_norm=0.55,
            motor_commands=(0.1, 0.2, 0.3, 0.4),
            gains=Gains(),
            controls=TorqueSetpoint((0.01, -0.02, 0.03), 0.479),
            followed=PositionSetpoint((101.0, -202.0, -33.0), (0.1, 0.2, -0.3), (0.0, 0.0, 0.0), -2.0),
            is_torque_control=lambda: False,
            mission_current=lambda: mavlink.MAVLink_mission_current_message(2, 5),
        ),
        **changes,
    )


def sent(name, firmware="1.16", **changes):
    """The message as it comes out of its frame."""
    return decode(Encoder(1, 1).encode(BUILDERS[IDS[name]](picture(firmware, **changes))))


def close(*values, rel=1e-6):
    return pytest.approx(values, rel=rel, abs=1e-6)


def test_attitude():
    m = sent("ATTITUDE")
    assert m.time_boot_ms == 12_345
    assert (m.roll, m.pitch, m.yaw) == close(ROLL, PITCH, YAW - math.tau)
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == close(0.1, -0.2, 0.3)


def test_attitude_quaternion():
    m = sent("ATTITUDE_QUATERNION")
    assert (m.q1, m.q2, m.q3, m.q4) == close(*ESTIMATE.quaternion)
    assert (m.time_boot_ms, m.rollspeed, m.pitchspeed, m.yawspeed) == close(12_345, 0.1, -0.2, 0.3)


def test_local_position_ned_is_the_position_topics():
    older = replace(ESTIMATE, stamp_us=12_340_000, position_ned_m=(7.0, 8.0, -9.0))
    m = sent("LOCAL_POSITION_NED", position=older)
    assert (m.time_boot_ms, m.x, m.y, m.z, m.vx, m.vy, m.vz) == close(12_340, 7.0, 8.0, -9.0, 1.5, -2.5, 0.75)


@pytest.mark.parametrize("firmware", ["1.13", "1.16"])
def test_global_position_int(firmware):
    m = sent("GLOBAL_POSITION_INT", firmware)
    origin = ORIGINS[firmware]
    assert (m.lat * 1e-7 - origin.latitude_deg) * METRES_PER_DEGREE == pytest.approx(100.0, abs=0.02)
    eastwards = METRES_PER_DEGREE * math.cos(math.radians(origin.latitude_deg))
    assert (m.lon * 1e-7 - origin.longitude_deg) * eastwards == pytest.approx(-200.0, abs=0.03)
    assert m.alt == round(1000 * (origin.altitude_m + 30.0))
    assert m.relative_alt == 25_000  # home is 5 m above the origin
    assert (m.vx, m.vy, m.vz, m.hdg) == (150, -250, 75, 25_000)


def test_odometry_of_1_13_is_along_the_bodys_axes():
    m = sent("ODOMETRY", "1.13")
    assert (m.time_usec, m.frame_id, m.child_frame_id) == (12_345_000, 1, 12)
    assert (m.x, m.y, m.z) == close(100.0, -200.0, -30.0)
    assert m.q == close(*ESTIMATE.quaternion)
    assert (m.vx, m.vy, m.vz) == close(*to_body(ROLL, PITCH, YAW, (1.5, -2.5, 0.75)))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == close(0.1, -0.2, 0.3)
    assert [m.pose_covariance[i] for i in (0, 6, 11)] == close(0.0212, 0.0212, 0.00217)
    assert sum(m.pose_covariance) == pytest.approx(0.0212 + 0.0212 + 0.00217)
    assert (m.reset_counter, m.estimator_type, m.quality) == (11 + 3, 8, 0)


def test_odometry_of_1_16_is_along_ned():
    m = sent("ODOMETRY", "1.16")
    assert (m.frame_id, m.child_frame_id, m.reset_counter) == (1, 1, 14 + 3)
    assert (m.vx, m.vy, m.vz) == close(1.5, -2.5, 0.75)
    diagonal = {0, 6, 11, 15, 18, 20}
    assert {i for i, value in enumerate(m.pose_covariance) if math.isfinite(value)} == diagonal
    assert {i for i, value in enumerate(m.velocity_covariance) if math.isfinite(value)} == {0, 6, 11}


def test_vfr_hud():
    m = sent("VFR_HUD")
    assert (m.airspeed, m.heading, m.throttle) == (0.0, 250, 47)
    assert (m.groundspeed, m.alt, m.climb) == close(math.hypot(1.5, 2.5), 489.4 + 30.0, -0.75)
    assert sent("VFR_HUD", armed=False).throttle == 0


def test_altitude():
    m = sent("ALTITUDE")
    assert (m.time_usec, m.altitude_local) == close(12_348_000, 30.0)
    assert (m.altitude_amsl, m.altitude_relative) == close(519.4, 25.0)
    assert (m.altitude_terrain, m.bottom_clearance) == close(0.0, 30.0)
    assert m.altitude_monotonic == pytest.approx(519.4, abs=0.5)


def test_what_stands_has_no_height_above_the_ground():
    m = sent("ALTITUDE", landed=True)
    assert (m.bottom_clearance, m.altitude_terrain) == close(0.1, 29.9)
    assert sent("DISTANCE_SENSOR", landed=True).current_distance == 0


def test_home_position():
    m = sent("HOME_POSITION")
    assert (m.x, m.y, m.z, m.altitude, m.time_usec) == close(3.0, 4.0, -5.0, 494_400, 2_000_000)
    assert (m.latitude * 1e-7 - 47.3977432) * METRES_PER_DEGREE == pytest.approx(3.0, abs=0.02)
    assert m.q == close(math.sqrt(0.75), 0.0, 0.0, 0.5)


def test_gps_global_origin():
    m = sent("GPS_GLOBAL_ORIGIN", "1.13")
    assert (m.latitude, m.longitude, m.altitude) == (454671182, -737578241, 32_500)


def test_highres_imu():
    m = sent("HIGHRES_IMU")
    assert m.time_usec == 12_345_000
    assert (m.xacc, m.yacc, m.zacc, m.xgyro, m.ygyro, m.zgyro) == close(0.5, -0.6, -9.7, 0.1, -0.2, 0.3)
    assert m.abs_pressure == pytest.approx(standard_pressure_pa(m.pressure_alt), rel=1e-6)
    assert m.pressure_alt == pytest.approx(519.4, abs=0.5)
    assert (m.xmag, m.ymag, m.zmag) == pytest.approx(to_body(ROLL, PITCH, YAW, (0.218, 0.012, 0.428)), abs=0.08)
    assert m.temperature == 15.0
    assert sent("HIGHRES_IMU", "1.13").temperature == pytest.approx(15 - 0.0065 * 62.5, abs=0.01)


def test_the_standard_atmosphere():
    # ISO 2533: sea level, 500 m, 1000 m
    assert [standard_pressure_pa(h) for h in (0, 500, 1000)] == pytest.approx([101325, 95461, 89875], abs=2)
    assert standard_temperature_c(1000) == pytest.approx(8.5)


def test_scaled_pressure_is_in_hectopascal():
    m = sent("SCALED_PRESSURE")
    assert m.press_abs == pytest.approx(standard_pressure_pa(519.4) / 100, abs=0.1)
    assert (m.time_boot_ms, m.temperature) == (12_345, pytest.approx(1162, abs=1))


@pytest.mark.parametrize(("firmware", "speed_accuracy"), [("1.13", 500), ("1.16", 400)])
def test_gps_raw_int(firmware, speed_accuracy):
    m = sent("GPS_RAW_INT", firmware)
    origin = ORIGINS[firmware]
    assert (m.time_usec, m.fix_type, m.eph, m.epv, m.satellites_visible) == (12_348_000, 3, 70, 110, 10)
    assert (m.lat * 1e-7 - origin.latitude_deg) * METRES_PER_DEGREE == pytest.approx(100.0, abs=1.0)
    eastwards = METRES_PER_DEGREE * math.cos(math.radians(origin.latitude_deg))
    assert (m.lon * 1e-7 - origin.longitude_deg) * eastwards == pytest.approx(-200.0, abs=1.0)
    assert m.alt / 1000 == pytest.approx(origin.altitude_m + 30.0, abs=2.5)
    assert m.alt_ellipsoid == m.alt
    assert m.vel == pytest.approx(100 * math.hypot(1.5, 2.5), abs=40)
    assert m.cog / 100 == pytest.approx(360 - math.degrees(math.atan2(2.5, 1.5)), abs=8)
    assert (m.h_acc, m.v_acc, m.vel_acc) == (900, 1780, speed_accuracy)


def test_noise_of_the_readings_as_recorded_on_the_ground():
    # px4-v1.16.2-a, 0 to 3.5 s: sd of pressure_alt 0.061 m, of xmag 0.0115 G, of GPS altitude 0.51 m and latitude 2.1e-6
    shown = picture(boot_us=0)
    imu = [decode(Encoder(1, 1).encode(BUILDERS[IDS["HIGHRES_IMU"]](shown))) for _ in range(400)]
    assert statistics.pstdev(m.pressure_alt for m in imu) == pytest.approx(0.061, rel=0.15)
    assert statistics.pstdev(m.xmag for m in imu) == pytest.approx(0.0115, rel=0.15)
    fixes = [shown.readings.gps(ESTIMATE, 125_000 * k) for k in range(400)]
    assert statistics.pstdev(f.altitude_m for f in fixes) == pytest.approx(0.51, rel=0.15)
    assert statistics.pstdev(f.latitude_deg for f in fixes) == pytest.approx(2.1e-6, rel=0.2)


def test_shaking_in_flight_goes_with_the_noise_configured():
    # px4-v1.16.2-a, hover: sd of xacc 0.35, yacc 1.2, zacc 0.98; px4-v1.13.3-a: 0.27, 0.92, 0.78
    origin = ORIGINS["1.16"]
    for noise, wanted in ((0.07, (0.3, 1.0, 0.85)), (0.0, (0.0, 0.0, 0.0))):
        readings = Readings("1.16", origin, ESTIMATE, noise)
        shaken = [readings.shaken((1.0, 2.0, 3.0), is_flying=True) for _ in range(500)]
        assert [statistics.pstdev(axis) for axis in zip(*shaken, strict=True)] == pytest.approx(wanted, rel=0.12)
        assert [statistics.mean(axis) for axis in zip(*shaken, strict=True)] == pytest.approx((1, 2, 3), abs=0.15)
        assert readings.shaken((1.0, 2.0, 3.0), is_flying=False) == (1.0, 2.0, 3.0)


def test_fields_updated_as_recorded():
    # px4-v1.16.2-a at 50 Hz: only 63, 511, 6719, 7167; barometer 20 % of the time, magnetometer 29 %
    readings = Readings("1.16", ORIGINS["1.16"], ESTIMATE, 0.0)
    seen = [sent("HIGHRES_IMU", readings=readings, boot_us=20_000 * k).fields_updated for k in range(1000)]
    assert set(seen) == {63, 511, 6719, 7167}
    assert sum(bool(s & 0x1A00) for s in seen) / 1000 == pytest.approx(0.2, abs=0.01)
    assert sum(bool(s & 0x01C0) for s in seen) / 1000 == pytest.approx(0.286, abs=0.01)


def test_distance_sensor():
    m = sent("DISTANCE_SENSOR")
    assert (m.time_boot_ms, m.current_distance, m.max_distance, m.orientation) == (12_348, 3000, 10_000, 25)
    far = replace(ESTIMATE, position_ned_m=(0.0, 0.0, -400.0))
    assert sent("DISTANCE_SENSOR", estimate=far).current_distance == 10_000


def test_position_target_local_ned():
    m = sent("POSITION_TARGET_LOCAL_NED")
    assert (m.time_boot_ms, m.coordinate_frame, m.type_mask) == (12_348, 1, 0)
    assert (m.x, m.y, m.z, m.yaw, m.yaw_rate) == close(101.0, -202.0, -33.0, -2.0, 0.0)
    # position gains 0.95, 0.95, 1.0; vertical speed limited to 1.5 m/s
    assert (m.vx, m.vy, m.vz) == close(0.1 + 0.95 * 1.0, 0.2 - 0.95 * 2.0, -1.5)
    # thrust 0.55 along -z of the attitude wanted, in units of the hover thrust 0.4905
    lift = 9.81 * 0.55 / 0.4905
    assert to_body(0.1, -0.2, 0.3, (m.afx, m.afy, m.afz - 9.81)) == close(0.0, 0.0, -lift, rel=1e-5)


def test_position_target_where_an_axis_is_not_controlled():
    followed = PositionSetpoint((1.0, None, None), (0.0, None, 0.7), yaw_rate_rad_s=0.3)
    m = sent("POSITION_TARGET_LOCAL_NED", followed=followed)
    assert m.type_mask == 2 | 4 | 16
    assert all(math.isnan(value) for value in (m.y, m.z, m.vy))
    assert m.yaw_rate == pytest.approx(0.3)
    assert m.vz == pytest.approx(0.7)
    assert m.yaw == pytest.approx(YAW - math.tau)


def test_position_target_on_the_ground_as_recorded():
    m = sent("POSITION_TARGET_LOCAL_NED", followed=None)
    assert (m.type_mask, m.afx, m.afy, m.afz) == (63, 0.0, 0.0, 100.0)
    assert all(math.isnan(value) for value in (m.x, m.y, m.z, m.vx, m.vy, m.vz))


def test_position_targets_pause_while_rates_are_followed():
    assert BUILDERS[IDS["POSITION_TARGET_LOCAL_NED"]](picture(followed=None, mode=Mode.OFFBOARD)) is None
    assert BUILDERS[IDS["POSITION_TARGET_GLOBAL_INT"]](picture(followed=None, mode=Mode.OFFBOARD)) is None


def test_position_target_global_int():
    m = sent("POSITION_TARGET_GLOBAL_INT")
    assert (m.coordinate_frame, m.type_mask) == (5, 0)
    assert (m.lat_int * 1e-7 - 47.3977432) * METRES_PER_DEGREE == pytest.approx(101.0, abs=0.02)
    assert (m.alt, m.vz, m.yaw) == close(489.4 + 33.0, -1.5, -2.0)
    assert BUILDERS[IDS["POSITION_TARGET_GLOBAL_INT"]](picture(armed=False)) is None


def test_position_target_global_int_on_the_ground_and_in_a_landing_as_recorded():
    # px4-v1.16.2-a, from arming on: velocities NaN, af 0, 0, 100; in AUTO.LAND altitude 0
    m = sent("POSITION_TARGET_GLOBAL_INT", followed=None)
    assert (m.type_mask, m.alt, m.afx, m.afy, m.afz) == close(0, 519.4, 0.0, 0.0, 100.0)
    assert math.isnan(m.vx)
    m = sent("POSITION_TARGET_GLOBAL_INT", followed=PositionSetpoint((101.0, -202.0, None), (0.0, 0.0, 0.7)))
    assert (m.alt, m.vz) == close(0.0, 0.7)
    build = BUILDERS[IDS["POSITION_TARGET_GLOBAL_INT"]]
    assert [build(picture(firmware, mode=Mode.LAND)) is None for firmware in ("1.13", "1.16")] == [True, False]


def test_attitude_target():
    m = sent("ATTITUDE_TARGET")
    assert m.q == close(*quaternion(0.1, -0.2, 0.3))
    assert (m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust) == close(0.4, 0.5, -0.6, 0.55)
    assert BUILDERS[IDS["ATTITUDE_TARGET"]](picture(is_torque_control=lambda: True)) is None


def servos(m):
    return [getattr(m, f"servo{i}_raw") for i in range(1, 17)]


@pytest.mark.parametrize(
    ("firmware", "armed", "disarmed"),
    [
        ("1.13", [1500, 1500, 900, 900] + [0] * 8, [900] * 8 + [0] * 8),
        ("1.16", [900] * 12, [900] * 16),
    ],
)
def test_outputs(firmware, armed, disarmed):
    assert servos(sent("SERVO_OUTPUT_RAW", firmware)) == [1100, 1200, 1300, 1400, *armed]
    assert servos(sent("SERVO_OUTPUT_RAW", firmware, motor_commands=None)) == disarmed
    m = sent("ACTUATOR_OUTPUT_STATUS", firmware)
    assert (m.active, m.actuator) == (8, [1100.0, 1200.0, 1300.0, 1400.0, *map(float, armed[:4]), *(0.0,) * 24])


def test_actuator_control_target():
    m = sent("ACTUATOR_CONTROL_TARGET", "1.13")
    assert (m.time_usec, m.group_mlx) == (12_348_000, 0)
    assert m.controls == close(0.01, -0.02, 0.03, 0.479, 0.0, 0.0, 0.0, 1.0)
    assert sent("ACTUATOR_CONTROL_TARGET", "1.13", landed=True).controls[7] == -1.0


@pytest.mark.parametrize("name", ["SYS_STATUS", "BATTERY_STATUS"])
def test_the_battery(name):
    m = sent(name)
    voltage_mv = m.voltage_battery if name == "SYS_STATUS" else m.voltages[0]
    assert (voltage_mv, m.current_battery, m.battery_remaining) == (15_123, 1234, 46)
    unloaded = replace(ESTIMATE, battery=Battery(16.2, 0.0, 1.0))
    assert sent(name, estimate=unloaded).current_battery == -100  # as SIH shows it


@pytest.mark.parametrize(("remaining", "state"), [(0.2, 1), (0.149, 2), (0.069, 3), (0.049, 4)])
def test_what_the_charge_left_means(remaining, state):
    low = replace(ESTIMATE, battery=Battery(14.0, 1.0, remaining))
    assert sent("BATTERY_STATUS", estimate=low).charge_state == state


def test_what_differs_between_releases_as_recorded():
    assert sent("SYS_STATUS", "1.13").onboard_control_sensors_health_extended == 0
    assert sent("SYS_STATUS", "1.16").onboard_control_sensors_health_extended == 1
    assert sent("BATTERY_STATUS", "1.13").voltages_ext == [65535] * 4
    assert sent("BATTERY_STATUS", "1.16").voltages_ext == [0] * 4
    assert sent("ESTIMATOR_STATUS", "1.16", landed=True).flags == 1023
    assert sent("ESTIMATOR_STATUS", "1.16").flags == sent("ESTIMATOR_STATUS", "1.13", landed=True).flags == 895


@pytest.mark.parametrize(
    ("landed", "mode", "state"),
    [(True, Mode.LOITER, 1), (False, Mode.LOITER, 2), (False, Mode.TAKEOFF, 3), (False, Mode.LAND, 4)],
)
def test_extended_sys_state(landed, mode, state):
    assert sent("EXTENDED_SYS_STATE", landed=landed, mode=mode).landed_state == state


def test_times():
    assert (sent("SYSTEM_TIME").time_unix_usec, sent("SYSTEM_TIME").time_boot_ms) == (1_700_000_012_348_000, 12_348)
    assert (sent("TIMESYNC").tc1, sent("TIMESYNC").ts1) == (0, 12_348_000_000)
    ping = sent("PING")
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (12_348_000, 12, 0, 0)


def test_utm_global_position():
    m = sent("UTM_GLOBAL_POSITION", "1.13")
    assert (m.time, m.alt, m.relative_alt, m.next_alt) == (1_700_000_012_348_000, 62_500, 30_000, 65_500)
    assert (m.vx, m.vy, m.vz, m.flight_state, m.flags) == (150, -250, 75, 3, 253)
    assert (m.next_lat * 1e-7 - 45.4671182) * METRES_PER_DEGREE == pytest.approx(101.0, abs=0.02)
    m = sent("UTM_GLOBAL_POSITION", "1.13", landed=True, followed=None)
    assert (m.relative_alt, m.next_lat, m.flight_state, m.flags) == (100, 0, 1, 125)


def test_open_drone_id():
    m = sent("OPEN_DRONE_ID_LOCATION")
    assert (m.status, m.height, m.timestamp) == close(2, 25.0, 65535.0)
    assert m.speed_horizontal == pytest.approx(100 * math.hypot(1.5, 2.5), abs=40)
    assert m.speed_vertical == pytest.approx(-75, abs=30)
    assert m.direction % 100 == 0
    assert (m.latitude * 1e-7 - 47.3977432) * METRES_PER_DEGREE == pytest.approx(100.0, abs=1.0)
    m = sent("OPEN_DRONE_ID_SYSTEM")
    assert (m.operator_latitude * 1e-7 - 47.3977432) * METRES_PER_DEGREE == pytest.approx(3.0, abs=0.02)
    assert (m.operator_altitude_geo, m.timestamp) == close(494.4, 2_748_666_496)


def test_vibration_standing_and_flying():
    assert sent("VIBRATION").vibration_z == pytest.approx(1.42)
    assert sent("VIBRATION", landed=True).vibration_z == pytest.approx(0.114)


@pytest.mark.parametrize(
    ("firmware", "version", "custom"),
    [("1.13", 17629952, [0, 0, 0, 215, 160, 178, 138, 28]), ("1.16", 17826559, [0, 0, 0, 252, 95, 69, 240, 84])],
)
def test_autopilot_version_as_recorded(firmware, version, custom):
    m = sent("AUTOPILOT_VERSION", firmware)
    assert (m.flight_sw_version, m.middleware_sw_version, m.os_sw_version) == (version, version, 101854463)
    assert (m.flight_custom_version, m.board_version, m.uid) == (custom, 1, 5283920058631409231)


def test_heartbeat():
    m = sent("HEARTBEAT", system_status=lambda boot_us: 5)
    assert (m.type, m.autopilot, m.base_mode, m.custom_mode, m.system_status) == (2, 12, 157, 0x03040000, 5)


def test_mission_current():
    m = sent("MISSION_CURRENT")
    assert (m.seq, m.total) == (2, 5)


def test_every_message_is_made_for_every_attitude():
    randomly = random.Random(1)
    for _ in range(50):
        roll, pitch, yaw = (randomly.uniform(-3.1, 3.1), randomly.uniform(-1.5, 1.5), randomly.uniform(-7.0, 7.0))
        turned = replace(ESTIMATE, quaternion=quaternion(roll, pitch, yaw), euler_rad=(roll, pitch, yaw))
        m = sent("GLOBAL_POSITION_INT", position=turned)
        assert math.cos(math.radians(m.hdg / 100)) == pytest.approx(math.cos(yaw), abs=2e-4)
        assert math.sin(math.radians(m.hdg / 100)) == pytest.approx(math.sin(yaw), abs=2e-4)
        assert 0 <= sent("VFR_HUD", position=turned).heading < 360
        m = sent("ATTITUDE", estimate=turned)
        assert -math.pi - 1e-6 <= m.yaw <= math.pi + 1e-6
        m = sent("ODOMETRY", "1.13", position=turned)
        assert (m.vx, m.vy, m.vz) == close(*to_body(roll, pitch, yaw, (1.5, -2.5, 0.75)), rel=1e-5)
