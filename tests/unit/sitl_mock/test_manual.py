"""Flying by MANUAL_CONTROL: what the sticks mean in each mode, taking over, and a pilot who is gone."""

import math

import pytest

from mavquad.protocol.codec import mavlink


def sticks(p, pitch=0, roll=0, throttle=500, yaw=0, target=1):
    return p.send(mavlink.MAVLink_manual_control_message(target, pitch, roll, throttle, yaw, 0))


def hold(p, seconds, **moved):
    for k in range(round(seconds * 10)):
        sticks(p, **moved)
        if k % 10 == 0:
            p.heartbeat()
        p.run(0.099)
    return p


@pytest.fixture
def flying(pilot, quiet):
    def make(main, firmware="1.16", **config):
        p = pilot(sensors=quiet, firmware=firmware, **config).hover()
        sticks(p)
        assert p.command(176, 1, main)[-1] == 0
        return hold(p, 1.0)

    return make


@pytest.mark.parametrize("firmware", ["1.13", "1.14", "1.15", "1.16", "1.17"])
def test_released_sticks_hold_the_place_in_posctl(flying, firmware):
    p = flying(3, firmware)
    at = p.truth.position_ned_m
    hold(p, 5.0)
    assert p.mock.mode == "POSCTL"
    assert p.truth.position_ned_m == pytest.approx(at, abs=0.1)


@pytest.mark.parametrize(
    ("moved", "axis", "sign"), [({"pitch": 400}, 0, 1), ({"roll": 400}, 1, 1), ({"roll": -400}, 1, -1)]
)
def test_sticks_are_speeds_in_posctl(flying, moved, axis, sign):
    p = hold(flying(3), 14.0, **moved)  # drag takes PX4's integrators some seconds
    velocity = p.truth.velocity_ned_m_s
    assert sign * velocity[axis] == pytest.approx(10.0 * 0.3 / 0.9, rel=0.1)
    assert abs(velocity[1 - axis]) < 0.1
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.4)
    hold(p, 8.0)
    assert math.hypot(*p.truth.velocity_ned_m_s) < 0.4


def test_sticks_follow_the_nose(flying):
    p = hold(flying(3, vehicle={"heading_deg": 90.0}), 14.0, pitch=400)
    assert p.truth.velocity_ned_m_s[1] == pytest.approx(3.3, rel=0.1)


@pytest.mark.parametrize("main", [2, 3])
def test_throttle_climbs_and_sinks(flying, main):
    p = hold(flying(main), 3.0, throttle=1000)
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(-3.0, abs=0.3)
    hold(p, 3.0)
    at = p.truth.position_ned_m[2]
    hold(p, 3.0)
    assert p.truth.position_ned_m[2] == pytest.approx(at, abs=0.1)


def test_yaw_turns_right(flying):
    p = hold(flying(3), 2.0, yaw=500)
    assert p.truth.rates_frd_rad_s[2] > 0.5


def test_altctl_and_stabilized_lean(flying):
    for main in (2, 7, 1):
        p = hold(flying(main), 0.8, roll=500)
        assert math.degrees(p.truth.euler_rad[0]) == pytest.approx(17.5, abs=3.0)
        assert p.truth.velocity_ned_m_s[1] > 0.5
        p = hold(flying(main), 0.8, pitch=500)
        assert math.degrees(p.truth.euler_rad[1]) == pytest.approx(-17.5, abs=3.0)


def test_acro_is_body_rates(flying):
    p = hold(flying(5), 0.3, roll=200)
    assert math.degrees(p.truth.rates_frd_rad_s[0]) == pytest.approx(20.0, abs=6.0)


def test_a_takeoff_by_hand_and_a_landing(pilot, quiet):
    p = pilot(sensors=quiet, firmware="1.16").run(1.1)
    sticks(p)
    p.command(176, 1, 3)
    assert p.command(400, 1) == [0]
    hold(p, 2.0)
    assert p.truth.landed
    hold(p, 3.0, throttle=900)
    assert p.truth.position_ned_m[2] < -2.0
    hold(p, 20.0, throttle=0)
    assert not p.mock.armed
    assert not p.truth.crashed


def test_moved_sticks_take_over_from_the_autopilot(pilot, quiet):
    p = pilot(sensors=quiet, firmware="1.16").hover()
    hold(p, 1.0)
    assert p.mock.mode == "AUTO.LOITER"
    hold(p, 0.2, roll=600)
    assert p.mock.mode == "POSCTL"
    assert "Pilot took over using sticks" in p.texts()
    p.position()
    p.offboard()
    sticks(p, roll=600)
    p.run(0.01)
    assert p.mock.mode == "OFFBOARD"  # COM_RC_OVERRIDE counts for AUTO modes alone


@pytest.mark.parametrize(("firmware", "waits_s"), [("1.13", 15.0), ("1.16", 5.0)])
def test_a_pilot_who_is_gone(flying, firmware, waits_s):
    p = flying(3, firmware)
    p.fly(1.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert "Manual control lost" in p.texts()
    p.fly(waits_s)
    assert p.mock.mode == "AUTO.RTL"


def test_sticks_for_another_vehicle_and_rc_channels_override_are_nothing(pilot):
    p = pilot(firmware="1.16").hover()
    sticks(p, target=2)
    p.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8))
    assert p.command(176, 1, 3)[-1] == 1
