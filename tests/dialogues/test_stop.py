"""The operator stops: from every phase the flight ends as the table says, and it counts as interrupted."""

from __future__ import annotations

import pytest

from mavquad.flight.machine import Phase
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import px4
from tests.dialogues.peer import ACCEPTED, SETPOINT, Dialogue, ScriptedVehicle, answer, heartbeat

ENDINGS = {
    Phase.CONNECTING: ["done"],
    Phase.IDENTIFYING: ["done"],
    Phase.WAITING: ["restoring", "done"],
    Phase.PROBING: ["withdrawing", "restoring", "done"],
    Phase.WITHDRAWING: ["restoring", "done"],
    Phase.ARMING: ["disarming", "restoring", "done"],
    Phase.TAKING_OFF: ["landing", "restoring", "done"],
    Phase.ENGAGING: ["handing back", "landing", "restoring", "done"],
    Phase.FLYING: ["handing back", "landing", "restoring", "done"],
    Phase.HANDING_BACK: ["landing", "restoring", "done"],
    Phase.LANDING: ["restoring", "done"],
}


@pytest.mark.parametrize("phase", list(ENDINGS))
def test_stop_brings_it_down_from_every_phase(phase):
    dialogue = Dialogue().run(phase)
    before = len(dialogue.phases)
    dialogue.stop()
    dialogue.run()
    assert dialogue.phases[before:] == ENDINGS[phase]
    assert dialogue.agent.interrupted
    assert dialogue.agent.error is None
    assert not dialogue.vehicle.armed
    assert dialogue.vehicle.height_m == 0.0


def test_stop_while_disarming_goes_on_disarming():
    dialogue = Dialogue(ScriptedVehicle(answers={"arm": answer(ACCEPTED)})).run(Phase.DISARMING)
    dialogue.stop()
    assert dialogue.agent.phase is Phase.DISARMING
    dialogue.run()
    assert dialogue.agent.interrupted


def test_stop_in_flight_asks_for_the_hold_mode_at_once_and_flies_until_it_is_there():
    dialogue = Dialogue().run(Phase.FLYING).run_for(0.2)
    at = len(dialogue.sent)
    dialogue.stop()
    assert [sent.name for sent in dialogue.sent[at:]] == ["loiter"]
    dialogue.run(Phase.LANDING)
    setpoints = [sent for sent in dialogue.sent[at:] if sent.name == SETPOINT]
    assert len(setpoints) >= 10
    assert {sent.phase for sent in setpoints} == {Phase.HANDING_BACK}
    assert dialogue.agent.status().safe_setpoints == 0


def test_stop_right_behind_the_takeoff_lands_although_heartbeat_shows_the_takeoff_afterwards():
    dialogue = Dialogue().until_sent("takeoff")
    dialogue.stop()
    dialogue.deliver(heartbeat(mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, px4.TAKEOFF, armed=True))
    assert dialogue.agent.phase is Phase.LANDING
    dialogue.run()
    assert dialogue.agent.error is None
    assert dialogue.agent.interrupted


def test_stop_is_recorded_as_an_event():
    dialogue = Dialogue().run(Phase.FLYING)
    dialogue.stop()
    assert [name for _, name, _ in dialogue.events] == ["start", "stop"]
    assert dialogue.events[1][0] == dialogue.of("loiter")[0].stamp_us


def test_a_second_stop_changes_nothing():
    dialogue = Dialogue().run(Phase.FLYING)
    dialogue.stop()
    at = len(dialogue.sent)
    dialogue.stop()
    assert len(dialogue.sent) == at
    assert dialogue.run().agent.error is None


def test_a_stop_after_the_end_does_not_spoil_it():
    dialogue = Dialogue().run()
    dialogue.stop()
    assert not dialogue.agent.interrupted


def test_the_last_resort_is_a_hold_and_a_safe_setpoint():
    dialogue = Dialogue().run(Phase.FLYING)
    hold, setpoint = dialogue.agent.last_resort()
    assert hold[7:10] == bytes((mavlink.MAVLINK_MSG_ID_COMMAND_LONG, 0, 0))
    assert setpoint[7:10] == bytes((mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET, 0, 0))
    assert Dialogue().run(Phase.WAITING).agent.last_resort() == []
