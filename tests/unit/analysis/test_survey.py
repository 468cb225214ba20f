"""The survey of synthetic logs whose contents are known."""

from __future__ import annotations

import json

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.survey import ArmedSpan, Flight, Gap, ModeSpan, survey, survey_file
from mavquad.tlog import Selection, scan


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


def test_modes_over_time(log):
    px4 = [(0, 3 << 16), (2, 3 << 16), (4, 4 << 16 | 3 << 24), (9, 6 << 16)]
    copter = [(0, 4), (5, 9), (7, 99)]
    for second, mode in px4:
        log.heartbeat(second, mode=mode)
    for second, mode in copter:
        log.heartbeat(second + 0.5, mode=mode, sender=(2, 1), autopilot=3)
        log.heartbeat(second + 0.5, mode=mode, sender=(3, 1), autopilot=18)
        log.heartbeat(second + 0.5, mode=mode, sender=(255, 190), vehicle_type=6, autopilot=8)
    first, second, third, station = survey(log.contents()).senders
    assert first.modes == (ModeSpan(0, 4, "POSCTL"), ModeSpan(4, 9, "AUTO.LOITER"), ModeSpan(9, 9, "OFFBOARD"))
    assert second.modes == (ModeSpan(0.5, 5.5, "GUIDED"), ModeSpan(5.5, 7.5, "LAND"), ModeSpan(7.5, 7.5, "mode 99"))
    assert [span.mode for span in third.modes] == ["mode 4", "mode 9", "mode 99"]
    assert station.modes == ()


@pytest.mark.parametrize(
    ("vehicle_type", "name"), [(1, "GUIDED"), (10, "GUIDED"), (12, "mode 15"), (14, "AUTOTUNE"), (26, "mode 15")]
)
def test_modes_of_vehicles_that_do_not_hover(log, vehicle_type, name):
    log.heartbeat(0, mode=15, vehicle_type=vehicle_type, autopilot=3)
    [vehicle] = survey(log.contents()).senders
    assert vehicle.modes == (ModeSpan(0, 0, name),)


def test_silence_of_two_seconds_is_a_gap(log):
    for second in (0, 1, 2.9, 4.9, 5, 9):
        log.heartbeat(second)
        log.heartbeat(second / 10, sender=(2, 1))
    year_s = 365 * 86_400.0
    log.heartbeat(year_s)
    first, second = survey(log.contents()).senders
    assert first.gaps == (Gap(2.9, 4.9), Gap(5.0, 9.0), Gap(9.0, year_s))
    assert second.gaps == ()


def test_flights_are_numbered_over_all_vehicles_and_messages_counted(log):
    for second in range(10):
        log.heartbeat(second, armed=second in (1, 2, 7))
        log.heartbeat(second, armed=second == 4, sender=(2, 1))
    result = survey(log.contents())
    assert result.flights() == (
        Flight(1, (1, 1), ArmedSpan(1, 3)),
        Flight(2, (2, 1), ArmedSpan(4, 5)),
        Flight(3, (1, 1), ArmedSpan(7, 8)),
    )
    assert result.messages() == {"HEARTBEAT": 20}
    assert result.to_json()["armed_spans"][1] == {"flight": 2, "system": 2, "component": 1, "from_s": 4.0, "to_s": 5.0}


def test_a_file_is_surveyed_in_pieces_as_a_whole_in_memory(log, tmp_path, monkeypatch):
    for second in range(40):
        log.heartbeat(
            second if second < 20 else second + 5 - 30 * (second == 30), armed=second % 7 > 3, mode=second // 5
        )
        log.local(second, (1, 2, 3), (0, 0, 0), sender=(1 + second % 3, 1))
    (tmp_path / "a.tlog").write_bytes(log.data())
    monkeypatch.setattr("mavquad.tlog.source.PIECE", 100)
    assert survey_file(tmp_path / "a.tlog") == survey(log.contents())


def test_a_part_of_a_file_keeps_the_time_of_the_whole(log, tmp_path):
    for second in range(20):
        log.heartbeat(second, armed=second > 12, sender=(1 + second % 2, 1))
    (tmp_path / "a.tlog").write_bytes(log.data())
    whole = survey(log.contents())
    part = survey_file(tmp_path / "a.tlog", Selection(system=2, from_us=whole.first_stamp_us + 10_000_000))
    assert (part.frames, part.first_stamp_us, part.duration_s) == (5, whole.first_stamp_us, 19.0)
    assert [sender.sender for sender in part.senders] == [(2, 1)]
    assert part.senders[0].armed_spans == (ArmedSpan(13.0, 19.0),)


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
