"""Finding, identifying and arming a vehicle: who is refused, with which words, and that nothing was armed meanwhile."""

from __future__ import annotations

import re

import pytest

from mavquad.errors import VehicleRefused, VehicleTimeout
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.protocol.firmware import px4
from mavquad.protocol.link import LinkParams
from tests.dialogues.peer import (
    ACCEPTED,
    PARAMS,
    POSCTL,
    SETPOINTS,
    START_US,
    Dialogue,
    ScriptedVehicle,
    answer,
    heartbeat,
    silent,
    with_law,
)

DENIED = mavlink.MAV_RESULT_DENIED
FLYING_COMMANDS = {"arm", "takeoff", "offboard", "loiter", "land", *SETPOINTS.values()}


def nothing_flown(dialogue):
    return not FLYING_COMMANDS & set(dialogue.names())


def test_a_whole_flight_in_its_order():
    dialogue = Dialogue().run()
    setpoint = "SET_ACTUATOR_CONTROL_TARGET"
    assert dialogue.names() == ["arm", "takeoff", setpoint, "offboard", setpoint, "loiter", setpoint, "land"]
    in_order = [phase.value for phase in Phase if phase is not Phase.DISARMING]
    in_order.insert(in_order.index("arming"), "waiting")  # again, once it is known to take torques
    assert dialogue.phases == in_order
    assert dialogue.agent.error is None
    assert not dialogue.agent.interrupted
    assert dialogue.agent.status().safe_setpoints == 0


def test_the_streams_and_parameters_are_asked_for_once_when_all_is_answered():
    dialogue = Dialogue().run(Phase.WAITING)
    asked = [sent.message.param_id for sent in dialogue.of("PARAM_REQUEST_READ")]
    assert asked == ["MIS_TAKEOFF_ALT", "MPC_THR_HOVER", "COM_RCL_EXCEPT"]
    intervals = {int(sent.message.param1): sent.message.param2 for sent in dialogue.of("interval")}
    assert intervals[mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED] == 10_000.0
    assert intervals[mavlink.MAVLINK_MSG_ID_ATTITUDE] == 10_000.0
    assert len(dialogue.of("interval")) == len(intervals)
    assert len(dialogue.of("request")) == 1


def test_a_listener_that_nobody_calls_says_nothing_and_gives_up():
    dialogue = Dialogue()
    dialogue.powered = False
    dialogue.run()
    assert dialogue.sent == []
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert dialogue.agent.error.exit_code == 3
    assert "HEARTBEAT of an autopilot (waited 10.0 s)" in dialogue.agent.error.message


def test_a_caller_that_nobody_answers_sends_heartbeats_and_gives_up():
    params = PARAMS.model_copy(update={"link": LinkParams(url="udpout:127.0.0.1:14580")})
    dialogue = Dialogue(params=params)
    dialogue.powered = False
    dialogue.run()
    assert [sent.name for sent in dialogue.sent] == ["HEARTBEAT"] * len(dialogue.sent)
    # The deadline at 10 s is the phase's as well as a heartbeat's.
    assert [sent.stamp_us - START_US for sent in dialogue.sent] == [i * 1_000_000 for i in range(11)]
    assert dialogue.agent.error.exit_code == 3


def test_nothing_is_sent_once_it_has_given_up():
    dialogue = Dialogue()
    dialogue.powered = False
    dialogue.run()
    dialogue.deliver(heartbeat(mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR))
    assert dialogue.sent == []


def test_ground_stations_and_companions_are_no_vehicle():
    dialogue = Dialogue()
    dialogue.powered = False
    invalid = mavlink.MAV_AUTOPILOT_INVALID
    for _ in range(9):
        dialogue.deliver(heartbeat(invalid, mavlink.MAV_TYPE_GCS), sender=Encoder(255, 190))
        dialogue.deliver(heartbeat(invalid, mavlink.MAV_TYPE_ONBOARD_CONTROLLER), sender=Encoder(1, 191))
        dialogue.run_for(1.0)
    assert dialogue.agent.phase is Phase.CONNECTING
    assert dialogue.agent.link.vehicle is None
    dialogue.run()
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert {sent.name for sent in dialogue.sent} == {"HEARTBEAT"}


@pytest.mark.parametrize(
    ("autopilot", "kind", "words"),
    [
        (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_FIXED_WING, "ARDUPILOTMEGA, the vehicle FIXED_WING"),
        (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_GROUND_ROVER, "PX4, the vehicle GROUND_ROVER"),
        (mavlink.MAV_AUTOPILOT_PPZ, mavlink.MAV_TYPE_QUADROTOR, "PPZ, the vehicle QUADROTOR"),
    ],
)
def test_what_is_no_multicopter_of_px4_or_ardupilot_is_refused_by_name(autopilot, kind, words):
    dialogue = Dialogue(ScriptedVehicle(autopilot=autopilot, kind=kind)).run()
    assert isinstance(dialogue.agent.error, VehicleRefused)
    assert dialogue.agent.error.exit_code == 3
    assert f"the autopilot is {words}" in dialogue.agent.error.message
    assert "PX4 and of ArduPilot" in dialogue.agent.error.hint
    assert nothing_flown(dialogue)


@pytest.mark.parametrize("version", [(1, 14, 0), (1, 16, 2)])
def test_torque_asked_of_a_release_that_ignores_it_is_refused_before_arming(version):
    dialogue = Dialogue(ScriptedVehicle(version=version), with_law(depth="torque")).run()
    error = dialogue.agent.error
    assert isinstance(error, VehicleRefused)
    assert error.exit_code == 3
    assert f"PX4 {'.'.join(map(str, version))} ignores torque setpoints silently" in error.message
    assert "--depth rate" in error.hint
    assert nothing_flown(dialogue)


@pytest.mark.parametrize(
    ("version", "depth"),
    [((1, 12, 0), "auto"), ((1, 13, 3), "auto"), ((1, 13, 3), "torque"), ((1, 14, 0), "auto"), ((1, 16, 2), "rate")],
)
def test_every_other_release_is_armed(version, depth):
    dialogue = Dialogue(ScriptedVehicle(version=version), with_law(depth=depth)).run(Phase.ARMING)
    assert dialogue.agent.status().version == version


def test_an_unknown_parameter_does_not_hold_up_the_flight():
    vehicle = ScriptedVehicle()
    del vehicle.parameters["COM_RCL_EXCEPT"]
    dialogue = Dialogue(vehicle).run(Phase.ARMING, 8.0)
    asked = [sent.message.param_id for sent in dialogue.of("PARAM_REQUEST_READ")]
    assert asked.count("COM_RCL_EXCEPT") == 12
    assert asked.count("MIS_TAKEOFF_ALT") == 1


def test_a_version_that_is_lost_behind_its_ack_is_asked_for_again():
    losses = iter([True])
    vehicle = ScriptedVehicle(lost=lambda m: m.get_type() == "AUTOPILOT_VERSION" and next(losses, False))
    dialogue = Dialogue(vehicle).run(Phase.ARMING, 6.0)
    assert len(dialogue.of("request")) in (2, 3)
    assert dialogue.agent.status().version == (1, 13, 3)


def test_a_vehicle_that_never_tells_its_version_is_not_flooded_and_not_flown():
    dialogue = Dialogue(ScriptedVehicle(muted={"AUTOPILOT_VERSION"})).run()
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert "version" in dialogue.agent.error.message
    assert len(dialogue.of("request")) < 60
    assert nothing_flown(dialogue)


def test_lost_requests_are_repeated_with_a_confirmation_that_counts():
    vehicle = ScriptedVehicle(answers={"request": silent})
    dialogue = Dialogue(vehicle).until_sent("request", 3)
    assert [sent.message.confirmation for sent in dialogue.of("request")] == [0, 1, 2]
    del vehicle.answers["request"]
    dialogue.run(Phase.ARMING)


def test_streams_that_are_too_slow_keep_it_on_the_ground():
    dialogue = Dialogue(ScriptedVehicle(attitude_ms=20, position_ms=20)).run()
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert dialogue.agent.error.exit_code == 3
    # A second's window holds 49 or 50 of them.
    for name in ("LOCAL_POSITION_NED", "ATTITUDE"):
        assert re.search(rf"\b{name} arrives at (49|50) Hz, 100 Hz asked", dialogue.agent.error.message)
    assert nothing_flown(dialogue)


def test_a_vehicle_whose_own_checks_fail_is_not_armed():
    dialogue = Dialogue(ScriptedVehicle(prearm=False)).run()
    assert "pre-arm checks have not passed" in dialogue.agent.error.message
    assert dialogue.agent.error.exit_code == 3
    assert nothing_flown(dialogue)


def test_a_vehicle_without_a_position_is_not_armed():
    dialogue = Dialogue(ScriptedVehicle(muted={"LOCAL_POSITION_NED"})).run()
    assert "no pose" in dialogue.agent.error.message
    assert nothing_flown(dialogue)


def test_arming_refused_carries_the_result_and_the_reason():
    vehicle = ScriptedVehicle(answers={"arm": answer(DENIED, text="Arming denied: health")})
    dialogue = Dialogue(vehicle).run()
    assert dialogue.phases[-3:] == ["arming", "restoring", "done"]
    error = dialogue.agent.error
    assert isinstance(error, VehicleRefused)
    assert (error.exit_code, error.request, error.result) == (3, "arm", "DENIED")
    assert error.statustext == "Arming denied: health"
    assert "Arming denied: health" in error.message
    assert dialogue.names() == ["arm"]


def test_the_reason_may_come_behind_the_ack_as_px4_sends_it():
    def refuse(vehicle):
        vehicle.ack(DENIED)
        vehicle.say(mavlink.MAVLink_statustext_message(2, b"Arming denied: health"))

    dialogue = Dialogue(ScriptedVehicle(answers={"arm": refuse})).run()
    assert dialogue.agent.error.statustext == "Arming denied: health"


def test_arming_acknowledged_but_never_done_is_taken_back():
    dialogue = Dialogue(ScriptedVehicle(answers={"arm": answer(ACCEPTED)})).run()
    assert dialogue.phases[-4:] == ["arming", "disarming", "restoring", "done"]
    assert dialogue.names() == ["arm", "disarm"]
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert dialogue.agent.error.exit_code == 3
    assert "the armed bit in HEARTBEAT (waited 5.0 s)" in dialogue.agent.error.message


def test_arming_is_repeated_until_it_is_answered():
    dialogue = Dialogue(ScriptedVehicle(answers={"arm": silent})).run()
    assert [sent.message.confirmation for sent in dialogue.of("arm")][:4] == [0, 1, 2, 3]
    assert dialogue.agent.error.exit_code == 3
    assert len(dialogue.of("disarm")) >= 1


def test_disarming_is_repeated_until_it_is_answered_although_heartbeat_says_disarmed():
    """The heartbeat may be from before a late arming."""
    dialogue = Dialogue(ScriptedVehicle(answers={"arm": answer(ACCEPTED), "disarm": silent})).run()
    assert dialogue.phases[-3:] == ["disarming", "restoring", "done"]
    assert len(dialogue.of("disarm")) > 10


def test_takeoff_refused_disarms():
    vehicle = ScriptedVehicle(answers={"takeoff": answer(DENIED, text="Takeoff denied")})
    dialogue = Dialogue(vehicle).run()
    assert dialogue.names() == ["arm", "takeoff", "disarm"]
    assert dialogue.phases[-4:] == ["taking off", "disarming", "restoring", "done"]
    error = dialogue.agent.error
    assert (error.exit_code, error.request, error.result, error.statustext) == (
        3,
        "take off",
        "DENIED",
        "Takeoff denied",
    )
    assert not vehicle.armed


@pytest.mark.parametrize("mode", [px4.LOITER, POSCTL])
def test_takeoff_that_goes_nowhere_lands(mode):
    dialogue = Dialogue(ScriptedVehicle(answers={"takeoff": answer(ACCEPTED)}, mode=mode)).run()
    assert dialogue.names() == ["arm", "takeoff", "land"]
    assert "hover at the takeoff altitude (waited 40.0 s)" in dialogue.agent.error.message
    assert dialogue.agent.error.exit_code == 3


def test_the_takeoff_altitude_is_the_vehicles_own():
    message = Dialogue().run(Phase.TAKING_OFF).of("takeoff")[0].message
    assert message.param7 != message.param7


def test_the_wanted_system_alone_is_taken():
    params = PARAMS.model_copy(update={"link": PARAMS.link.model_copy(update={"target_system": 7})})
    dialogue = Dialogue(params=params).run()
    assert isinstance(dialogue.agent.error, VehicleTimeout)
    assert dialogue.agent.link.vehicle is None


def test_a_px4_that_is_found_in_offboard_is_brought_out_of_it_before_it_is_armed():
    dialogue = Dialogue(ScriptedVehicle(mode=px4.OFFBOARD)).run(Phase.TAKING_OFF)
    assert dialogue.names()[:2] == ["loiter", "arm"]
