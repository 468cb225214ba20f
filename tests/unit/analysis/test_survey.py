"""The survey of synthetic logs whose contents are known."""

from __future__ import annotations

import json

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.survey import ArmedSpan, survey
from mavquad.tlog import scan


def test_an_empty_log():
    empty = survey(scan(b""))
    assert (empty.frames, empty.duration_s, empty.senders, empty.main_vehicle()) == (0, 0.0, (), None)


def test_a_vehicle_and_a_ground_station(log):
    for second in range(11):
        log.heartbeat(second, armed=3 <= second < 7)
        log.heartbeat(second + 0.5, sender=(255, 190), vehicle_type=6, autopilot=8)
        for tenth in range(10):
            log.local(second + tenth / 10, (1, 2, 3), (0, 0, 0))
    result = survey(log.contents())
    vehicle, station = result.senders
    assert result.main_vehicle() == vehicle
    assert (vehicle.sender, vehicle.vehicle_type, vehicle.autopilot) == (
        (1, 1),
        "MAV_TYPE_QUADROTOR",
        "MAV_AUTOPILOT_PX4",
    )
    assert vehicle.is_vehicle
    assert not station.is_vehicle
    assert vehicle.armed_spans == (ArmedSpan(3.0, 7.0),)
    assert [(m.name, m.count) for m in vehicle.messages] == [("LOCAL_POSITION_NED", 110), ("HEARTBEAT", 11)]
    assert [m.rate_hz for m in vehicle.messages] == pytest.approx([10.0, 1.0])
    assert (result.frames, result.duration_s) == (132, pytest.approx(10.9))


def test_armed_to_the_end_and_armed_twice(log):
    for second, armed in enumerate([True, False, True, True]):
        log.heartbeat(second, armed)
    assert survey(log.contents()).senders[0].armed_spans == (ArmedSpan(0.0, 1.0), ArmedSpan(2.0, 3.0))


def test_forged_heartbeats_that_outnumber_the_true_ones_neither_disarm_nor_rename(log):
    for second in range(10):
        log.heartbeat(second, armed=second >= 4)
        for part in range(1, 5):
            log.heartbeat(second + part / 5, vehicle_type=0, autopilot=8, version=1)
    [vehicle] = survey(log.contents()).senders
    assert vehicle.autopilot == "MAV_AUTOPILOT_PX4"
    assert vehicle.contradicting_heartbeats == 40
    assert vehicle.armed_spans == (ArmedSpan(4.0, 9.0),)


def test_the_main_vehicle_is_the_one_whose_poses_are_in_the_log(log):
    for second in range(20):
        log.heartbeat(second, sender=(2, 1))
    log.heartbeat(0, sender=(3, 1))
    log.local(1, (0, 0, 0), (0, 0, 0), sender=(3, 1))
    assert survey(log.contents()).main_vehicle().sender == (3, 1)


def test_without_poses_it_is_the_autopilot(log):
    for second in range(20):
        log.heartbeat(second, sender=(255, 190), vehicle_type=6, autopilot=8)
    log.heartbeat(3, sender=(9, 1))
    assert survey(log.contents()).main_vehicle().sender == (9, 1)


def test_types_that_the_dialect_does_not_know(log):
    log.heartbeat(0, vehicle_type=250, autopilot=251)
    [vehicle] = survey(log.contents()).senders
    assert (vehicle.vehicle_type, vehicle.autopilot) == ("MAV_TYPE 250", "MAV_AUTOPILOT 251")


def test_one_message_has_no_rate_and_backward_stamps_are_counted(log):
    log.add(5, dialect.MAVLink_ping_message(0, 0, 0, 0))
    log.heartbeat(3)
    log.heartbeat(3)
    result = survey(log.contents())
    assert result.backward_stamps == 1
    assert [message.rate_hz for message in result.senders[0].messages] == [None, None]
    assert result.senders[0].count("PING") == 1
    assert result.senders[0].count("ATTITUDE") == 0


def test_json_is_json(log):
    log.heartbeat(1, armed=True)
    log.local(2, (1, 2, 3), (0, 0, 0))
    written = json.loads(json.dumps(survey(log.contents()).to_json(), allow_nan=False))
    assert written["frames"] == 2
    assert written["bad_ranges"] == []
    [sender] = written["senders"]
    assert sender["messages"]["HEARTBEAT"] == {"count": 1, "rate_hz": None}
    assert sender["armed_spans"] == [{"from_s": 0.0, "to_s": 0.0}]
    assert (sender["system"], sender["component"], sender["type"]) == (1, 1, "MAV_TYPE_QUADROTOR")
