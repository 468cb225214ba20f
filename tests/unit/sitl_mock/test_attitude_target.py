"""SET_ATTITUDE_TARGET by its mask, as seen on PX4 1.16.2, and what ATTITUDE_TARGET then shows; the agent's messages."""

import math
import struct

import pytest
from fastcrc.crc16 import mcrf4xx

from mavquad.endpoint import deliver
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.protocol.firmware import setpoints
from mavquad.types import AttitudeCommand, RateCommand, TorqueCommand
from sitl_mock.geometry import from_euler
from sitl_mock.inner_loops import AttitudeSetpoint, RatesSetpoint
from sitl_mock.personality.px4.offboard import OffboardInput

NAN = math.nan
G = 9.81
HOVER = 0.4905
SCALE = (113.0, 113.0, 13.3)


@pytest.fixture
def flying(pilot, quiet):
    """A vehicle that hovers in OFFBOARD under a level attitude setpoint."""

    def make(**config):
        p = pilot(sensors=quiet, **config).hover()
        p.rates(mask=0x07)
        assert p.offboard()[-1] == 0
        return p.stream(lambda q: q.rates(mask=0x07), 1.0)

    return make


def taken(mask, rates=(0.1, 0.2, 0.3), q=(1.0, 0.0, 0.0, 0.0), thrust=0.5):
    offboard = OffboardInput("1.16")
    offboard.take(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust), 0.0, 0)
    return offboard


def with_thrust_body(frame, down):
    """The same SET_ATTITUDE_TARGET frame with the extension thrust_body = (0, 0, down), which pymavlink cannot pack."""
    payload = bytes(frame[10:-2]).ljust(39, b"\0") + struct.pack("<3f", 0.0, 0.0, down)
    start = bytes((len(payload), *frame[2:10])) + payload
    crc = mcrf4xx(start + bytes((mavlink.MAVLink_set_attitude_target_message.crc_extra,)))
    return bytes((0xFD,)) + start + struct.pack("<H", crc)


# --- what each mask means ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mask", "setpoint"),
    [
        (0x80, RatesSetpoint((0.1, 0.2, 0.3), 0.5)),
        (0x84, RatesSetpoint((0.1, 0.2, None), 0.5)),
        (0xC0, RatesSetpoint((0.1, 0.2, 0.3), 0.0)),
        (0xA0, RatesSetpoint((0.1, 0.2, 0.3), 0.5)),
        (0x81, None),
        (0x82, None),
        (0x87, None),
        (0x07, AttitudeSetpoint((1.0, 0.0, 0.0, 0.0), 0.5)),
        (0x03, AttitudeSetpoint((1.0, 0.0, 0.0, 0.0), 0.5, 0.3)),
        (0x47, AttitudeSetpoint((1.0, 0.0, 0.0, 0.0), 0.0)),
        (0x27, AttitudeSetpoint((1.0, 0.0, 0.0, 0.0), 0.0)),
    ],
    ids=lambda value: f"{value:#04x}" if isinstance(value, int) else "",
)
def test_the_setpoint_of_a_mask(mask, setpoint):
    offboard = taken(mask)
    assert offboard.next_setpoint() == setpoint
    assert offboard.next_setpoint() == setpoint
    assert offboard.is_alive(0, 1.0) is (setpoint is not None)


def test_attitude_and_rates_act_in_turns():
    offboard = taken(0x00)
    attitude = AttitudeSetpoint((1.0, 0.0, 0.0, 0.0), 0.5, 0.3)
    assert offboard.next_setpoint() == RatesSetpoint((0.1, 0.2, 0.3), 0.5)
    assert [offboard.next_setpoint() for _ in range(3)] == [attitude] * 3


@pytest.mark.parametrize(("thrust", "clamped"), [(-0.5, 0.0), (1.5, 1.0), (NAN, 0.0)])
@pytest.mark.parametrize("mask", [0x80, 0x07])
def test_thrust_is_clamped_and_nan_is_none(mask, thrust, clamped):
    assert taken(mask, thrust=thrust).setpoint.thrust_norm == clamped


def test_a_rate_that_is_nan_is_left_alone_and_a_nan_feed_forward_is_none():
    assert taken(0x80, (NAN, 0.2, 0.3)).setpoint.rates_frd_rad_s == (None, 0.2, 0.3)
    assert taken(0x03, (0.0, 0.0, NAN)).setpoint.yaw_rate_rad_s == 0.0


# --- flown -------------------------------------------------------------------------------------------------------------


def test_quaternion_with_yaw_rate_as_recorded(flying):
    # recorded: 0.5 rad/s with the quaternion level: 13 degrees, then it stops, for the quaternion's yaw pulls back
    p = flying()
    yaws = []
    for _ in range(50):
        p.stream(lambda q: q.rates(yaw=0.5, mask=0x03), 0.1)
        yaws.append(math.degrees(p.truth.euler_rad[2]))
    assert max(yaws) == pytest.approx(13.0, abs=0.5)
    assert yaws[-1] == pytest.approx(math.degrees(0.5 / 2.8), abs=0.3)


def test_attitude_and_rates_fight_as_recorded(flying):
    # recorded: a roll rate of 0.3 rad/s beside the level quaternion gave a standing roll of 1.9 degrees
    p = flying(firmware="1.16")
    p.stream(lambda q: q.rates(roll=0.3, mask=0x00), 3.0, hz=100)
    assert math.degrees(p.truth.euler_rad[0]) == pytest.approx(1.9, abs=0.3)
    p.command(511, mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, 4000)
    p.forget()
    p.stream(lambda q: q.rates(roll=0.3, mask=0x00), 0.5, hz=100)
    shown = {round(m.body_roll_rate, 2) for m in p.messages("ATTITUDE_TARGET")}
    assert 0.3 in shown
    assert any(rate < 0 for rate in shown)


@pytest.mark.parametrize(("mask", "falls"), [(0x27, False), (0xA0, True)])
def test_thrust_body_counts_for_an_attitude_only(flying, mask, falls):
    p = flying()
    plain = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.0)
    for _ in range(20):
        list(deliver(p.mock, with_thrust_body(p.encoder.encode(plain), -0.55), p.now_us))
        p.run(0.02)
    sinks_m_s = p.truth.velocity_ned_m_s[2]
    assert sinks_m_s > 1.5 if falls else sinks_m_s == pytest.approx(-0.35, abs=0.15)


def test_thrust_body_on_mavlink_1_or_cut_off_is_none(flying):
    p = flying()
    p.stream(lambda q: q.rates(mask=0x27, thrust=0.5), 0.4)
    assert p.truth.velocity_ned_m_s[2] > 1.5


@pytest.mark.parametrize("q", [(NAN, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)])
def test_an_attitude_that_is_none_keeps_thrust_and_stream_and_shows_nan_rates(flying, q):
    p = flying()
    p.forget()
    p.stream(lambda other: other.rates(mask=0x07, q=q), 2.0)
    assert p.mock.mode == "OFFBOARD"
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.2)
    shown = p.messages("ATTITUDE_TARGET")[-1]
    assert all(math.isnan(rate) for rate in (shown.body_roll_rate, shown.body_pitch_rate, shown.body_yaw_rate))
    assert shown.thrust == pytest.approx(0.4905)


# --- what ATTITUDE_TARGET shows -------------------------------------------------------------------------------------------


def test_attitude_target_under_body_rates_as_recorded(flying):
    # px4-v1.16.2-c-stop: the rates as sent, but attitude and thrust of the last attitude setpoint
    p = flying(firmware="1.16")
    p.forget()
    p.stream(lambda q: q.rates(roll=0.1, pitch=-0.05, mask=0x84, thrust=0.55), 0.5)
    shown = p.messages("ATTITUDE_TARGET")[-1]
    assert (shown.body_roll_rate, shown.body_pitch_rate) == pytest.approx((0.1, -0.05))
    assert math.isnan(shown.body_yaw_rate)
    assert shown.thrust == pytest.approx(0.4905)
    assert list(shown.q) == [1.0, 0.0, 0.0, 0.0]


def test_attitude_target_under_an_attitude(flying):
    p = flying()
    p.forget()
    wanted = from_euler(0.1, -0.05, 0.2)
    p.stream(lambda q: q.rates(mask=0x07, q=wanted, thrust=0.55), 1.5)
    shown = p.messages("ATTITUDE_TARGET")[-1]
    assert list(shown.q) == pytest.approx(wanted)
    assert shown.thrust == pytest.approx(0.55)
    assert shown.body_roll_rate == pytest.approx(0.0, abs=0.05)


# --- the agent's commands at each depth ------------------------------------------------------------------------------------


def fly(p, depth, command, seconds=0.3):
    controls = setpoints.controls(command, SCALE, HOVER, G)
    encoder = Encoder(245, 191)
    p.stream(lambda q: q.send(setpoints.setpoint(q.now_us, depth, controls, 1, 1), encoder), seconds)
    return p


@pytest.mark.parametrize(("axis", "sign"), [(0, 1), (1, -1), (2, -1)])
@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
def test_the_agents_commands_turn_the_vehicle_as_they_mean(flying, depth, axis, sign):
    """Positive FLU: right side down, nose down, nose left; the truth is FRD."""
    p = flying(firmware="1.13" if depth == "torque" else "1.15")
    one = tuple(0.2 if i == axis else 0.0 for i in range(3))
    command = {"torque": TorqueCommand, "rate": RateCommand}.get(depth, lambda v, t: AttitudeCommand(*v, t))(one, G)
    turned = fly(p, depth, command).truth
    assert sign * turned.euler_rad[axis] > 0.001
    assert sign * turned.rates_frd_rad_s[axis] > 0.01
    assert all(abs(turned.euler_rad[i]) < 0.1 * abs(turned.euler_rad[axis]) for i in range(3) if i != axis)


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_the_agents_thrust_lifts(flying, depth):
    zero = (0.0, 0.0, 0.0)
    command = RateCommand(zero, 1.2 * G) if depth == "rate" else AttitudeCommand(*zero, 1.2 * G)
    p = fly(flying(), depth, command, 0.5)
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(-0.2 * G * 0.45, rel=0.3)


@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
def test_the_agents_safe_setpoint_holds_the_vehicle(pilot, quiet, depth):
    p = pilot(sensors=quiet, vehicle={"heading_deg": 120.0}).hover()
    yaw_rad = p.truth.euler_rad[2]
    safe = setpoints.setpoint(p.now_us, depth, setpoints.safe_controls(depth, HOVER, yaw_rad), 1, 1)
    p.send(safe)
    p.offboard()
    p.stream(lambda q: q.send(safe), 1.0)
    assert p.truth.euler_rad == pytest.approx((0.0, 0.0, yaw_rad), abs=0.01)
    assert p.truth.velocity_ned_m_s == pytest.approx((0.0, 0.0, 0.0), abs=0.05)
