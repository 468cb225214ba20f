"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT in GUIDED, and the commands that steer GUIDED."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavquad.protocol.codec import mavlink

NAN = math.nan
POSITION, VELOCITY, ACCELERATION, POSITION_VELOCITY, POSITION_YAW, VELOCITY_YAW_RATE = (
    0xDF8,
    0xDC7,
    0xC3F,
    0xDC0,
    0x9F8,
    0x5C7,
)
HOME = (-353632620, 1491652370)


def test_one_position_is_enough_and_kept(copter):
    vehicle = copter().hover()
    vehicle.local(POSITION, (5.0, -3.0, -8.0))
    vehicle.run(12.0)
    assert vehicle.truth.position_ned_m == pytest.approx((5.0, -3.0, -8.0), abs=0.4)


def test_a_velocity_is_held_then_braked(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, 1.0, -0.5)), 3.0)
    assert vehicle.truth.velocity_ned_m_s == pytest.approx((2.0, 1.0, -0.5), abs=0.25)
    assert vehicle.run(2.8).truth.velocity_ned_m_s[0] > 1.7
    assert math.hypot(*vehicle.run(3.0).truth.velocity_ned_m_s) < 0.25


def test_a_stop_comes_sooner_with_a_shorter_timeout(copter):
    vehicle = copter().hover()
    vehicle.set("GUID_TIMEOUT", 0.5)
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, 0.0, 0.0)), 3.0)
    assert abs(vehicle.run(2.5).truth.velocity_ned_m_s[0]) < 0.3


def test_an_acceleration_is_flown(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(ACCELERATION, acceleration=(0.5, 0.0, 0.0)), 3.0)
    assert vehicle.truth.velocity_ned_m_s[0] == pytest.approx(1.5, abs=0.3)


def test_an_acceleration_ends_with_the_timeout(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(ACCELERATION, acceleration=(0.5, 0.0, 0.0)), 2.0)
    assert vehicle.run(2.9).truth.velocity_ned_m_s[0] > 2.0
    assert abs(vehicle.run(4.0).truth.velocity_ned_m_s[0]) < 0.25


def test_position_with_velocity(copter):
    vehicle = copter().hover()
    start_us = vehicle.now_us

    def circle(v):
        angle = (v.now_us - start_us) / 2e6
        place = (2 * math.cos(angle) - 2, 2 * math.sin(angle), -10.0)
        v.local(POSITION_VELOCITY, place, (-math.sin(angle), math.cos(angle), 0.0))

    vehicle.stream(circle, 10.0)
    angle = (vehicle.now_us - start_us) / 2e6
    assert math.dist(vehicle.truth.position_ned_m, (2 * math.cos(angle) - 2, 2 * math.sin(angle), -10.0)) < 0.8


@pytest.mark.parametrize(
    ("frame", "place"),
    [(1, (2.0, 1.0, -9.0)), (7, (3.0, 3.0, -14.0)), (8, (-1.0, 3.0, -14.0)), (9, (-1.0, 3.0, -14.0))],
)
def test_frames(copter, frame, place):
    """At (1, 2, -10), heading east; 7: offset along NED; 8 and 9: ahead, right, down of the vehicle."""
    vehicle = copter().hover()
    vehicle.local(POSITION_YAW, (1.0, 2.0, -10.0), yaw=math.pi / 2)
    vehicle.run(12.0)
    given = (2.0, 1.0, -9.0) if frame == 1 else (2.0, 1.0, -4.0) if frame == 7 else (1.0, 2.0, -4.0)
    vehicle.local(POSITION_YAW, given, frame=frame, yaw=0.0)
    vehicle.run(12.0)
    assert vehicle.truth.position_ned_m == pytest.approx(place, abs=0.4)


def test_a_velocity_in_the_body_frame(copter):
    vehicle = copter().hover()
    vehicle.local(POSITION_YAW, (0.0, 0.0, -10.0), yaw=math.pi / 2)
    vehicle.run(5.0)
    vehicle.stream(lambda v: v.local(VELOCITY_YAW_RATE, velocity=(2.0, 0.0, 0.0), frame=8), 3.0)
    assert vehicle.truth.velocity_ned_m_s == pytest.approx((0.0, 2.0, 0.0), abs=0.3)


def test_yaw_and_yaw_rate(copter):
    vehicle = copter().hover()
    vehicle.local(POSITION_YAW, (0.0, 0.0, -10.0), yaw=-1.0)
    vehicle.run(6.0)
    assert vehicle.truth.euler_rad[2] == pytest.approx(-1.0, abs=0.05)
    vehicle.stream(lambda v: v.local(VELOCITY_YAW_RATE, yaw_rate=0.4), 3.0)
    assert vehicle.truth.euler_rad[2] == pytest.approx(0.2, abs=0.15)


def test_the_nose_turns_to_where_it_flies(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(0.0, 2.0, 0.0)), 5.0)
    assert vehicle.truth.euler_rad[2] == pytest.approx(math.pi / 2, abs=0.1)
    kept = copter().hover()
    kept.set("WP_YAW_BEHAVIOR", 0)
    kept.stream(lambda v: v.local(VELOCITY, velocity=(0.0, 2.0, 0.0)), 5.0)
    assert kept.truth.euler_rad[2] == pytest.approx(0.0, abs=0.1)


def test_a_speed_that_it_cannot_reach(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(12.0, 0.0, 0.0)), 6.0)
    assert 9.0 < vehicle.truth.velocity_ned_m_s[0] < 12.0
    assert abs(math.degrees(vehicle.truth.euler_rad[1])) < 32


@pytest.mark.parametrize("mask", [0xFFF, 0xC38, 0xE3F])
def test_masks_that_stop(copter, mask):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, 0.0, 0.0)), 3.0)
    vehicle.stream(lambda v: v.local(mask, (9.0, 9.0, -20.0), (5.0, 5.0, 0.0), (1.0, 1.0, 1.0)), 3.0)
    assert math.hypot(*vehicle.truth.velocity_ned_m_s) < 0.3
    assert vehicle.texts() == []


def test_an_unknown_frame_stops(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, 0.0, 0.0)), 3.0)
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, 0.0, 0.0), frame=10), 3.0)
    assert math.hypot(*vehicle.truth.velocity_ned_m_s) < 0.3


def test_nan(copter):
    vehicle = copter().hover()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(2.0, NAN, 0.0)), 1.0)
    assert math.hypot(*vehicle.truth.velocity_ned_m_s) < 0.2
    vehicle.local(POSITION, (NAN, 0.0, -5.0))
    assert vehicle.run(1.0).truth.position_ned_m == pytest.approx((0.0, 0.0, -10.0), abs=0.3)
    vehicle.local(VELOCITY, (NAN, NAN, NAN), (1.0, 0.0, 0.0))
    assert vehicle.run(2.0).truth.velocity_ned_m_s[0] > 0.7
    vehicle.local(POSITION, (0.0, 0.0, NAN))
    assert "Internal Errors 0x400" in vehicle.texts()
    vehicle.local(POSITION, (9.0, 0.0, -10.0))
    assert vehicle.run(8.0).truth.position_ned_m[0] < 4.0


def test_it_does_not_lift_a_vehicle_off_the_ground(copter):
    vehicle = copter().arm()
    vehicle.stream(lambda v: v.local(VELOCITY, velocity=(0.0, 0.0, -2.0)), 5.0)
    assert vehicle.truth.landed


def test_a_place_on_the_globe(copter):
    vehicle = copter().hover()
    for frame, height in ((6, 12.0), (5, 596.0)):
        vehicle.send(
            mavlink.MAVLink_set_position_target_global_int_message(
                0, 1, 1, frame, POSITION, HOME[0] + 450, HOME[1] + 550, height, *[0.0] * 8
            )
        )
        vehicle.run(10.0)
        assert vehicle.truth.position_ned_m == pytest.approx((5.0, 5.0, -12.0), abs=0.5)


def test_commands_that_steer_guided(copter):
    vehicle = copter().hover()
    assert vehicle.command(115, 90, 0, 0, 0) == [0]
    assert vehicle.run(6.0).truth.euler_rad[2] == pytest.approx(math.pi / 2, abs=0.05)
    assert vehicle.command(115, 30, 0, -1, 1) == [0]
    assert vehicle.run(5.0).truth.euler_rad[2] == pytest.approx(math.pi / 3, abs=0.05)
    assert vehicle.command(115, 500) == [4]
    assert vehicle.command(178, 1, 1.0) == [0]
    message = mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 0, 0, 0, *HOME, 12.0)
    vehicle.local(POSITION, (8.0, 0.0, -10.0))
    vehicle.run(4.0)
    assert vehicle.truth.velocity_ned_m_s[0] == pytest.approx(1.0, abs=0.15)
    assert [a.result for a in vehicle.send(message) if a.get_type() == "COMMAND_ACK"] == [0]
    assert vehicle.run(20.0).truth.position_ned_m == pytest.approx((0.0, 0.0, -12.0), abs=0.5)


def test_home_can_be_moved(copter):
    vehicle = copter().hover()
    vehicle.local(POSITION, (6.0, 0.0, -10.0))
    vehicle.run(10.0)
    assert vehicle.command(179, 1) == [0]
    home = vehicle.messages("HOME_POSITION")[-1]
    assert home.x == pytest.approx(6.0, abs=0.4)
    assert vehicle.command(179, 0, 0, 0, 0, NAN, 0, 0) == [2]


ANY = st.floats(width=32)
THREE = st.tuples(ANY, ANY, ANY)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 65535), st.integers(0, 255), THREE, THREE, THREE, ANY, ANY, st.booleans())
def test_nothing_that_comes_in_it_breaks_the_mock(copter, mask, frame, place, velocity, acceleration, yaw, rate, local):
    vehicle = copter().hover()
    kind = mavlink.MAVLink_set_position_target_local_ned_message
    if not local:
        kind = mavlink.MAVLink_set_position_target_global_int_message
        place = (
            *(max(-(2**31), min(2**31 - 1, int(part))) if math.isfinite(part) else 0 for part in place[:2]),
            place[2],
        )
    vehicle.send(kind(0, 1, 1, frame, mask, *place, *velocity, *acceleration, yaw, rate))
    vehicle.run(0.2)
    assert all(map(math.isfinite, (*vehicle.truth.position_ned_m, *vehicle.truth.quaternion)))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([17, 20, 21, 22, 115, 176, 178, 179, 185, 192, 207, 246, 300, 400, 410, 510, 511, 512, 520]),
    st.tuples(*[ANY] * 7),
)
def test_no_command_breaks_the_mock(copter, command, params):
    vehicle = copter().hover()
    vehicle.command(command, *params)
    vehicle.run(0.1)
    assert all(map(math.isfinite, vehicle.truth.position_ned_m))


NAMES = [
    "GUID_TIMEOUT", "GUID_OPTIONS", "WPNAV_SPEED", "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "WPNAV_ACCEL", "WPNAV_ACCEL_Z",
    "ATC_ACCEL_R_MAX", "ATC_ACCEL_Y_MAX", "ATC_INPUT_TC", "ATC_SLEW_YAW", "RTL_ALT", "RTL_LOIT_TIME", "LAND_SPEED",
    "LAND_ALT_LOW", "DISARM_DELAY", "FS_GCS_TIMEOUT", "BATT_CAPACITY", "BATT_LOW_VOLT", "FENCE_RADIUS", "FENCE_ACTION",
    "PILOT_SPEED_UP", "PILOT_ACCEL_Z", "WPNAV_RADIUS", "FS_GCS_ENABLE", "FENCE_TYPE", "FENCE_ENABLE",
]  # fmt: skip


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.sampled_from(NAMES), ANY), min_size=1, max_size=4), st.sampled_from([4, 5, 6, 9, 17]))
def test_no_parameter_breaks_the_mock(copter, values, mode):
    vehicle = copter().hover()
    for name, value in values:
        vehicle.set(name, value)
    vehicle.mode(mode)
    vehicle.local(VELOCITY, velocity=(3.0, 1.0, -1.0))
    vehicle.run(0.5)
    vehicle.rates(roll=0.5, thrust=0.6)
    vehicle.run(0.3)
    assert all(map(math.isfinite, (*vehicle.truth.position_ned_m, *vehicle.truth.quaternion)))
