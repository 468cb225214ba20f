"""Commands that fly or that set something up; results as seen on PX4 1.13.3, or as FIRMWARE and its source have them."""

import itertools
import math

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.sites import ORIGINS

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
NAN = math.nan


def reposition(p, n, e, height_m, yaw=NAN, speed=-1.0, flags=1.0):
    latitude, longitude, altitude_m = ORIGINS[p.config.px4_release].geographic((n, e, -height_m))
    message = mavlink.MAVLink_command_int_message(
        1, 1, 0, 192, 0, 0, speed, flags, 0.0, yaw, round(latitude * 1e7), round(longitude * 1e7), altitude_m
    )
    return [a.result for a in p.send(message) if a.get_type() == "COMMAND_ACK"]


@pytest.mark.parametrize("firmware", ["1.13", "1.14", "1.15", "1.16", "1.17"])
def test_reposition_flies_there_in_loiter(pilot, quiet, firmware):
    p = pilot(sensors=quiet, firmware=firmware).hover()
    p.command(176, 1, 4, 6)
    assert reposition(p, 6.0, -8.0, 4.0, yaw=1.0) == [ACCEPTED]
    assert p.mock.mode == "AUTO.LOITER"
    p.fly(12.0)
    assert p.truth.position_ned_m == pytest.approx((6.0, -8.0, -4.0), abs=0.2)
    assert p.truth.euler_rad[2] == pytest.approx(1.0, abs=0.05)


def test_reposition_with_nan_stays_where_it_is_and_may_be_slow(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    assert p.command(192, -1, 1, 0, NAN, NAN, NAN, NAN) == [ACCEPTED]
    p.fly(3.0)
    assert p.truth.position_ned_m == pytest.approx((0.0, 0.0, -2.5), abs=0.2)
    reposition(p, 10.0, 0.0, 2.5, speed=1.0)
    p.fly(5.0)
    assert p.truth.velocity_ned_m_s[0] == pytest.approx(1.0, abs=0.15)


def test_reposition_without_its_flag_changes_nothing(pilot):
    p = pilot().hover()
    p.command(21)
    assert reposition(p, 5.0, 0.0, 5.0, flags=0.0) == [ACCEPTED]
    assert p.mock.mode == "AUTO.LAND"


def test_reposition_in_a_command_long(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    latitude, longitude, altitude_m = ORIGINS["1.13"].geographic((0.0, 0.0, -5.0))
    p.command(192, -1, 1, 0, NAN, latitude, longitude, altitude_m)
    p.fly(8.0)
    # a float of 32 bits places it within half a metre to north and south, and 0.3 m to east and west
    assert math.hypot(*p.truth.position_ned_m[:2]) < 0.8
    assert p.truth.position_ned_m[2] == pytest.approx(-5.0, abs=0.1)


def test_orbit_circles_and_is_acknowledged_twice(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    assert p.command(34, 4.0, 2.0, 0, 0, NAN, NAN, NAN) == [ACCEPTED, ACCEPTED]
    p.fly(5.0)
    beat = p.messages("HEARTBEAT")[-1]
    assert (beat.base_mode & 0x7F, beat.custom_mode) == (17, 0x01030000)
    angles = []
    for _ in range(40):
        p.heartbeat().run(0.1)
        n, e, _ = p.truth.position_ned_m
        assert math.hypot(n, e) == pytest.approx(4.0, abs=0.6)
        angles.append(math.atan2(e, n))
    turned = sum((b - a + math.pi) % math.tau - math.pi for a, b in itertools.pairwise(angles))
    assert turned == pytest.approx(3.9 * 2.0 / 4.0, rel=0.1)  # clockwise


def test_change_of_speed_and_home(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    assert p.command(178, 1, 1.5, -1) == [ACCEPTED]
    reposition(p, 20.0, 0.0, 2.5, speed=1.5)
    p.fly(5.0)
    assert p.truth.velocity_ned_m_s[0] == pytest.approx(1.5, abs=0.2)
    assert p.command(179, 0, 0, 0, 0, NAN, NAN, NAN) == [DENIED]
    assert p.command(179, 1) == [ACCEPTED]
    assert p.mock._personality.commander.home_ned_m == pytest.approx(p.truth.position_ned_m, abs=0.1)
    assert p.command(179, 0, 0, 0, 0, 45.4671182, -73.7578241, 32.5) == [ACCEPTED]
    assert p.mock._personality.commander.home_ned_m == pytest.approx((0.0, 0.0, 0.0), abs=0.5)


def test_takeoff_with_a_heading_and_by_its_mode(pilot, quiet):
    p = pilot(sensors=quiet).run(1.1).heartbeat()
    p.command(400, 1)
    p.command(22, 0, 0, 0, 90.0, NAN, NAN, NAN)
    p.fly(14.0)
    assert p.truth.euler_rad[2] == pytest.approx(math.pi / 2, abs=0.05)
    p = pilot(sensors=quiet).run(1.1).heartbeat()
    p.command(400, 1)
    assert p.command(176, 1, 4, 2) == [ACCEPTED]
    p.fly(14.0)
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.1)
    assert p.command(22, 0, 0, 0, NAN, NAN, NAN, 32.5 + 1.0) == [ACCEPTED]
    assert p.mock.mode == "AUTO.TAKEOFF"
    p.fly(3.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.1)


def test_takeoff_is_timed_as_recorded(pilot, quiet):
    # px4-v1.16.2-a: takeoff detected 1.75 s after the command, off the ground after 4.2 s, LOITER after 8.6 s
    p = pilot(sensors=quiet, firmware="1.16").run(1.1).heartbeat()
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 5.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.command(400, 1)
    p.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
    seen = {}
    for tick in range(2500):
        p.run(0.0048)
        if tick % 200 == 0:
            p.heartbeat()
        truth = p.truth
        for name, happens in (
            ("detected", not truth.landed),
            ("off the ground", truth.position_ned_m[2] < -0.02),
            ("loiter", truth.mode == "AUTO.LOITER"),
        ):
            if happens:
                seen.setdefault(name, truth.boot_us / 1e6 - 1.1)
    assert seen["detected"] == pytest.approx(1.9, abs=0.2)
    assert seen["off the ground"] == pytest.approx(4.3, abs=0.3)
    assert seen["loiter"] == pytest.approx(8.6, abs=0.5)


def test_return_to_launch_climbs_returns_and_lands_in_its_own_mode(pilot, quiet):
    p = pilot(sensors=quiet).hover()
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"RTL_RETURN_ALT", 8.0, mavlink.MAV_PARAM_TYPE_REAL32))
    reposition(p, 12.0, 0.0, 3.0)
    p.fly(8.0)
    p.forget()
    assert p.command(20) == [ACCEPTED]
    assert p.command(20) == [TEMPORARILY_REJECTED]
    highest = 0.0
    for _ in range(40):
        p.fly(1.0)
        highest = max(highest, -p.truth.position_ned_m[2])
        if p.mock.armed:
            assert p.mock.mode == "AUTO.RTL"
    assert highest == pytest.approx(8.0, abs=0.5)
    assert p.truth.position_ned_m == pytest.approx((0.0, 0.0, 0.0), abs=0.4)
    assert not p.mock.armed
    texts = p.texts()
    assert [text for text in texts if text.startswith("RTL")] == [
        "RTL HOME activated",
        "RTL: landing at home position.",
        "RTL: climb to 40 m (8 m above destination)",
        "RTL: return at 40 m (8 m above destination)",
        "RTL: land at destination",
    ]
    assert "Returning to launch" in texts
    assert "Return to launch denied" in texts


def test_116_lets_a_gimbal_go_when_it_lands(pilot):
    # px4-v1.16.2-a: COMMAND_LONG to (1, 0)
    p = pilot(firmware="1.16").hover()
    p.command(21)
    p.run(0.01)
    said = [(m.target_system, m.target_component, m.command) for m in p.messages("COMMAND_LONG")]
    assert said == [(1, 0, 1001), (1, 0, 1000), (1, 0, 1001)]


# --- no flying ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "params", "results"),
    [
        (401, (), [UNSUPPORTED]),
        (510, (30,), [ACCEPTED]),
        (519, (1,), [ACCEPTED]),
        (201, (), [ACCEPTED]),
        (195, (), [ACCEPTED]),
        (197, (), [ACCEPTED]),
        (193, (0,), [UNSUPPORTED]),
        (187, (0.1,), [ACCEPTED]),
        (209, (1, 0, 0, 0), [ACCEPTED]),
        (310, (0.0, 1, 0, 0, 1), [ACCEPTED]),
        (246, (0,), [ACCEPTED]),
        (246, (5,), [DENIED]),
        (245, (0,), [ACCEPTED]),
        (241, (1,), [ACCEPTED]),
        (500, (), []),
        (2510, (), []),
        (1000, (), []),
        (183, (1, 1500), [UNSUPPORTED]),
        (186, (10, 3), [UNSUPPORTED]),
        (252, (), [UNSUPPORTED]),
        (211, (1, 1), [UNSUPPORTED]),
        (16, (), [UNSUPPORTED]),
        (112, (1,), [UNSUPPORTED]),
        (300, (0, 0), [DENIED]),
        (185, (0,), [ACCEPTED]),
    ],
)
def test_results_of_113_on_the_ground(pilot, command, params, results):
    assert pilot().run(1.1).command(command, *params) == results


def test_calibration_is_announced_and_refused_while_armed(pilot):
    p = pilot().heartbeat().run(1.1)
    p.command(241, 0, 0, 0, 0, 1)
    assert p.texts() == ["[cal] calibration started: 2 accel", "[cal] progress <100>", "[cal] calibration done: accel"]
    p.command(400, 1)
    assert p.command(241, 1) == [TEMPORARILY_REJECTED]
    assert p.command(245, 1) == [TEMPORARILY_REJECTED]
    assert p.command(246, 1) == [DENIED]


def test_run_prearm_checks_of_later_releases(pilot):
    p = pilot(firmware="1.16").run(1.1)
    assert p.command(401) == [ACCEPTED]


def test_termination_stops_the_motors(pilot):
    p = pilot(firmware="1.16").hover()
    assert p.command(185, 0) == [DENIED]
    assert p.command(185, 1) == [ACCEPTED]
    p.fly(1.2)
    assert p.truth.motor_commands == (0.0, 0.0, 0.0, 0.0)
    assert p.truth.crashed
    p = pilot().run(1.1)
    assert p.command(185, 1) == [ACCEPTED]
    p.run(1.0)
    assert p.messages("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_FLIGHT_TERMINATION
    assert p.command(185, 0) == [ACCEPTED]


def test_hundreds_of_commands_a_second_are_answered_each_and_nothing_grows(pilot):
    p = pilot(firmware="1.16").hover()
    results = []
    for k in range(600):
        results += p.command(*((511, 30, 10000), (31000,), (176, 1, 4, 3), (512, 148), (400, 1), (21,), (20,))[k % 7])
        p.run(0.001)
        p.forget()
    assert len(results) == 600 + 600 // 7 + (600 % 7 > 2)  # a mode is acknowledged twice
    assert p.mock.armed
    assert len(p.mock._personality.commander.texts) <= 16
    assert p.mock._personality.commander.broadcasts == []


def test_arming_with_a_strange_parameter_is_told(pilot):
    p = pilot().heartbeat()
    assert p.command(400, 5) == []
    assert p.texts() == ["Unsupported ARM_DISARM param: 5.000"]
