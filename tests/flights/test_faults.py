"""Flights on which something goes wrong: how they end, and that the vehicle ends safe."""

import pytest

from tests.flights.depths import landed_safely
from tests.support import fly

IN_FLIGHT = {"since": "offboard", "from_s": 4.0}


def test_arming_refused() -> None:
    flight = fly(faults=[{"kind": "refuse", "command": 400, "result": 1, "text": "Arming denied: no hat"}])
    assert flight.exit_code == 3
    assert "arm (TEMPORARILY_REJECTED)" in str(flight.agent.error)
    assert "Arming denied: no hat" in str(flight.agent.error)
    assert flight.agent.status().setpoints_sent == 0
    assert landed_safely(flight)


def test_takeoff_refused_disarms_again() -> None:
    flight = fly(faults=[{"kind": "refuse", "command": 22}])
    assert flight.exit_code == 3
    assert "take off (DENIED)" in str(flight.agent.error)
    assert landed_safely(flight)


def test_offboard_refused_lands() -> None:
    # The first mode change in the air is the one to OFFBOARD.
    flight = fly(faults=[{"kind": "refuse", "command": 176, "result": 1, "times": 1, "since": "takeoff"}])
    assert flight.exit_code == 3
    assert "mode OFFBOARD (TEMPORARILY_REJECTED)" in str(flight.agent.error)
    assert landed_safely(flight)


def test_offboard_acknowledged_but_not_entered() -> None:
    flight = fly(faults=[{"kind": "ack_without_acting", "command": 176, "times": 1, "since": "takeoff"}])
    assert flight.exit_code == 3
    assert "acknowledged ACCEPTED, but HEARTBEAT stays in AUTO.LOITER" in str(flight.agent.error)
    assert landed_safely(flight)


def test_the_exception_for_a_px4_without_a_transmitter_is_made_for_the_flight() -> None:
    flight = fly({"mock.com_rcl_except": 0, "mission.name": '"hover"', "mission.duration_s": 1.0})
    assert flight.exit_code == 0
    assert {record.name for record in flight.agent.changed_parameters.parameters} >= {"COM_RCL_EXCEPT"}
    assert flight.agent.changed_parameters.restored


def test_px4_without_a_transmitter_and_without_its_exception() -> None:
    flight = fly({"mock.com_rcl_except": 0, "parameters.px4": "{}"})
    assert flight.exit_code == 3
    assert "No manual control stick input" in str(flight.agent.error)
    assert "COM_RCL_EXCEPT is 0" in flight.agent.error.hint


@pytest.mark.parametrize("firmware", ["1.15", "1.16"])
def test_torque_asked_of_a_later_px4_is_refused_on_the_ground(firmware: str) -> None:
    flight = fly({"mock.firmware": f'"{firmware}"', "law.depth": '"torque"'})
    assert flight.exit_code == 3
    assert f"PX4 {firmware}" in str(flight.agent.error)
    assert "--depth rate" in flight.agent.error.hint
    assert not any(note.text == "arming" for note in flight.notes)


@pytest.mark.parametrize("message", ["LOCAL_POSITION_NED", "ATTITUDE"])
def test_pose_stream_stops_for_a_second(message: str) -> None:
    flight = fly(faults=[{"kind": "stream_stops", "message": message, "for_s": 1.0, **IN_FLIGHT}])
    assert flight.exit_code == 4
    assert "stale pose" in str(flight.agent.error)
    assert message in str(flight.agent.error)
    assert flight.agent.status().safe_setpoints >= 1
    assert landed_safely(flight)


def test_nan_in_a_pose() -> None:
    flight = fly(faults=[{"kind": "nan_pose", "for_s": 0.2, **IN_FLIGHT}])
    assert flight.exit_code == 4
    assert "LOCAL_POSITION_NED holds a value that is not a number" in str(flight.agent.error)
    assert flight.agent.status().safe_setpoints >= 1
    assert landed_safely(flight)


def test_vehicle_dies_in_flight() -> None:
    flight = fly(faults=[{"kind": "die", "since": "offboard", "at_s": 4.0}])
    assert flight.exit_code == 4
    assert flight.agent.done
    assert "stale pose" in flight.agent.error.message
    assert "then lost in flight" in flight.agent.error.message
    assert "check the link" in flight.agent.error.hint


def test_vehicle_dies_on_the_ground() -> None:
    flight = fly(faults=[{"kind": "die", "at_s": 0.5}])
    assert flight.exit_code == 3
    assert flight.agent.status().setpoints_sent == 0


def test_link_is_silent_for_a_while_in_flight() -> None:
    flight = fly(faults=[{"kind": "silent", "for_s": 1.5, **IN_FLIGHT}])
    assert flight.exit_code == 4
    assert flight.agent.error.message.startswith("guard 'stale pose': no ATTITUDE for ")
    assert flight.agent.status().safe_setpoints >= 1
    assert landed_safely(flight)


def test_pilot_takes_over_and_is_left_alone() -> None:
    flight = fly(faults=[{"kind": "mode_change", "since": "offboard", "at_s": 5.0, "mode": "POSCTL"}])
    assert flight.exit_code == 4
    assert "POSCTL" in str(flight.agent.error)
    assert flight.agent.status().safe_setpoints == 0
    taken_over_us = next(note.stamp_us for note in flight.notes if note.kind == "error")
    assert not any(r.stamp_us >= taken_over_us for r in flight.recording.records if r.outbound)


def test_tilt_guard() -> None:
    # A wind of 5 m/s leans the hovering vehicle by 27 degrees.
    flight = fly({"guards.tilt_deg": 20.0, "law.limits.tilt_max_deg": 15.0, "mock.wind_ned_m_s": [5.0, 0.0, 0.0]})
    assert flight.exit_code == 4
    assert "guard 'tilt'" in str(flight.agent.error)
    assert landed_safely(flight)


def test_volume_guard() -> None:
    # 5.5 N of drag on 6.9 N of weight: PX4 holds its place with 39 degrees of tilt, the law cannot with 30.
    wind = {"mock.wind_ned_m_s": [5.5, 0.0, 0.0], "mock.vehicle.mass_kg": 0.7, "law.limits.tilt_max_deg": 30.0}
    flight = fly({**wind, "mission.name": '"hover"', "guards.radius_m": 2.0})
    assert flight.exit_code == 4
    assert "guard 'volume'" in str(flight.agent.error)
    assert flight.agent.status().safe_setpoints >= 1
    assert landed_safely(flight)


def test_a_mission_that_leads_out_of_the_volume_is_not_taken_over() -> None:
    flight = fly({"guards.ceiling_m": 2.0})
    assert flight.exit_code == 4
    assert "the law does not take over" in str(flight.agent.error)
    assert flight.agent.status().setpoints_sent == 0
    assert landed_safely(flight)


@pytest.mark.parametrize("kind", ["nan_pose", "silent"])
def test_a_flight_that_a_guard_ended_replays(kind: str) -> None:
    flight = fly(faults=[{"kind": kind, "for_s": 0.5, **IN_FLIGHT}])
    result = flight.replayed()
    assert result.equal
    assert result.recorded > 500


def test_a_lossy_flight_replays() -> None:
    flight = fly({"law.depth": '"rate"', "mock.link.loss": 0.1, "mock.link.jitter_ms": 20.0, "seed": 5})
    result = flight.replayed()
    assert result.equal
    assert result.matched == result.recorded > 2000
