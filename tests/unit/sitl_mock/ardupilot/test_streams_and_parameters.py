"""What the ArduCopter personality sends when, and its parameters."""

from __future__ import annotations

import math

import pytest

from mavquad.endpoint import advance
from mavquad.protocol.codec import Encoder, decode, mavlink
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig

ATTITUDE, LOCAL, SERVO = 30, 32, 36
NAN = math.nan


def count(vehicle, name, seconds):
    vehicle.forget()
    return len(vehicle.run(seconds).messages(name)) / seconds


def test_a_fresh_link_is_quiet(copter):
    vehicle = copter().run(2.0)
    vehicle.forget()
    vehicle.run(30.0)
    kinds = {decode(frame).get_type() for _, frame in vehicle.frames}
    assert kinds == {"HEARTBEAT", "TIMESYNC", "PARAM_VALUE", "STATUSTEXT"} - (
        {"STATUSTEXT"} if not vehicle.texts() else set()
    )
    assert len(vehicle.messages("HEARTBEAT")) == 30
    assert [m.tc1 for m in vehicle.messages("TIMESYNC")] == [0, 0, 0]


@pytest.mark.parametrize(("asked_hz", "got_hz"), [(1, 1), (50, 50), (100, 100), (200, 200), (250, 250), (333, 250)])
def test_rates(copter, asked_hz, got_hz):
    """The mock's tick is 4 ms, so that 250 Hz is the most (the real one: 333)."""
    vehicle = copter().run(1.1)
    assert vehicle.command(511, ATTITUDE, 1e6 / asked_hz) == [0]
    assert count(vehicle, "ATTITUDE", 10.0) == pytest.approx(got_hz, abs=0.11)


def test_intervals_are_whole_milliseconds(copter):
    vehicle = copter().run(1.1)
    vehicle.command(511, ATTITUDE, 7999)
    assert count(vehicle, "ATTITUDE", 7.0) == pytest.approx(1000 / 7, rel=0.02)
    vehicle.command(510, ATTITUDE)
    assert vehicle.messages("MESSAGE_INTERVAL")[-1].interval_us == 7000


@pytest.mark.parametrize("interval_us", [2500, 1000, 1, 500])
def test_too_fast_is_refused(copter, interval_us):
    vehicle = copter().run(1.1)
    vehicle.forget()
    assert vehicle.command(511, ATTITUDE, interval_us) == [2]
    chunks = vehicle.messages("STATUSTEXT")
    assert [(c.text, c.chunk_seq) for c in chunks] == [
        ("Requested rate for message ID 30 too fast. Increas", 0),
        ("e SCHED_LOOP_RATE", 1),
    ]
    assert len({c.id for c in chunks}) == 1 and chunks[0].id != 0
    assert not vehicle.run(1.0).messages("ATTITUDE")


def test_unknown_messages(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    assert vehicle.command(511, 9999, 20000) == [2]
    assert vehicle.texts() == ["No ap_message for mavlink id (9999)"]
    assert vehicle.command(512, 9999) == [4]
    assert vehicle.command(510, 9999) == [4]
    assert vehicle.messages("MESSAGE_INTERVAL")[-1].interval_us == 0


def test_a_stream_can_be_stopped(copter):
    vehicle = copter().run(1.1)
    vehicle.command(511, ATTITUDE, 20000)
    assert count(vehicle, "ATTITUDE", 1.0) == pytest.approx(50, abs=1)
    vehicle.command(511, ATTITUDE, -1)
    assert count(vehicle, "ATTITUDE", 1.0) == 0
    assert vehicle.command(511, 0, 0) == [0]
    assert count(vehicle, "HEARTBEAT", 3.0) == pytest.approx(1, abs=0.4)


def test_the_position_comes_when_the_estimator_has_one(copter):
    vehicle = copter(ready_s=42.5).run(30.0)
    vehicle.command(511, LOCAL, 50000)
    assert count(vehicle, "LOCAL_POSITION_NED", 11.0) == 0
    assert count(vehicle, "LOCAL_POSITION_NED", 2.0) > 10


def test_groups_of_streams(copter):
    vehicle = copter().run(1.1)
    vehicle.send(mavlink.MAVLink_request_data_stream_message(1, 1, 10, 20, 1))
    assert count(vehicle, "ATTITUDE", 2.0) == pytest.approx(20, abs=1)
    assert vehicle.messages("VFR_HUD") == []
    vehicle.send(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    vehicle.forget()
    vehicle.run(2.0)
    kinds = {decode(frame).get_type() for _, frame in vehicle.frames}
    assert kinds >= {
        "ATTITUDE", "VFR_HUD", "GPS_RAW_INT", "SYS_STATUS", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "RAW_IMU",
        "SCALED_IMU2", "SCALED_PRESSURE", "SERVO_OUTPUT_RAW", "RC_CHANNELS", "BATTERY_STATUS", "EKF_STATUS_REPORT",
        "VIBRATION", "MEMINFO", "POWER_STATUS", "SYSTEM_TIME", "MISSION_CURRENT", "NAV_CONTROLLER_OUTPUT", "AHRS",
    }  # fmt: skip
    assert len(vehicle.messages("ATTITUDE")) == pytest.approx(8, abs=1)
    vehicle.send(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 0))
    assert count(vehicle, "ATTITUDE", 2.0) == 0


def test_a_message_on_request_comes_after_its_ack(copter):
    vehicle = copter().run(1.1)
    answers = vehicle.send(mavlink.MAVLink_command_long_message(1, 1, 512, 0, 148, *[0] * 6))
    assert [a.get_type() for a in answers] == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
    assert (answers[1].flight_sw_version, answers[1].capabilities) == (67567616, 64495)
    assert vehicle.command(520) == vehicle.command(410) == [0]


def test_ports_have_their_own_rates():
    mock = MockAutopilot(MockConfig(autopilot="ardupilot"), 1, 0, ("serial", "serial"))
    encoder = Encoder(255, 190)
    list(advance(mock, 1_200_000))
    mock.datagrams_to_send(1)
    for port, interval in ((0, 10_000), (1, 100_000)):
        message = mavlink.MAVLink_command_long_message(1, 1, 511, 0, 30, interval, *[0] * 5)
        mock.receive(encoder.encode(message), 1_200_400 + port * 4, port)
    names = [[], []]
    for now in range(1_204_000, 3_200_000, 4000):
        list(advance(mock, now))
    names = [[decode(f).get_type() for f in mock.datagrams_to_send(port)] for port in (1,)]
    assert names[0].count("ATTITUDE") == pytest.approx(20, abs=1)
    assert names[0].count("HEARTBEAT") == 2
    assert names[0].count("COMMAND_ACK") == 1


def test_timesync_is_answered(copter):
    vehicle = copter().run(5.0)
    answer = vehicle.send(mavlink.MAVLink_timesync_message(0, 123456))[-1]
    assert answer.ts1 == 123456
    assert answer.tc1 == pytest.approx(5.0e9, abs=1e6)
    assert not [m for m in vehicle.send(mavlink.MAVLink_timesync_message(5, 6)) if m.get_type() == "TIMESYNC"]


def test_the_list_of_parameters(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    vehicle.send(mavlink.MAVLink_param_request_list_message(1, 1))
    assert not [m for m in vehicle.messages("PARAM_VALUE") if m.param_index != 65535]
    vehicle.run(0.8)
    listed = [m for m in vehicle.messages("PARAM_VALUE") if m.param_index != 65535]
    assert [m.param_index for m in listed] == list(range(1348))
    assert {m.param_count for m in listed} == {1348}
    values = {m.param_id: (m.param_type, m.param_value) for m in listed}
    assert values["GUID_TIMEOUT"] == (9, 3.0)
    assert values["DISARM_DELAY"] == (2, 10.0)
    assert values["WPNAV_SPEED"] == (9, 1000.0)
    assert values["SCHED_LOOP_RATE"] == (4, 400.0)


def test_streams_are_slow_while_the_list_is_sent(copter):
    vehicle = copter().run(1.1)
    vehicle.command(511, ATTITUDE, 10_000)
    vehicle.run(1.0)
    vehicle.send(mavlink.MAVLink_param_request_list_message(1, 1))
    assert count(vehicle, "ATTITUDE", 0.6) == pytest.approx(25, abs=4)
    vehicle.run(0.5)
    assert count(vehicle, "ATTITUDE", 1.0) == pytest.approx(100, abs=2)


def read(vehicle, name, index=-1):
    vehicle.forget()
    vehicle.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    at_once = len(vehicle.messages("PARAM_VALUE"))
    answers = vehicle.run(0.15).messages("PARAM_VALUE")
    return at_once, [(m.param_id, m.param_value, m.param_index) for m in answers]


def test_reading_one(copter):
    vehicle = copter().run(1.1)
    assert read(vehicle, "GUID_OPTIONS") == (0, [("GUID_OPTIONS", 0.0, read(vehicle, "GUID_OPTIONS")[1][0][2])])
    assert read(vehicle, "", 0)[1] == [("FORMAT_VERSION", 120.0, 0)]
    assert read(vehicle, "NO_SUCH_PAR") == (0, [])
    assert read(vehicle, "", 5000) == (0, [])


def test_an_answer_takes_a_tenth_of_a_second(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    vehicle.send(mavlink.MAVLink_param_request_read_message(1, 1, b"GUID_OPTIONS", -1))
    assert not vehicle.run(0.08).messages("PARAM_VALUE")
    assert vehicle.run(0.03).messages("PARAM_VALUE")


def test_setting_one(copter):
    vehicle = copter().run(1.1)
    (echo,) = [m for m in vehicle.set("GUID_OPTIONS", 8.0) if m.get_type() == "PARAM_VALUE"]
    assert (echo.param_id, echo.param_value, echo.param_type, echo.param_index) == ("GUID_OPTIONS", 8.0, 6, 65535)
    assert read(vehicle, "GUID_OPTIONS")[1][0][1] == 8.0
    assert [m for m in vehicle.set("NO_SUCH_PAR", 1.0) if m.get_type() == "PARAM_VALUE"] == []
    for value, kept in ((NAN, 8.0), (math.inf, 8.0), (1e30, float(2**31 - 1)), (2.6, 2.0)):
        vehicle.set("GUID_OPTIONS", value)
        assert read(vehicle, "GUID_OPTIONS")[1][0][1] == pytest.approx(kept, rel=1e-6)


def test_another_system_id(copter):
    vehicle = copter(system_id=7).run(1.1)
    assert vehicle.command(400, 1) == []
    vehicle.send(mavlink.MAVLink_param_request_list_message(1, 1))
    assert not [m for m in vehicle.run(0.5).messages("PARAM_VALUE") if m.param_index != 65535]
    vehicle.send(mavlink.MAVLink_param_request_read_message(7, 1, b"MAV_SYSID", -1))
    assert vehicle.run(0.2).messages("PARAM_VALUE")[-1].param_value == 7.0


def test_nothing_answers_torques_or_a_ping(copter):
    vehicle = copter().hover()
    for message in (
        mavlink.MAVLink_set_actuator_control_target_message(0, 0, 1, 1, [0.5] * 8),
        mavlink.MAVLink_ping_message(0, 1, 0, 0),
        mavlink.MAVLink_manual_control_message(1, 500, 500, 500, 500, 0),
    ):
        assert [m for m in vehicle.send(message) if m.get_type() not in ("HEARTBEAT", "TIMESYNC")] == []
    assert vehicle.run(2.0).truth.position_ned_m == pytest.approx((0.0, 0.0, -10.0), abs=0.4)


def test_groups_and_their_parameters_are_the_same_thing(copter):
    vehicle = copter().run(1.1)
    vehicle.send(mavlink.MAVLink_request_data_stream_message(1, 1, 11, 5, 1))
    assert read(vehicle, "MAV1_EXTRA2")[1][0][1] == 5.0
    vehicle.set("MAV1_EXTRA1", 20)
    assert count(vehicle, "ATTITUDE", 2.0) == pytest.approx(20, abs=1)
    vehicle.set("MAV1_EXTRA1", -5)
    assert count(vehicle, "ATTITUDE", 2.0) == 0
