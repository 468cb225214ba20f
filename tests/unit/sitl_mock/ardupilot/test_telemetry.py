"""The telemetry of the ArduCopter personality, against what was recorded on the ground and in a hover at 10 m."""

from __future__ import annotations

import math

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.ardupilot.telemetry import BUILDERS


def ask(vehicle, name):
    message_id = next(i for i, cls in mavlink.mavlink_map.items() if cls.msgname == name)
    vehicle.forget()
    assert vehicle.command(512, message_id) == [0], name
    return vehicle.messages(name)[-1]


@pytest.fixture
def ground(copter, quiet):
    return copter(sensors=quiet).run(1.1)


@pytest.fixture
def hovering(copter, quiet):
    return copter(sensors=quiet).hover().run(1.0)


def test_nothing_is_known_of_the_place_at_first(copter):
    vehicle = copter(ready_s=42.5).run(5.0)
    place = ask(vehicle, "GLOBAL_POSITION_INT")
    assert (place.lat, place.lon, place.alt) == (0, 0, 0)
    assert (ask(vehicle, "GPS_RAW_INT").fix_type, ask(vehicle, "GPS_RAW_INT").satellites_visible) == (0, 0)
    vehicle.command(512, mavlink.MAVLINK_MSG_ID_HOME_POSITION)
    assert not vehicle.messages("HOME_POSITION")


def test_the_estimator_over_time(copter):
    vehicle = copter(ready_s=42.5)
    for until_s, flags in ((4.4, 0x400), (5.6, 0), (6.0, 0xA7), (41.0, 0xA7), (42.0, 0x33F)):
        vehicle.run(until_s - vehicle.now_us / 1e6 % 1000)
        assert ask(vehicle, "EKF_STATUS_REPORT").flags == flags


@pytest.mark.parametrize(
    ("until_s", "present", "enabled", "health"),
    [
        (4.7, 0x5371FC0F, 0x5241FC0F, 0x4751FC0F),
        (10.2, 0x5371FC2F, 0x5241FC2F, 0x4751FC2F),
        (23.5, 0x5371FC2F, 0x5261FC2F, 0x4771FC2F),
        (42.7, 0x5371FC2F, 0x5261FC2F, 0x5771FC2F),
    ],
)
def test_sensors_as_recorded(copter, until_s, present, enabled, health):
    vehicle = copter(ready_s=42.5).run(4.0)
    vehicle.mode(4)
    vehicle.run(until_s - 4.0)
    status = ask(vehicle, "SYS_STATUS")
    assert hex(status.onboard_control_sensors_present) == hex(present)
    assert hex(status.onboard_control_sensors_enabled) == hex(enabled)
    assert hex(status.onboard_control_sensors_health) == hex(health)
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (12600, 0, 100)


def test_sensors_in_flight_tell_what_is_controlled(hovering):
    assert hex(ask(hovering, "SYS_STATUS").onboard_control_sensors_enabled) == "0x5361fc2f"
    hovering.set("GUID_OPTIONS", 8)
    hovering.stream(lambda v: v.rates(thrust=0.364), 0.2)
    assert hex(ask(hovering, "SYS_STATUS").onboard_control_sensors_enabled) == "0x53619c2f"


def test_the_pose(hovering):
    attitude, place = ask(hovering, "ATTITUDE"), ask(hovering, "LOCAL_POSITION_NED")
    assert (attitude.roll, attitude.pitch, attitude.yaw) == pytest.approx((0, 0, 0), abs=0.01)
    assert (place.x, place.y, place.z) == pytest.approx((0, 0, -10), abs=0.05)
    globe = ask(hovering, "GLOBAL_POSITION_INT")
    assert (globe.lat, globe.lon) == pytest.approx((-353632620, 1491652370), abs=3)
    assert (globe.alt, globe.relative_alt) == pytest.approx((594090, 10000), abs=60)
    hud = ask(hovering, "VFR_HUD")
    assert (hud.throttle, hud.alt) == (36, pytest.approx(594.09, abs=0.06))
    gps = ask(hovering, "GPS_RAW_INT")
    assert (gps.fix_type, gps.eph, gps.epv, gps.satellites_visible, gps.h_acc) == (6, 121, 200, 10, 300)
    assert gps.time_usec % 200_000 == 173_000


def test_places_on_the_globe_point_the_right_way(copter, quiet):
    vehicle = copter(sensors=quiet).hover()
    vehicle.local(0xDF8, (10.0, -20.0, -10.0))
    place = ask(vehicle.run(25.0), "GLOBAL_POSITION_INT")
    assert place.lat - -353632620 == pytest.approx(898, abs=10)
    assert place.lon - 1491652370 == pytest.approx(-2203, abs=20)


def test_motors_and_targets_of_a_hover(hovering):
    """Recorded: servos 1591, thrust 0.363, 28.1 A."""
    servos = ask(hovering, "SERVO_OUTPUT_RAW")
    assert [servos.servo1_raw, servos.servo2_raw, servos.servo3_raw, servos.servo4_raw] == pytest.approx(
        [1591] * 4, abs=3
    )
    assert servos.servo5_raw == 0
    target = ask(hovering, "ATTITUDE_TARGET")
    assert target.thrust == pytest.approx(0.363, abs=0.004)
    assert target.q == pytest.approx([1, 0, 0, 0], abs=0.01)
    assert ask(hovering, "SYS_STATUS").current_battery == pytest.approx(2810, rel=0.02)
    position = ask(hovering, "POSITION_TARGET_LOCAL_NED")
    assert (position.x, position.y, position.z) == pytest.approx((0, 0, -10), abs=0.05)
    assert ask(hovering, "EXTENDED_SYS_STATE").landed_state == 2


def test_what_is_measured(ground):
    raw = ask(ground, "RAW_IMU")
    assert (raw.xacc, raw.yacc, raw.zacc) == pytest.approx((0, 0, -1000), abs=1)
    assert (raw.xmag, raw.ymag, raw.zmag) == (232, 53, -529)
    highres = ask(ground, "HIGHRES_IMU")
    assert highres.zacc == pytest.approx(-9.81, abs=0.01)
    assert highres.abs_pressure == pytest.approx(945.03, abs=0.01)
    assert (highres.xmag, highres.fields_updated) == (pytest.approx(232173.2, abs=0.1), 8191)
    sticks = ask(ground, "RC_CHANNELS")
    assert [sticks.chan1_raw, sticks.chan3_raw, sticks.chan5_raw] == [1500, 1000, 1800]
    assert ask(ground, "BATTERY_STATUS").voltages[:2] == [12600, 65535]


def test_pressure_falls_and_the_field_turns(copter, quiet):
    vehicle = copter(sensors=quiet).hover()
    assert 945.03 - ask(vehicle, "SCALED_PRESSURE").press_abs == pytest.approx(1.14, abs=0.05)
    vehicle.local(0x9F8, (0.0, 0.0, -10.0), yaw=math.pi / 2)
    vehicle.run(6.0)
    turned = ask(vehicle, "SCALED_IMU2")
    assert (turned.xmag, turned.ymag) == pytest.approx((53, -232), abs=4)


def test_landed_states(copter):
    vehicle = copter().arm()
    states = [ask(vehicle, "EXTENDED_SYS_STATE").landed_state]
    vehicle.command(22, 0, 0, 0, 0, 0, 0, 5)
    for seconds in (5.0, 8.0):
        vehicle.run(seconds)
        states.append(ask(vehicle, "EXTENDED_SYS_STATE").landed_state)
    vehicle.mode(9)
    states.append(ask(vehicle.run(2.0), "EXTENDED_SYS_STATE").landed_state)
    assert states == [1, 3, 2, 4]
    assert ask(vehicle.run(20.0), "EXTENDED_SYS_STATE").landed_state == 1


def test_outputs_over_the_spooling(copter):
    vehicle = copter().arm()
    vehicle.command(511, mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 20_000)
    vehicle.run(4.0)
    outputs = [m.servo1_raw for m in vehicle.messages("SERVO_OUTPUT_RAW")]
    assert (min(outputs), max(outputs)) == (1000, 1100)
    assert outputs == sorted(outputs)


def test_every_message_that_it_makes_can_be_packed_from_boot_to_landing(copter):
    vehicle = copter()
    for _ in range(4):
        vehicle.run(0.4)
        for message_id in BUILDERS:
            assert vehicle.command(512, message_id) == [0]
