"""Entering the offboard mode: the ACK is not believed, HEARTBEAT is; every failure leaves by the front door."""

from __future__ import annotations

from itertools import pairwise

import pytest

from mavquad.agent_params import SETPOINTS_BEFORE_OFFBOARD
from mavquad.errors import VehicleRefused
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import px4
from tests.dialogues.peer import (
    ACCEPTED,
    REJECTED,
    SETPOINT,
    Dialogue,
    ScriptedVehicle,
    answer,
    at_depth,
    heartbeat,
    silent,
)


def refused_and_landed(dialogue):
    assert dialogue.phases[-5:] == ["engaging", "handing back", "landing", "restoring", "done"]
    assert dialogue.names()[-3:] == ["loiter", SETPOINT, "land"]
    assert isinstance(dialogue.agent.error, VehicleRefused)
    assert dialogue.agent.error.exit_code == 3
    assert dialogue.agent.error.request == "mode OFFBOARD"
    assert "COM_RCL_EXCEPT" in dialogue.agent.error.hint or "told to land" in dialogue.agent.error.hint
    assert not dialogue.vehicle.armed
    return dialogue.agent.error


def test_offboard_is_asked_for_after_a_run_of_setpoints():
    dialogue = Dialogue().until_sent("offboard")
    before = dialogue.of(SETPOINT)
    assert len(before) == SETPOINTS_BEFORE_OFFBOARD == 20
    assert before[-1].stamp_us == dialogue.of("offboard")[0].stamp_us
    assert {sent.phase for sent in before} == {Phase.ENGAGING}


def test_offboard_rejected():
    error = refused_and_landed(Dialogue(ScriptedVehicle(answers={"offboard": answer(REJECTED)})).run())
    assert error.result == "TEMPORARILY_REJECTED"


def test_offboard_accepted_then_taken_back():
    vehicle = ScriptedVehicle(answers={"offboard": answer(ACCEPTED, REJECTED, text="Switching is not available")})
    error = refused_and_landed(Dialogue(vehicle).run())
    assert error.result == "TEMPORARILY_REJECTED"
    assert "Switching is not available" in error.message


def test_offboard_accepted_but_heartbeat_stays():
    error = refused_and_landed(Dialogue(ScriptedVehicle(answers={"offboard": answer(ACCEPTED)})).run())
    assert error.result == "acknowledged ACCEPTED, but HEARTBEAT stays in AUTO.LOITER"


def test_offboard_not_acknowledged_and_heartbeat_stays():
    dialogue = Dialogue(ScriptedVehicle(answers={"offboard": silent})).run()
    error = refused_and_landed(dialogue)
    assert error.result == "no ACK, but HEARTBEAT stays in AUTO.LOITER"
    assert [sent.message.confirmation for sent in dialogue.of("offboard")][:3] == [0, 1, 2]


def test_offboard_without_ack_is_seen_in_heartbeat():
    def switch(vehicle):
        vehicle.mode = px4.OFFBOARD

    dialogue = Dialogue(ScriptedVehicle(answers={"offboard": switch})).run(Phase.FLYING)
    asked = len(dialogue.of("offboard"))
    dialogue.run()
    assert dialogue.agent.error is None
    assert len(dialogue.of("offboard")) == asked


def test_offboard_before_the_first_setpoint_is_taken_up_at_the_next_heartbeat():
    """Somebody chose it in the moment between the hover's end and the law's first step."""
    dialogue = Dialogue().run(Phase.ENGAGING)
    assert dialogue.of(SETPOINT) == []
    dialogue.vehicle.mode = px4.OFFBOARD
    dialogue.deliver(heartbeat(mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, px4.OFFBOARD, armed=True))
    assert dialogue.agent.phase is Phase.ENGAGING
    dialogue.run(Phase.FLYING, 1.1)
    assert dialogue.run().agent.error is None


def test_a_request_for_offboard_is_not_repeated_after_a_stop():
    dialogue = Dialogue(ScriptedVehicle(answers={"offboard": silent})).until_sent("offboard")
    asked = len(dialogue.of("offboard"))
    dialogue.stop()
    dialogue.run()
    assert len(dialogue.of("offboard")) == asked


@pytest.mark.parametrize("results", [(ACCEPTED,), (ACCEPTED, ACCEPTED)])
def test_a_second_acceptance_changes_nothing(results):
    def switch(vehicle):
        vehicle.mode = px4.OFFBOARD
        for result in results:
            vehicle.ack(result)

    dialogue = Dialogue(ScriptedVehicle(answers={"offboard": switch})).run()
    assert dialogue.agent.error is None


def test_setpoints_flow_at_the_rate_of_the_poses_until_the_release():
    dialogue = Dialogue().run()
    stamps = [sent.stamp_us for sent in dialogue.of(SETPOINT)]
    assert max(b - a for a, b in pairwise(stamps)) <= 10_100
    phases = [sent.phase for sent in dialogue.of(SETPOINT)]
    assert set(phases) == {Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK}
    assert len(phases) == dialogue.agent.status().setpoints_sent


def test_a_hand_back_that_is_refused_lands_all_the_same():
    dialogue = Dialogue(ScriptedVehicle(answers={"loiter": answer(REJECTED)})).run()
    assert dialogue.phases[-5:] == ["flying", "handing back", "landing", "restoring", "done"]
    assert dialogue.agent.error.request == "mode AUTO.LOITER"
    assert dialogue.agent.error.exit_code == 3


def test_a_hand_back_is_believed_when_heartbeat_shows_it():
    dialogue = Dialogue(ScriptedVehicle(answers={"loiter": answer(ACCEPTED)})).run()
    assert "mode AUTO.LOITER (waited 5.0 s)" in dialogue.agent.error.message
    assert dialogue.names()[-4:] == ["loiter", SETPOINT, "land", SETPOINT]
    assert len([sent for sent in dialogue.of(SETPOINT) if sent.phase is Phase.HANDING_BACK]) > 400
    safe = [sent for sent in dialogue.of(SETPOINT) if sent.phase is Phase.LANDING]
    assert 10 <= len(safe) == dialogue.agent.status().safe_setpoints


def test_a_hand_back_that_is_not_answered_lands_all_the_same():
    dialogue = Dialogue(ScriptedVehicle(answers={"loiter": silent})).run()
    assert len(dialogue.of("loiter")) > 10
    assert dialogue.names()[-2:] == ["land", SETPOINT]
    assert dialogue.agent.error.exit_code == 3


def test_a_vehicle_that_stays_armed_on_the_ground_is_disarmed():
    vehicle = ScriptedVehicle()
    dialogue = Dialogue(vehicle).run(Phase.LANDING)
    vehicle.on_ground_us = -1_000_000_000
    dialogue.run(Phase.DISARMING)
    assert dialogue.names()[-1] == "disarm"
    dialogue.run()
    assert dialogue.agent.error is None


def test_the_hover_thrust_is_learned_from_the_autopilots_own():
    dialogue = Dialogue(ScriptedVehicle(thrust=0.55)).run(Phase.FLYING)
    assert dialogue.agent.status().hover_thrust_norm == pytest.approx(0.55, abs=1e-6)
    assert dialogue.of(SETPOINT)[0].message.controls[3] == pytest.approx(0.55, abs=1e-4)


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_from_its_ack_on_setpoints_are_believed_to_act_while_attitude_target_pauses(depth):
    dialogue = at_depth(depth).until_sent("offboard")
    assert not dialogue.agent.law.in_control
    dialogue.vehicle.muted |= {"ATTITUDE_TARGET", "HEARTBEAT"}
    dialogue.run_for(0.5)
    assert dialogue.phases[-1] == "engaging"
    assert dialogue.agent.law.in_control


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_an_ack_is_believed_no_longer_when_attitude_target_shows_another_command(depth):
    dialogue = at_depth(depth, answers={"offboard": answer(ACCEPTED)}).until_sent("offboard").run_for(0.1)
    dialogue.vehicle.east_m += 0.5  # what is sent is not what the vehicle shows
    assert dialogue.agent.law.in_control
    dialogue.run_for(0.2)
    assert dialogue.phases[-1] == "engaging"
    assert not dialogue.agent.law.in_control
    assert dialogue.agent.law.watches


def test_an_ack_that_is_taken_back_is_believed_no_longer():
    dialogue = at_depth("rate", answers={"offboard": answer(ACCEPTED, REJECTED)}).until_sent("offboard").run_for(0.05)
    assert dialogue.phases[-1] == "engaging"
    assert not dialogue.agent.law.in_control
