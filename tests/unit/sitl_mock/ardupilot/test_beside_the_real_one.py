"""What the real ArduCopter 4.7 did in flights flown beside the mock's, beyond the recordings."""

from __future__ import annotations

import pytest

from mavquad.protocol.codec import mavlink


def test_a_return_from_near_home_does_not_climb_to_rtl_alt(copter):
    """RTL_CONE_SLOPE: within a few metres of home the height is kept."""
    vehicle = copter().hover()
    height_m = -vehicle.truth.position_ned_m[2]
    vehicle.mode(6)
    heights = [-vehicle.run(0.5).truth.position_ned_m[2] for _ in range(20)]
    assert max(heights) < height_m + 1.0


def test_landing_on_the_ground_disarms_at_once(copter):
    vehicle = copter().arm()
    vehicle.mode(9)
    vehicle.run(0.3)
    assert not vehicle.truth.armed


def test_a_lost_ground_station_keeps_it_from_arming(copter):
    vehicle = copter().run(1.1)
    vehicle.mode(4)
    vehicle.set("FS_GCS_ENABLE", 1.0)
    vehicle.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    vehicle.run(7.0).forget()
    assert vehicle.command(400, 1) == [4]
    assert vehicle.texts() == ["Arm: GCS failsafe on"]


def test_condition_yaw_turns_at_its_rate(copter):
    vehicle = copter().hover()
    assert vehicle.command(115, 90, 20, 1, 0) == [0]
    vehicle.run(2.5)
    vehicle.command(512, mavlink.MAVLINK_MSG_ID_ATTITUDE)
    assert vehicle.messages("ATTITUDE")[-1].yaw == pytest.approx(0.87, abs=0.2)


def test_a_reposition_is_taken_as_command_int_alone(copter):
    assert copter().hover().command(192, -1, 1, 0, 0, -35.3630, 149.1652, 12) == [mavlink.MAV_RESULT_UNSUPPORTED]


def test_modes_that_cannot_be_begun_say_what_the_real_one_says(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    assert [vehicle.mode(number) for number in (14, 23, 26)] == [[4]] * 3
    assert vehicle.texts() == [
        "Mode change to FLIP failed: init failed",
        "Set FOLL_ENABLE = 1",
        "Mode change to FOLLOW failed: init failed",
        "No such mode 26",
    ]
