"""Missions of the ArduCopter personality: upload, download, AUTO."""

from __future__ import annotations

import pytest

from mavquad.protocol.codec import mavlink

HOME = (-353632620, 1491652370)
NORTH, EAST = (HOME[0] + 900, HOME[1]), (HOME[0] + 900, HOME[1] + 1100)
TO_HOME = (16, 0, 0, *HOME, 584.0)
UP = (22, 3, 0, 0, 0, 8.0)
PLAN = [TO_HOME, UP, (178, 3, 0, 0, 0, 0.0), (16, 3, 0, *NORTH, 8.0), (16, 3, 2, *EAST, 8.0), (20, 3, 0, 0, 0, 0.0)]


def upload(vehicle, plan):
    answers = vehicle.send(mavlink.MAVLink_mission_count_message(1, 1, len(plan), 0))
    while answers and answers[-1].get_type().startswith("MISSION_REQUEST"):
        index = answers[-1].seq
        command, frame, p1, x, y, z = plan[index]
        answers = vehicle.send(
            mavlink.MAVLink_mission_item_int_message(1, 1, index, frame, command, 0, 1, p1, 0, 0, 0, x, y, z, 0)
        )
    return [a.type for a in answers if a.get_type() == "MISSION_ACK"]


def test_a_mission_is_flown(copter):
    vehicle = copter().run(1.1)
    assert upload(vehicle, PLAN) == [0]
    assert "Flight plan received" in vehicle.texts()
    vehicle.arm()
    assert vehicle.mode(3) == [0]
    vehicle.run(90.0)
    assert [m.seq for m in vehicle.messages("MISSION_ITEM_REACHED")] == [2, 3, 4, 5]
    assert vehicle.texts()[:9] == [
        "Mission: 1 Takeoff",
        "EKF3 IMU0 MAG0 in-flight yaw alignment complete",
        "EKF3 IMU1 MAG0 in-flight yaw alignment complete",
        "Mission: 2 ChangeSpeed",
        "Mission: 3 WP",
        "Reached command #3",
        "Mission: 4 WP",
        "Reached command #4",
        "Mission: 5 RTL",
    ]
    assert not vehicle.truth.armed
    assert vehicle.truth.position_ned_m == pytest.approx((0.0, 0.0, 0.0), abs=0.5)


def test_from_guided_in_the_air_it_flies_to_its_end_and_stays(copter):
    vehicle = copter().hover()
    assert upload(vehicle, [TO_HOME, (16, 3, 0, *NORTH, 12.0)]) == [0]
    assert vehicle.command(300) == [0]
    assert vehicle.mock.mode == "AUTO"
    vehicle.run(20.0)
    assert vehicle.truth.position_ned_m == pytest.approx((10.0, 0.0, -12.0), abs=2.5)
    assert abs(vehicle.truth.velocity_ned_m_s[0]) < 0.2


def test_a_landing_at_its_end(copter):
    vehicle = copter().hover()
    upload(vehicle, [TO_HOME, (21, 3, 0, *NORTH, 0.0)])
    vehicle.mode(3)
    vehicle.run(60.0)
    assert not vehicle.truth.armed
    assert vehicle.truth.position_ned_m == pytest.approx((10.0, 0.0, 0.0), abs=0.6)


def test_without_a_mission_or_a_takeoff_it_is_refused(copter):
    vehicle = copter().hover()
    assert vehicle.mode(3) == [4]
    assert vehicle.texts() == ["Mode change to AUTO failed: init failed"]
    grounded = copter().arm()
    upload(grounded, [TO_HOME, (16, 3, 0, *NORTH, 12.0)])
    assert grounded.mode(3) == [4]
    assert "Auto: Missing Takeoff Cmd" in grounded.texts()
    assert grounded.command(300) == [4]


def test_disarmed_it_can_be_started_and_nothing_moves(copter):
    """As the real one."""
    vehicle = copter().run(1.1)
    assert vehicle.command(300) == [0]
    assert vehicle.mock.mode == "AUTO"
    upload(vehicle, PLAN)
    assert vehicle.command(300) == [0]
    assert "Mission: 1 Takeoff" in vehicle.texts()
    assert vehicle.command(400, 1) == [4]
    assert "Arm: AUTO mode not armable" in vehicle.texts()


def state(vehicle):
    vehicle.command(512, 42)
    message = vehicle.messages("MISSION_CURRENT")[-1]
    return message.seq, message.total, message.mission_state, message.mission_mode


def test_mission_current_tells_the_state(copter):
    vehicle = copter().hover()
    assert state(vehicle) == (0, 0, mavlink.MISSION_STATE_NO_MISSION, 0)
    upload(vehicle, [TO_HOME, (16, 3, 0, *NORTH, 12.0)])
    assert state(vehicle) == (0, 1, mavlink.MISSION_STATE_NOT_STARTED, 0)
    vehicle.mode(3)
    assert state(vehicle) == (1, 1, mavlink.MISSION_STATE_ACTIVE, 1)
    assert vehicle.command(193, 0) == [0]
    assert state(vehicle) == (1, 1, mavlink.MISSION_STATE_PAUSED, 1)
    where = vehicle.run(5.0).truth.position_ned_m
    assert vehicle.run(2.0).truth.position_ned_m == pytest.approx(where, abs=0.3)
    assert vehicle.command(193, 1) == [0]
    vehicle.run(20.0)
    assert state(vehicle) == (1, 1, mavlink.MISSION_STATE_COMPLETE, 1)


def test_another_item_is_taken_up_at_once(copter):
    vehicle = copter().hover()
    upload(vehicle, PLAN)
    vehicle.mode(3)
    vehicle.run(1.0).forget()
    assert vehicle.command(224, 4) == [0]
    vehicle.run(0.1)
    assert vehicle.texts() == ["Mission: 4 WP"]
    assert vehicle.command(224, 9) == [4]
    vehicle.run(20.0)
    assert "Reached command #4" in vehicle.texts()


def test_a_leg_takes_the_time_that_the_real_one_takes(copter):
    """20 m from rest to rest took 6.9 s to the waypoint's end on the real one, at 4.3 m/s at most."""
    vehicle = copter().hover()
    height_m = -vehicle.truth.position_ned_m[2]
    there = (HOME[0] + 1797, HOME[1], height_m)
    upload(vehicle, [TO_HOME, (16, 3, 0, *there)])
    vehicle.mode(3)
    speeds = [vehicle.run(0.1).truth.velocity_ned_m_s[0] for _ in range(120)]
    assert max(speeds) == pytest.approx(4.5, abs=0.4)
    moving_s = sum(speed > 0.3 for speed in speeds) / 10
    assert moving_s == pytest.approx(7.5, abs=1.0)


def test_the_kinds_with_floats_are_taken_with_a_hint(copter):
    vehicle = copter().run(1.1)
    vehicle.send(mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    for index in range(2):
        vehicle.send(mavlink.MAVLink_mission_item_message(1, 1, index, 3, 16, 0, 1, 0, 0, 0, 0, -35.36, 149.16, 9.0))
    assert vehicle.messages("MISSION_ACK")[-1].type == 0
    assert vehicle.texts().count("got MISSION_ITEM; GCS should send MISSION_ITEM_INT") == 1


def test_any_item_can_be_asked_for_and_an_upload_ends_a_download(copter):
    vehicle = copter().run(1.1)
    upload(vehicle, PLAN)
    vehicle.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    [item] = vehicle.send(mavlink.MAVLink_mission_request_int_message(1, 1, 3, 0))
    assert (item.seq, item.x) == (3, NORTH[0])
    [ack] = vehicle.send(mavlink.MAVLink_mission_request_int_message(1, 1, 9, 0))
    assert ack.type == mavlink.MAV_MISSION_INVALID_SEQUENCE
    assert upload(vehicle, PLAN) == [0]


def test_an_item_that_it_cannot_fly_is_refused(copter):
    vehicle = copter().run(1.1)
    assert upload(vehicle, [TO_HOME, UP, (189, 3, 0, 0, 0, 0.0)]) == [mavlink.MAV_MISSION_UNSUPPORTED]
    vehicle.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert vehicle.messages("MISSION_COUNT")[-1].count == 0


def test_it_can_be_read_back_with_home_first(copter):
    vehicle = copter().run(1.1)
    upload(vehicle, PLAN)
    vehicle.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert vehicle.messages("MISSION_COUNT")[-1].count == len(PLAN)
    items = []
    for index in range(len(PLAN)):
        items += vehicle.send(mavlink.MAVLink_mission_request_int_message(1, 1, index, 0))
    read = [(m.command, m.x, m.y) for m in items if m.get_type() == "MISSION_ITEM_INT"]
    assert read == [(item[0], *item[3:5]) for item in PLAN]


def test_a_fence_is_not_taken(copter):
    vehicle = copter().run(1.1)
    answers = vehicle.send(mavlink.MAVLink_mission_count_message(1, 1, 4, 1))
    assert [a.type for a in answers if a.get_type() == "MISSION_ACK"] == [mavlink.MAV_MISSION_NO_SPACE]


def test_going_to_an_item(copter):
    vehicle = copter().hover()
    upload(vehicle, PLAN)
    vehicle.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    assert vehicle.messages("MISSION_CURRENT")[-1].seq == 4
    vehicle.mode(3)
    vehicle.run(1.0)
    assert "Mission: 4 WP" in vehicle.texts()


def go(vehicle, current, x, y, z):
    answers = vehicle.send(mavlink.MAVLink_mission_item_message(0, 0, 0, 3, 16, current, 0, 0, 0, 0, 0, x, y, z))
    return [a.type for a in answers if a.get_type() == "MISSION_ACK"]


def test_an_item_with_current_2_is_a_place_to_go_to(copter):
    """As dronekit's simple_goto sends it."""
    vehicle = copter().hover()
    assert go(vehicle, 2, NORTH[0] / 1e7, NORTH[1] / 1e7, 12.0) == [0]
    assert vehicle.run(12.0).truth.position_ned_m == pytest.approx((10.0, 0.0, -12.0), abs=1.5)
    assert go(vehicle, 3, 0.0, 0.0, 9.0) == [0]
    assert vehicle.run(12.0).truth.position_ned_m == pytest.approx((10.0, 0.0, -9.0), abs=1.5)
    assert go(vehicle, 2, float("nan"), 0.0, 9.0) == [1]
    vehicle.mode(5)
    assert go(vehicle, 2, 0.0, 0.0, 9.0) == [1]
    assert vehicle.messages("MISSION_REQUEST") == []
