"""Two flights as a user of the mock tests them: pymavlink talks, virtual time passes, the truth is asserted."""

import math

import pytest
from pymavlink.dialects.v20 import common as mavlink

SQUARE_NED_M = [(5.0, 0.0, -5.0), (5.0, 5.0, -5.0), (0.0, 5.0, -5.0), (0.0, 0.0, -5.0)]
POSITION_ONLY = 0xDF8


def go_to(connection, north_m, east_m, down_m):
    frame = mavlink.MAV_FRAME_LOCAL_NED
    connection.mav.set_position_target_local_ned_send(
        0, 1, 1, frame, POSITION_ONLY, north_m, east_m, down_m, 0, 0, 0, 0, 0, 0, 0, 0
    )


def take_off(connection, height_m):
    connection.mav.command_long_send(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, math.nan, 0, 0, height_m)


def is_at(place_ned_m):
    return lambda truth: math.dist(truth.position_ned_m, place_ned_m) < 0.5


@pytest.mark.mock_vehicle(autopilot="ardupilot", wind=(3.0, 0.0, 0.0))
def test_a_square_in_guided(mock_vehicle):
    connection = mock_vehicle.connect()
    connection.wait_heartbeat()
    mock_vehicle.run(5.0)
    connection.set_mode("GUIDED")
    connection.arducopter_arm()
    connection.motors_armed_wait()
    take_off(connection, height_m=5.0)
    mock_vehicle.run_until(is_at((0.0, 0.0, -5.0)), limit_s=30.0)

    for corner_ned_m in SQUARE_NED_M:
        go_to(connection, *corner_ned_m)
        mock_vehicle.run_until(is_at(corner_ned_m), limit_s=30.0)

    connection.set_mode("LAND")
    connection.motors_disarmed_wait()
    assert mock_vehicle.truth.landed
    assert not mock_vehicle.truth.crashed


@pytest.mark.mock_vehicle(autopilot="px4", firmware="1.16", faults=[{"kind": "drop", "probability": 0.05}])
def test_a_square_in_offboard_over_a_poor_link(mock_vehicle):
    connection = mock_vehicle.connect()
    connection.wait_heartbeat()
    mock_vehicle.run(5.0)
    connection.arducopter_arm()
    connection.motors_armed_wait()
    setpoint_ned_m = [0.0, 0.0, -5.0]
    mock_vehicle.every(0.1, lambda: go_to(connection, *setpoint_ned_m))
    connection.set_mode("OFFBOARD")

    for corner_ned_m in SQUARE_NED_M:
        setpoint_ned_m[:] = corner_ned_m
        mock_vehicle.run_until(is_at(corner_ned_m), limit_s=30.0)

    assert mock_vehicle.truth.mode == "OFFBOARD"
    connection.set_mode("LAND")
    connection.motors_disarmed_wait()
    assert mock_vehicle.truth.landed
    assert not mock_vehicle.truth.crashed
