"""OFFBOARD: entry, every kind of setpoint, and what happens when the stream stops."""

import math

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.inner_loops import RatesSetpoint
from sitl_mock.personality.px4.offboard import OffboardInput

ACCEPTED, TEMPORARILY_REJECTED = 0, 1
NAN = math.nan


def enter(p):
    p.torque()
    assert p.offboard()[-1] == ACCEPTED
    assert p.mock.mode == "OFFBOARD"
    return p


# --- entry ---------------------------------------------------------------------------------------------------------


def test_without_a_stream_113_refuses(pilot):
    p = pilot().hover()
    assert p.offboard() == [TEMPORARILY_REJECTED]
    assert p.mock.mode == "AUTO.LOITER"


def test_without_a_stream_116_acknowledges_and_refuses(pilot):
    p = pilot(firmware="1.16").hover().heartbeat()
    assert p.offboard() == [ACCEPTED, TEMPORARILY_REJECTED]
    assert p.mock.mode == "AUTO.LOITER"
    assert "Switching to Offboard is currently not available" in p.texts()


def test_without_a_stream_115_refuses_once_and_says_why(pilot):
    p = pilot(firmware="1.15").hover().heartbeat()
    assert p.offboard() == [TEMPORARILY_REJECTED]
    assert p.mock.mode == "AUTO.LOITER"
    assert "Switching to Offboard is currently not available" in p.texts()
    p.rates()
    assert p.offboard() == [ACCEPTED]


def test_on_the_ground_116_accepts_and_refuses_to_arm(pilot):
    p = pilot(firmware="1.16").run(1.1)
    assert p.offboard() == [ACCEPTED, ACCEPTED]
    assert p.mock.mode == "OFFBOARD"
    assert p.command(400, 1) == [TEMPORARILY_REJECTED]
    p.rates(thrust=0.0)
    assert p.command(400, 1) == [ACCEPTED]
    assert pilot().run(1.1).offboard() == [TEMPORARILY_REJECTED]


@pytest.mark.parametrize("setpoint", ["torque", "rates", "position"])
def test_one_setpoint_is_enough(pilot, setpoint):
    p = pilot().hover()
    getattr(p, setpoint)()
    assert p.offboard() == [ACCEPTED]


def test_an_old_setpoint_is_not(pilot):
    p = pilot().hover()
    p.torque()
    p.run(1.1)
    assert p.offboard() == [TEMPORARILY_REJECTED]


@pytest.mark.parametrize("target", [(1, 1), (0, 0), (1, 0)])
def test_torque_for_us(pilot, target):
    p = pilot().hover()
    p.torque(target=target)
    assert p.offboard() == [ACCEPTED]


@pytest.mark.parametrize(("target", "group"), [((2, 1), 0), ((1, 7), 0)])
def test_torque_for_others_does_not_count(pilot, target, group):
    p = pilot().hover()
    p.torque(target=target, group=group)
    assert p.offboard() == [TEMPORARILY_REJECTED]


@pytest.mark.parametrize("firmware", ["1.15", "1.16"])
def test_later_releases_ignore_torque(pilot, firmware):
    p = pilot(firmware=firmware).hover()
    p.torque()
    assert p.offboard()[-1] == TEMPORARILY_REJECTED


@pytest.mark.parametrize("mask", [0xC7, 0x82, 0x81])
def test_attitude_targets_that_ask_for_nothing_do_not_count(pilot, mask):
    p = pilot().hover()
    p.rates(mask=mask)
    assert p.offboard() == [TEMPORARILY_REJECTED]


def test_heartbeat_shows_offboard(pilot):
    p = enter(pilot().hover())
    p.stream(lambda q: q.torque(), 1.1)
    beat = p.messages("HEARTBEAT")[-1]
    assert beat.custom_mode == 0x00060000
    assert beat.base_mode == 129


# --- torques -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("axis", "scale"), [("roll", 113.0), ("pitch", 113.0), ("yaw", 13.3)])
def test_torque_turns_its_own_axis(pilot, quiet, axis, scale):
    # measured on real PX4 SIH: 113 rad/s^2 per unit of roll and pitch, 13.3 of yaw; motor lag 50 ms
    p = enter(pilot(sensors=quiet).hover())
    index = ("roll", "pitch", "yaw").index(axis)
    p.torque(**{axis: 0.02})
    p.run(0.2)
    lag_s = 0.05 * (1 - math.exp(-4))
    expected = 0.02 * scale * (0.2 - lag_s)
    rates = p.truth.rates_frd_rad_s
    assert rates[index] == pytest.approx(expected, rel=0.15)
    assert all(abs(rates[i]) < 0.05 * abs(expected) for i in range(3) if i != index)


def test_torque_goes_to_the_motors_as_recorded(pilot):
    # px4-v1.13.3-d-actuator139: roll 0.1 at thrust 0.3 gave SERVO_OUTPUT_RAW [1229, 1370, 1370, 1229]
    p = pilot().run(1.1)
    p.torque(thrust=0.0)
    p.offboard()
    p.command(400, 1)
    p.stream(lambda q: q.torque(roll=0.1, thrust=0.3), 0.5)
    out = p.messages("SERVO_OUTPUT_RAW")[-1]
    servos = [out.servo1_raw, out.servo2_raw, out.servo3_raw, out.servo4_raw]
    assert servos == pytest.approx([1229, 1370, 1370, 1229], abs=1)


@pytest.mark.parametrize(("firmware", "armed_5_to_8"), [("1.13", [1500, 1500, 900, 900]), ("1.16", [900] * 4)])
def test_servos_as_recorded(pilot, firmware, armed_5_to_8):
    # px4-v1.13.3-d-actuator139 and px4-v1.16.2-a: disarmed, armed on the ground, in flight
    def last(p):
        m = p.messages("SERVO_OUTPUT_RAW")[-1]
        return [getattr(m, f"servo{i}_raw") for i in range(1, 9)]

    p = pilot(firmware=firmware).run(1.1)
    assert last(p) == [900] * 8
    p.command(400, 1)
    p.run(0.5)
    assert last(p) == [1000] * 4 + armed_5_to_8
    p = pilot(firmware=firmware).hover().run(0.5)
    assert last(p)[4:] == armed_5_to_8
    p.command(400, 0, 21196)
    p.run(0.2)
    assert last(p) == [900] * 8


def test_attitude_target_pauses_while_torques_fly(pilot):
    def count(p):
        return len(p.messages("ATTITUDE_TARGET"))

    p = enter(pilot().hover())
    p.forget()
    p.stream(lambda q: q.torque(), 1.0)
    assert count(p) == 0
    assert p.command(512, 83) == [2]
    p.stream(lambda q: q.rates(), 1.0)
    assert count(p) == pytest.approx(10, abs=1)
    p.torque()
    p.forget()
    p.command(176, 1, 4, 3)
    p.run(1.0)
    assert count(p) == pytest.approx(10, abs=1)


def test_attitude_target_pauses_on_the_ground_too_until_the_stream_is_lost(pilot):
    p = enter(pilot().run(1.1))
    p.forget()
    p.run(0.9)
    assert not p.messages("ATTITUDE_TARGET")
    p.run(1.1)
    assert len(p.messages("ATTITUDE_TARGET")) == pytest.approx(10, abs=1)


def test_nan_torque_is_none(pilot, quiet):
    p = enter(pilot(sensors=quiet).hover())
    p.stream(lambda q: q.torque(roll=NAN), 0.3)
    assert p.truth.rates_frd_rad_s == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)


# --- rates, attitude, position ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_rates_are_followed(pilot, axis):
    p = enter(pilot().hover())
    p.stream(lambda q: q.rates(**{axis: 0.5}), 0.4)
    assert p.truth.rates_frd_rad_s[("roll", "pitch").index(axis)] == pytest.approx(0.5, abs=0.1)


def test_attitude_is_followed(pilot):
    p = enter(pilot().hover())
    half = math.radians(10.0) / 2
    p.stream(lambda q: q.rates(mask=0x07, q=(math.cos(half), math.sin(half), 0.0, 0.0), thrust=0.5), 1.0)
    assert math.degrees(p.truth.euler_rad[0]) == pytest.approx(10.0, abs=1.0)
    assert p.truth.velocity_ned_m_s[1] > 0.5


def test_thrust_ignored_or_nan_falls(pilot):
    for setpoint in (lambda q: q.rates(mask=0xC0), lambda q: q.rates(thrust=NAN)):
        p = enter(pilot().hover())
        p.stream(setpoint, 0.4)
        assert p.truth.velocity_ned_m_s[2] > 1.5


def test_position_is_followed(pilot):
    p = pilot().hover()
    p.position()
    p.offboard()
    p.stream(lambda q: q.position(1.0, -2.0, -4.0, mask=0x9F8, yaw=0.5), 12.0, hz=10)
    assert p.truth.position_ned_m == pytest.approx((1.0, -2.0, -4.0), abs=0.25)
    assert p.truth.euler_rad[2] == pytest.approx(0.5, abs=0.02)


def test_body_velocity_is_turned_by_the_heading(pilot):
    p = pilot(vehicle={"heading_deg": 90.0}).hover()
    setpoint = lambda q: q.position(velocity=(1.0, 0.0, 0.0), mask=0x5C7, frame=8)  # noqa: E731
    setpoint(p)
    p.offboard()
    p.stream(setpoint, 10.0, hz=10)
    assert p.truth.velocity_ned_m_s[1] == pytest.approx(1.0, abs=0.1)


def test_bad_position_targets_are_reported(pilot):
    p = pilot().heartbeat()
    p.position(frame=7)
    p.position(NAN, NAN, NAN)
    unsupported, invalid = p.texts()  # more than 50 characters go out in chunks
    assert unsupported == "SET_POSITION_TARGET_LOCAL_NED coordinate frame 7 unsupported"
    assert [(m.id, m.chunk_seq) for m in p.messages("STATUSTEXT")] == [(0, 0), (0, 1), (1, 0)]
    assert invalid == "SET_POSITION_TARGET_LOCAL_NED invalid"
    assert p.offboard() == [TEMPORARILY_REJECTED]


def test_nan_rates_are_not_corrected():
    offboard = OffboardInput("1.13")
    message = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0x84, [1, 0, 0, 0], NAN, 0.2, 0.3, 0.5)
    offboard.take(message, 0.0, 0)
    assert offboard.setpoint == RatesSetpoint((None, 0.2, None), 0.5)


# --- on the ground, disarmed (seen on 1.13.3, built without lockstep and with it) --------------------------------------


@pytest.mark.parametrize(("lockstep_build", "taken"), [(False, ["torque", "rates"]), (True, ["rates"])])
def test_a_build_with_lockstep_enters_offboard_on_no_torques(pilot, lockstep_build, taken):
    for setpoint in ("torque", "rates"):
        p = pilot(lockstep_build=lockstep_build).run(1.1)
        assert p.offboard() == [TEMPORARILY_REJECTED]
        p.stream(lambda q, name=setpoint: getattr(q, name)(thrust=0.0), 0.5)
        p.forget()
        assert p.offboard() == [ACCEPTED if setpoint in taken else TEMPORARILY_REJECTED]
        p.stream(lambda q, name=setpoint: getattr(q, name)(thrust=0.0), 1.1)
        assert p.messages("HEARTBEAT")[-1].custom_mode == (0x00060000 if setpoint in taken else 0x03040000)
        assert p.texts() == []


# --- the stream stops ------------------------------------------------------------------------------------------------


def test_stream_loss_on_113_lands(pilot, quiet):
    p = enter(pilot(sensors=quiet).hover()).heartbeat()
    p.forget()
    p.torque()
    p.run(0.99)
    assert p.mock.mode == "OFFBOARD"
    p.run(0.03)
    assert p.mock.mode == "AUTO.LAND"
    assert p.texts() == ["Failsafe enabled: no RC and no offboard", "Failsafe mode activated"]
    p.run(1.1)
    beat = p.messages("HEARTBEAT")[-1]
    assert (beat.custom_mode, beat.system_status) == (0x06040000, mavlink.MAV_STATE_CRITICAL)
    p.run(12.0)
    assert not p.mock.armed
    assert not p.truth.crashed


def test_stream_loss_on_116_sinks_and_lands(pilot):
    p = pilot(firmware="1.16").hover().heartbeat()
    p.rates()
    p.offboard()
    p.run(1.1)
    assert p.mock.mode == "POSCTL"
    assert p.texts()[-1] == "Failsafe activated"
    p.run(2.0)
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(0.55, abs=0.1)
    p.run(10.0)
    assert not p.mock.armed


def test_stream_returns_and_so_does_offboard(pilot):
    p = enter(pilot().hover())
    p.run(1.2)
    assert p.mock.mode == "AUTO.LAND"
    p.torque()
    p.run(0.01)
    assert p.mock.mode == "OFFBOARD"


def test_two_hertz_hold_offboard(pilot):
    p = pilot().hover()
    p.position(0.0, 0.0, -2.5)
    p.offboard()
    for _ in range(8):
        p.position(0.0, 0.0, -2.5)
        p.run(0.5)
        assert p.mock.mode == "OFFBOARD"


def test_the_last_torque_is_held_and_tumbles_the_vehicle(pilot):
    p = enter(pilot().hover()).heartbeat()
    p.torque(roll=0.2)
    p.run(4.0)
    assert p.truth.crashed
    assert not p.mock.armed
    assert p.truth.motor_commands == (0.0, 0.0, 0.0, 0.0)
    assert "Crash detected: motors stopped" in p.texts()
    assert p.command(400, 1) == [TEMPORARILY_REJECTED]


def test_another_mode_ends_the_failsafe(pilot):
    p = enter(pilot().hover())
    p.run(1.2)
    p.command(176, 1, 4, 3)
    p.torque()
    p.run(0.1)
    assert p.mock.mode == "AUTO.LOITER"


def test_without_the_rc_exception_113_leaves_offboard(pilot):
    p = pilot(com_rcl_except=0).hover().heartbeat()
    p.torque()
    assert p.offboard() == [ACCEPTED]
    p.stream(lambda q: q.torque(), 0.5)
    assert p.mock.mode == "AUTO.LOITER"
    assert "Failsafe enabled: No manual control stick input" in p.texts()
    p.stream(lambda q: q.torque(), 15.5, hz=5)
    assert p.mock.mode in ("AUTO.RTL", "AUTO.LAND")
    p = pilot(com_rcl_except=0, firmware="1.16").hover()
    p.rates()
    p.offboard()
    p.stream(lambda q: q.rates(), 0.5)
    assert p.mock.mode == "OFFBOARD"
