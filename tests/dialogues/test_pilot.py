"""The pilot always wins: a vehicle that somebody flies is not taken, and one that he takes is left alone."""

from __future__ import annotations

import pytest

from mavquad.flight.machine import Phase
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import px4
from tests.dialogues.peer import PARAMETERS, Dialogue, ScriptedVehicle

POSCTL = px4.mode(3)


def sends_nothing_more(dialogue: Dialogue) -> bool:
    sent = len(dialogue.sent)
    dialogue.run_for(3.0)
    return len(dialogue.sent) == sent


def test_a_vehicle_that_is_armed_already_is_refused() -> None:
    dialogue = Dialogue(ScriptedVehicle(armed=True, mode=POSCTL, height_m=3.0)).run()
    assert dialogue.agent.error is not None
    assert dialogue.agent.error.exit_code == 3
    assert "armed already, mode POSCTL" in dialogue.agent.error.message
    assert dialogue.of("arm") == dialogue.of("takeoff") == []


def test_a_vehicle_that_is_armed_while_we_wait_is_refused() -> None:
    dialogue = Dialogue(ScriptedVehicle(prearm=False)).run(Phase.WAITING)
    dialogue.vehicle.armed = True
    dialogue.run()
    assert dialogue.agent.error is not None
    assert "armed already" in dialogue.agent.error.message
    assert dialogue.of("takeoff") == []


def test_a_vehicle_in_the_air_is_not_armed() -> None:
    dialogue = Dialogue(ScriptedVehicle(height_m=3.0)).run_for(8.0)
    assert dialogue.agent.phase is Phase.WAITING
    assert dialogue.of("arm") == []


def test_a_mode_change_while_arming_is_the_pilots() -> None:
    vehicle = ScriptedVehicle(answers={"arm": ScriptedVehicle.do_interval})
    dialogue = Dialogue(vehicle).run(Phase.ARMING)
    vehicle.mode = POSCTL
    vehicle.armed = True
    dialogue.run()
    assert dialogue.agent.error is not None
    assert dialogue.agent.error.exit_code == 4
    assert dialogue.of("takeoff") == []
    assert sends_nothing_more(dialogue)


def test_hold_selected_low_in_the_climb_is_the_pilots() -> None:
    dialogue = Dialogue().run(Phase.TAKING_OFF)
    dialogue.run(lambda: dialogue.vehicle.height_m > 0.3)
    dialogue.vehicle.height_m = 0.6
    dialogue.run_for(0.2)
    dialogue.deliver(
        mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 128, px4.TAKEOFF.custom_mode, 4, 3
        )
    )
    dialogue.vehicle.mode = px4.LOITER
    dialogue.vehicle.height_m = 0.6
    dialogue.run()
    assert dialogue.agent.error is not None
    assert dialogue.agent.error.exit_code == 4
    assert "AUTO.LOITER while taking off" in dialogue.agent.error.message
    assert sends_nothing_more(dialogue)


def test_hold_selected_in_our_landing_is_the_pilots() -> None:
    dialogue = Dialogue().run(Phase.LANDING)
    dialogue.run_for(1.2)
    assert dialogue.agent.phase is Phase.LANDING
    dialogue.vehicle.mode = px4.LOITER
    dialogue.run()
    assert dialogue.agent.error is not None
    assert dialogue.agent.error.exit_code == 4
    assert "AUTO.LOITER while landing" in dialogue.agent.error.message
    assert sends_nothing_more(dialogue)


def test_a_landing_that_is_refused_once_is_asked_for_again() -> None:
    refusals = iter([True])

    def land(vehicle: ScriptedVehicle) -> None:
        if next(refusals, False):
            vehicle.ack(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        else:
            vehicle.do_land()

    dialogue = Dialogue(ScriptedVehicle(answers={"land": land})).run()
    assert len(dialogue.of("land")) == 2
    assert not dialogue.vehicle.armed
    assert dialogue.agent.error is not None
    assert "land (TEMPORARILY_REJECTED)" in dialogue.agent.error.message


def test_without_the_hover_thrust_the_law_does_not_take_over() -> None:
    without = {name: value for name, value in PARAMETERS.items() if name != "MPC_THR_HOVER"}
    dialogue = Dialogue(ScriptedVehicle(muted={"ATTITUDE_TARGET"}, parameters=without)).run()
    assert dialogue.agent.error is not None
    assert dialogue.agent.error.exit_code == 3
    assert "hover thrust is not known" in dialogue.agent.error.message
    assert dialogue.agent.status().setpoints_sent == 0
    assert not dialogue.vehicle.armed


def test_a_vehicle_that_does_not_tell_its_thrust_is_believed_its_parameter() -> None:
    """Three times the settling time after it is steady, since the parameter may be far off."""
    mute, telling = (Dialogue(ScriptedVehicle(muted=muted)).run() for muted in ({"ATTITUDE_TARGET"}, set()))
    assert mute.agent.error is None
    assert mute.agent.status().hover_thrust_norm == pytest.approx(0.45, abs=1e-6)
    assert telling.agent.status().hover_thrust_norm == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("round_trip_ms", "arms"), [(50, True), (350, False)])
def test_a_slow_link_keeps_it_on_the_ground(round_trip_ms: int, arms: bool) -> None:
    dialogue = Dialogue(ScriptedVehicle(prearm=False)).run(Phase.WAITING)
    dialogue.until_sent("TIMESYNC", len(dialogue.of("TIMESYNC")) + 1)
    question = dialogue.of("TIMESYNC")[-1]
    dialogue.run_for(round_trip_ms * 1e-3)
    dialogue.deliver(mavlink.MAVLink_timesync_message(1, question.message.ts1))
    dialogue.vehicle.prearm = True
    dialogue.run_for(3.0)
    assert bool(dialogue.of("arm")) is arms


def test_hold_shown_by_a_vehicle_that_has_disarmed_itself_is_nobodys() -> None:
    """PX4 1.16 leaves AUTO.LAND for AUTO.LOITER as it disarms: one HEARTBEAT shows both."""
    dialogue = Dialogue().run(Phase.LANDING).run_for(1.2)
    assert dialogue.vehicle.mode == px4.LAND
    dialogue.vehicle.mode, dialogue.vehicle.armed, dialogue.vehicle.height_m = px4.LOITER, False, 0.0
    dialogue.run()
    assert dialogue.agent.error is None
