"""Positions, velocities, accelerations and their mixes in OFFBOARD, local and global, on every release."""

import math

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.sites import ORIGINS

NAN = math.nan
POSITION, VELOCITY, ACCELERATION = 0xDF8, 0xDC7, 0xC3F
RELEASES = ["1.13", "1.14", "1.15", "1.16", "1.17"]


def target(n=0.0, e=0.0, d=-2.5, v=(0.0, 0.0, 0.0), a=(0.0, 0.0, 0.0), mask=POSITION, frame=1, yaw=0.0, yaw_rate=0.0):
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, n, e, d, *v, *a, yaw, yaw_rate)


def follow(p, message, seconds):
    p.send(message)
    assert p.offboard()[-1] == 0
    p.stream(lambda q: q.send(message), seconds, hz=10)
    assert p.mock.mode == "OFFBOARD"
    return p.truth


@pytest.fixture
def flying(pilot, quiet):
    return lambda firmware="1.16", **config: pilot(sensors=quiet, firmware=firmware, **config).hover()


@pytest.mark.parametrize("firmware", RELEASES)
def test_position(flying, firmware):
    truth = follow(flying(firmware), target(3.0, -2.0, -4.0), 12.0)
    assert truth.position_ned_m == pytest.approx((3.0, -2.0, -4.0), abs=0.15)


@pytest.mark.parametrize("firmware", RELEASES)
def test_velocity(flying, firmware):
    truth = follow(flying(firmware), target(v=(1.0, -2.0, -0.5), mask=VELOCITY), 16.0)
    assert truth.velocity_ned_m_s == pytest.approx((1.0, -2.0, -0.5), abs=0.12)


@pytest.mark.parametrize("firmware", RELEASES)
def test_acceleration_alone_is_not_braked(flying, firmware):
    # 1 m/s^2 against 1 N/(m/s) of drag on 1 kg: v = 1 - exp(-t)
    truth = follow(flying(firmware), target(a=(1.0, 0.0, 0.0), mask=ACCELERATION), 3.0)
    assert truth.velocity_ned_m_s[0] == pytest.approx(0.95, abs=0.15)
    assert abs(truth.velocity_ned_m_s[1]) < 0.1


def test_position_with_velocity_and_acceleration_leads(flying):
    """A circle of 2 m in 8 s: with the velocity and the acceleration given it stays closer than with the place alone."""

    def error_m(mask):
        p = flying()
        p.send(target(2.0, 0.0, -2.5))
        p.offboard()
        p.stream(lambda q: q.send(target(2.0, 0.0, -2.5)), 6.0, hz=10)
        worst = 0.0
        w = math.tau / 8.0
        for k in range(400):
            t = k * 0.02
            c, s = math.cos(w * t), math.sin(w * t)
            place = (2 * c, 2 * s, -2.5)
            p.send(target(*place, (-2 * w * s, 2 * w * c, 0.0), (-2 * w * w * c, -2 * w * w * s, 0.0), mask))
            p.run(0.02 - 0.0004)
            if t > 4.0:
                worst = max(worst, math.dist(p.truth.position_ned_m, place))
        return worst

    alone, led = error_m(POSITION), error_m(0xC00)
    assert led < 0.9 < 1.2 < alone


def test_velocity_horizontally_and_a_height(flying):
    truth = follow(flying(), target(NAN, NAN, -4.0, (1.0, 0.0, 0.0), mask=0xDC0), 16.0)
    assert truth.velocity_ned_m_s[0] == pytest.approx(1.0, abs=0.1)
    assert truth.position_ned_m[2] == pytest.approx(-4.0, abs=0.15)


def test_nan_horizontally_is_kept_at_rest(flying):
    truth = follow(flying(), target(NAN, NAN, -4.0), 6.0)
    assert math.hypot(*truth.velocity_ned_m_s[:2]) < 0.1
    assert truth.position_ned_m[2] == pytest.approx(-4.0, abs=0.15)


def test_a_yaw_rate_turns_it_and_a_yaw_is_turned_to(flying):
    truth = follow(flying(), target(v=(0.0, 0.0, 0.0), mask=0x5C7, yaw_rate=0.4), 4.0)
    assert truth.rates_frd_rad_s[2] == pytest.approx(0.4, abs=0.08)
    truth = follow(flying(), target(0.0, 0.0, -2.5, mask=0x9F8, yaw=-1.2), 8.0)
    assert truth.euler_rad[2] == pytest.approx(-1.2, abs=0.05)


def test_limits_are_parameters(flying):
    p = flying()
    for name, value in ((b"MPC_XY_VEL_MAX", 2.0), (b"MPC_Z_VEL_MAX_UP", 1.0)):
        p.send(mavlink.MAVLink_param_set_message(1, 1, name, value, mavlink.MAV_PARAM_TYPE_REAL32))
    truth = follow(p, target(100.0, 0.0, -50.0), 14.0)
    assert truth.velocity_ned_m_s == pytest.approx((2.0, 0.0, -1.0), abs=0.15)


def test_tilt_limit_is_a_parameter(flying):
    p = flying()
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"MPC_TILTMAX_AIR", 10.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.send(target(100.0, 0.0, -2.5))
    p.offboard()
    leans = []
    for _ in range(30):
        p.stream(lambda q: q.send(target(100.0, 0.0, -2.5)), 0.1, hz=10)
        leans.append(-math.degrees(p.truth.euler_rad[1]))
    assert max(leans) < 13.0
    assert leans[-1] == pytest.approx(10.0, abs=1.5)


@pytest.mark.parametrize(("frame", "altitude_m"), [(5, "amsl"), (0, "amsl"), (6, "relative"), (3, "relative")])
def test_global_positions(flying, frame, altitude_m):
    p = flying()
    latitude, longitude, amsl_m = ORIGINS["1.16"].geographic((5.0, -3.0, -6.0))
    message = mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, POSITION, round(latitude * 1e7), round(longitude * 1e7),
        amsl_m if altitude_m == "amsl" else 6.0, *[0.0] * 8,
    )  # fmt: skip
    truth = follow(p, message, 14.0)
    assert truth.position_ned_m == pytest.approx((5.0, -3.0, -6.0), abs=0.2)


def test_a_global_position_in_a_strange_frame_is_told(flying):
    p = flying().heartbeat()
    p.send(mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 12, POSITION, 0, 0, 0.0, *[0.0] * 8))
    assert p.texts() == ["SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 12"]
    assert p.offboard()[-1] == 1
