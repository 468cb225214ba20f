"""Each command's COMMAND_ACK, refusal and STATUSTEXT, as seen on real PX4 1.13.3 and 1.16.2."""

import math

import pytest

from mavquad.protocol import codec
from mavquad.protocol.codec import Encoder, mavlink

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
NAN = math.nan


def test_ack_is_addressed_to_the_sender(pilot):
    p = pilot()
    message = mavlink.MAVLink_command_long_message(1, 1, 511, 0, 30.0, 10000.0, 0, 0, 0, 0, 0)
    (ack,) = p.send(message, Encoder(42, 191))
    assert (ack.target_system, ack.target_component) == (42, 191)
    assert (ack.command, ack.result) == (511, ACCEPTED)


def test_arming_waits_for_the_preflight_checks(pilot):
    p = pilot().heartbeat().run(0.5)
    assert p.command(400, 1) == [TEMPORARILY_REJECTED]
    assert any(text.startswith("Preflight Fail") for text in p.texts())
    assert not p.mock.armed
    p.run(0.6)
    assert p.command(400, 1) == [ACCEPTED]
    assert p.command(400, 1) == [ACCEPTED]
    assert p.mock.armed
    assert "Armed by external command" in p.texts()


def test_prearm_bit_follows(pilot):
    p = pilot(ready_s=2.0).run(4.0)
    health = [m.onboard_control_sensors_health & 0x10000000 for m in p.messages("SYS_STATUS")]
    assert not any(health[:10])
    assert all(health[10:])


@pytest.mark.parametrize(
    ("firmware", "text"), [("1.13", "Disarming denied! Not landed"), ("1.16", "Disarming denied: not landed")]
)
def test_disarm_on_ground_and_in_the_air(pilot, firmware, text):
    p = pilot(firmware=firmware).run(1.1)
    p.command(400, 1)
    assert p.command(400, 0) == [ACCEPTED]
    assert not p.mock.armed
    p = pilot(firmware=firmware).hover().heartbeat()
    assert p.command(400, 0) == [TEMPORARILY_REJECTED]
    assert text in p.texts()
    assert p.mock.armed
    assert p.command(400, 0, 21196) == [ACCEPTED]
    assert not p.mock.armed
    p.run(0.4)
    assert p.truth.velocity_ned_m_s[2] > 2.0


def test_arm_with_a_strange_parameter_gets_no_ack(pilot):
    assert pilot().command(400, 5) == []


def test_preflight_disarm_after_ten_seconds(pilot):
    p = pilot().run(1.1).heartbeat()
    p.command(400, 1)
    p.run(9.0)
    assert p.mock.armed
    p.run(1.1).heartbeat()
    assert not p.mock.armed


@pytest.mark.parametrize(
    ("altitude_amsl_m", "climb_m"), [(NAN, 2.5), (32.5 + 6.0, 6.0), (0.0, 2.5)], ids=["nan", "amsl", "too low"]
)
def test_takeoff_altitude(pilot, quiet, altitude_amsl_m, climb_m):
    p = pilot(sensors=quiet).run(1.1).heartbeat()
    p.command(400, 1)
    assert p.command(22, 0, 0, 0, NAN, NAN, NAN, altitude_amsl_m) == [ACCEPTED]
    assert p.mock.mode == "AUTO.TAKEOFF"
    p.fly(16.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert p.truth.position_ned_m[2] == pytest.approx(-climb_m, abs=0.1)
    told = "Using minimum takeoff altitude: 2.50 m" in p.texts()
    assert told == (climb_m == 2.5)


def test_land_and_return(pilot):
    p = pilot().hover().heartbeat()
    assert p.command(21) == [ACCEPTED]
    assert p.mock.mode == "AUTO.LAND"
    assert "Landing at current position" in p.texts()
    assert p.command(20) == [ACCEPTED]
    assert p.mock.mode == "AUTO.RTL"


@pytest.mark.parametrize(
    ("main", "sub", "name"), [(4, 3, "AUTO.LOITER"), (4, 6, "AUTO.LAND"), (3, 0, "POSCTL"), (4, 5, "AUTO.RTL")]
)
def test_set_mode_by_command_and_by_the_old_message(pilot, main, sub, name):
    p = pilot()
    assert p.command(176, 1, main, sub) == [ACCEPTED]
    assert p.mock.mode == name
    p = pilot()
    (ack,) = p.send(mavlink.MAVLink_set_mode_message(1, 1, main << 16 | sub << 24))
    assert (ack.command, ack.result) == (176, ACCEPTED)
    assert p.mock.mode == name


def test_an_invalid_mode_is_acknowledged_and_nothing_happens(pilot):
    p = pilot()
    assert p.command(176, 1, 77) == [ACCEPTED]
    assert p.mock.mode == "AUTO.LOITER"


def test_message_interval(pilot):
    p = pilot(streams={"max_position_hz": 100, "max_attitude_hz": 250})
    assert p.command(511, 32, 10000) == [ACCEPTED]
    assert p.command(511, 30, -1) == [ACCEPTED]
    assert p.command(511, 31, 20) == [ACCEPTED]
    assert p.command(511, 9999, 10000) == [FAILED]
    p.run(1.0).forget()
    p.run(2.0)
    assert len(p.messages("LOCAL_POSITION_NED")) == 200
    assert len(p.messages("ATTITUDE")) == 0
    assert len(p.messages("ATTITUDE_QUATERNION")) == 500  # 50 kHz asked
    p.command(511, 30, 0)
    p.forget()
    p.run(2.0)
    assert len(p.messages("ATTITUDE")) == 200


@pytest.mark.parametrize("message_id", [26, 62, 65, 69, 106, 115, 233, 291, 397])
def test_a_stream_that_the_mock_does_not_send_is_accepted(pilot, message_id):
    p = pilot().run(0.1)
    for interval_us in (10000, -1, 0):
        assert p.command(511, message_id, interval_us) == [ACCEPTED]
    p.forget()
    p.run(1.0)
    assert not [frame for _, frame in p.frames if codec.message_id(frame) == message_id]


@pytest.mark.parametrize("message_id", [27, 29, 34, 70, 82, 100, 9999])
def test_a_message_without_a_stream_is_refused(pilot, message_id):
    # not in the list of mavlink_messages.cpp of 1.13.3; 29 drops out of it by a misspelt guard
    assert pilot().command(511, message_id, 10000) == [FAILED]


def test_nan_interval_is_denied(pilot):
    assert pilot().command(511, 30, NAN) == [DENIED]


def test_request_message(pilot):
    p = pilot().run(0.1)
    assert p.command(512, 148) == [ACCEPTED]
    (version,) = p.messages("AUTOPILOT_VERSION")
    assert version.flight_sw_version == 17629952  # 1.13.3, recorded
    assert p.command(520, 1) == [ACCEPTED]
    assert p.command(512, 242) == [ACCEPTED]
    assert p.messages("HOME_POSITION")
    assert p.command(512, 9999) == [DENIED]


def test_unknown_command_is_unsupported(pilot):
    assert pilot().command(31000) == [UNSUPPORTED]


@pytest.mark.parametrize(
    ("firmware", "version"), [("1.14", (1, 14, 4)), ("1.15", (1, 15, 4)), ("1.16", (1, 16, 2)), ("1.17", (1, 17, 0))]
)
def test_version_of_a_later_release(pilot, firmware, version):
    p = pilot(firmware=firmware)
    p.command(512, 148)
    number = p.messages("AUTOPILOT_VERSION")[0].flight_sw_version
    assert (number >> 24, number >> 16 & 255, number >> 8 & 255, number & 255) == (*version, 255)


@pytest.mark.parametrize("target", [(2, 1), (0, 0), (1, 100)])
def test_command_for_somebody_else(pilot, target):
    assert pilot().command(400, 1, target=target) == [FAILED]
    assert pilot(firmware="1.15").command(400, 1, target=target) == [FAILED]
    assert pilot(firmware="1.16").command(400, 1, target=target) == []


def test_component_zero_is_everybody(pilot):
    assert pilot().command(511, 30, 10000, target=(1, 0)) == [ACCEPTED]


def test_command_int_arms_too(pilot):
    p = pilot().run(1.1)
    (ack, *_) = p.send(mavlink.MAVLink_command_int_message(1, 1, 0, 400, 0, 0, 1.0, 0.0, 0.0, 0.0, 0, 0, 0.0))
    assert (ack.command, ack.result) == (400, ACCEPTED)
    assert p.mock.armed


def test_timesync_is_answered_with_the_boot_clock(pilot):
    p = pilot().run(2.0)
    (answer,) = p.send(mavlink.MAVLink_timesync_message(0, 123456789))
    assert answer.ts1 == 123456789
    assert answer.tc1 == 2_000_400_000
    assert p.send(mavlink.MAVLink_timesync_message(5, 6)) == []


def test_statustext_waits_for_a_ground_station(pilot):
    p = pilot().run(1.1)
    p.command(400, 1)
    p.run(1.0)
    assert p.texts() == []
    p.heartbeat()
    assert p.texts() == ["Armed by external command"]
    p.run(6.0)  # no heartbeat any more
    p.forget()
    p.command(400, 0)
    assert p.texts() == []


def test_heartbeat_of_a_companion_is_no_ground_station(pilot):
    p = pilot().run(1.1)
    p.command(400, 1)
    p.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    assert p.texts() == []


@pytest.mark.parametrize(
    ("firmware", "mode_after"), [("1.13", "AUTO.LAND"), ("1.15", "AUTO.LOITER"), ("1.16", "AUTO.LOITER")]
)
def test_arming_again_after_landing_and_taking_off(pilot, firmware, mode_after):
    # px4-v1.16.2-a: disarmed by landing, 1.16 goes back to the last mode that can be armed in
    p = pilot(firmware=firmware).hover()
    p.command(21)
    p.fly(14.0)
    assert (p.mock.armed, p.mock.mode) == (False, mode_after)
    assert p.command(400, 1) == [ACCEPTED]
    assert p.command(22, 0, 0, 0, NAN, NAN, NAN, NAN) == [ACCEPTED]
    p.fly(12.0)
    assert (p.mock.armed, p.mock.mode) == (True, "AUTO.LOITER")
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.4)


def test_arming_in_return_mode_is_refused(pilot):
    for firmware, text in (("1.13", "Mode not suitable for takeoff"), ("1.16", "Arming denied: Resolve system")):
        p = pilot(firmware=firmware).run(1.1).heartbeat()
        p.command(20)
        assert p.command(400, 1) == [TEMPORARILY_REJECTED]
        assert any(said.startswith(text) for said in p.texts())
        assert not p.mock.armed
        p.command(176, 1, 4, 3)
        assert p.command(400, 1) == [ACCEPTED]


def test_prearm_bit_drops_in_return_mode_on_the_ground(pilot):
    def prearm(p):
        p.forget()
        p.run(0.4)
        return [bool(m.onboard_control_sensors_health & 0x10000000) for m in p.messages("SYS_STATUS")]

    p = pilot().run(1.1)
    p.command(20)
    assert prearm(p) == [False, False]
    p.command(21)
    assert prearm(p) == [True, True]
    p = pilot().hover()
    p.position()
    p.offboard()
    p.stream(lambda q: q.position(5.0, 0.0, -3.0), 4.0, hz=10)
    p.command(20)
    assert prearm(p) == [True, True]  # armed: the checks are not run anew
    assert (p.mock.armed, p.mock.mode) == (True, "AUTO.RTL")


def test_116_acknowledges_a_mode_twice(pilot):
    assert pilot(firmware="1.16").command(176, 1, 4, 3) == [ACCEPTED, ACCEPTED]
    assert pilot(firmware="1.15").command(176, 1, 4, 3) == [ACCEPTED]


@pytest.mark.parametrize(
    ("message_id", "interval_us"), [(30, 10_000), (32, 33_333), (242, 2_000_000), (24, -1), (375, 0), (9999, 0)]
)
def test_intervals_are_told_as_by_px4_1_13_3(pilot, message_id, interval_us):
    p = pilot()
    answers = p.send(mavlink.MAVLink_command_long_message(1, 1, 510, 0, message_id, 0, 0, 0, 0, 0, 0))
    assert [a.get_type() for a in answers] == ["MESSAGE_INTERVAL", "COMMAND_ACK"]
    assert (answers[0].message_id, answers[0].interval_us, answers[1].result) == (message_id, interval_us, ACCEPTED)


def test_an_interval_asked_for_is_told_whatever_comes(pilot):
    p = pilot()
    p.command(511, 32, 2000)
    answers = p.send(mavlink.MAVLink_command_long_message(1, 1, 510, 0, 32, 0, 0, 0, 0, 0, 0))
    assert answers[0].interval_us == 2000
    p.command(511, 32, -1)
    answers = p.send(mavlink.MAVLink_command_long_message(1, 1, 510, 0, 32, 0, 0, 0, 0, 0, 0))
    assert answers[0].interval_us == 0


@pytest.mark.parametrize(
    ("firmware", "message_id", "result"),
    [("1.13", 148, 0), ("1.13", 49, 0), ("1.13", 30, 0), ("1.13", 375, 0), ("1.13", 140, 0), ("1.13", 340, 0),
     ("1.13", 12901, 2), ("1.13", 29, 2), ("1.13", 42, 2), ("1.13", 87, 2), ("1.13", 9999, 2),
     ("1.16", 12901, 0), ("1.16", 29, 0), ("1.16", 42, 0), ("1.16", 140, 2), ("1.16", 340, 2)],
)  # fmt: skip
def test_messages_asked_for_by_their_id(pilot, firmware, message_id, result):
    # of 1.13: as a live 1.13.3 answered, disarmed
    p = pilot(firmware=firmware).run(0.5)
    p.forget()
    assert p.command(512, message_id) == [result]
    assert [codec.message_id(frame) for _, frame in p.frames].count(message_id) == (result == 0)
