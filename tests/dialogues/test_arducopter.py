"""The agent and ArduCopter: GUIDED from the ground to the hand-back, BRAKE, LAND; the pilot, refusals, and what is stopped."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from mavquad.flight.guard_motion import JumpParams
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware.ardupilot import mode
from tests.dialogues.copter import BRAKE, CHANGING, GUIDED, LAND, RTL, STABILIZE, ScriptedCopter, names, stamps_of
from tests.dialogues.peer import ACCEPTED, PARAMS, REJECTED, Dialogue, answer, silent

SETPOINT = "SET_ATTITUDE_TARGET"
LOITER = mode(5)


def copter(params=PARAMS, **keys) -> Dialogue:
    return Dialogue(ScriptedCopter(**keys), params)


def sends_nothing_more(dialogue: Dialogue) -> bool:
    sent = len(dialogue.sent)
    dialogue.run_for(3.0)
    return len(dialogue.sent) == sent


def blinded(dialogue: Dialogue) -> Dialogue:
    """In flight, and a guard trips: no positions any more."""
    dialogue.run(Phase.FLYING).run_for(0.5)
    dialogue.vehicle.muted = {"LOCAL_POSITION_NED"}
    return dialogue


def test_a_whole_flight_in_its_order() -> None:
    dialogue = copter().run()
    assert dialogue.agent.error is None
    assert names(dialogue) == ["GUIDED", "arm", "takeoff", SETPOINT, "BRAKE", SETPOINT, "LAND"]
    assert not dialogue.vehicle.armed


def test_the_takeoff_command_says_the_height() -> None:
    dialogue = copter().run(Phase.ENGAGING)
    assert dialogue.vehicle.goal_m == 2.5


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK, Phase.LANDING])
@pytest.mark.parametrize("taken", [LOITER, STABILIZE, mode(3)], ids=lambda taken: taken.name)
def test_the_pilot_may_take_over_in_every_phase(phase, taken) -> None:
    dialogue = copter().run(phase)
    dialogue.vehicle.answers = dict.fromkeys(("BRAKE", "LAND"), silent)
    dialogue.vehicle.mode = taken
    dialogue.run()
    assert f"took over: mode {taken.name} while {phase.value}" in dialogue.agent.error.message
    assert sends_nothing_more(dialogue)
    assert dialogue.vehicle.mode == taken


def test_guided_that_it_leaves_by_itself_on_the_ground_is_asked_for_again() -> None:
    dialogue = copter(prearm=False)
    dialogue.run(lambda: dialogue.vehicle.mode == GUIDED).run_for(1.5)
    asked = len(stamps_of(dialogue, "GUIDED"))
    dialogue.vehicle.mode = STABILIZE
    dialogue.run_for(1.2)
    dialogue.vehicle.prearm = True
    dialogue.run(Phase.ARMING)
    assert len(stamps_of(dialogue, "GUIDED")) == asked + 1
    assert min(stamps_of(dialogue, "arm")) > max(stamps_of(dialogue, "GUIDED"))
    assert dialogue.run().agent.error is None


def test_guided_that_is_refused_keeps_it_on_the_ground() -> None:
    dialogue = copter(answers={"GUIDED": answer(REJECTED)}).run_for(10.0)
    assert dialogue.agent.phase is Phase.WAITING
    assert stamps_of(dialogue, "arm") == []
    assert len(stamps_of(dialogue, "GUIDED")) > 5


def test_a_brake_that_is_refused_lands_all_the_same() -> None:
    dialogue = copter(answers={"BRAKE": answer(REJECTED)}).run()
    assert names(dialogue)[-1] in ("LAND", SETPOINT)
    assert "mode BRAKE" in dialogue.agent.error.message
    assert not dialogue.vehicle.armed


def test_a_land_that_is_refused_is_asked_for_again_every_second() -> None:
    dialogue = copter(answers={"LAND": answer(REJECTED)}).run(Phase.LANDING).run_for(5.0)
    assert 4 <= len(stamps_of(dialogue, "LAND")) <= 7
    dialogue.vehicle.answers = {}
    dialogue.run()
    assert not dialogue.vehicle.armed


def test_a_guard_has_the_mode_change_first_and_safe_setpoints_until_heartbeat_shows_it() -> None:
    dialogue = blinded(copter(answers={"BRAKE": silent}))
    dialogue.run(Phase.HANDING_BACK).run_for(2.0)
    [tripped_us] = [note.stamp_us for note in dialogue.notes if note.text == "handing back"]
    after = [
        sent for sent in dialogue.sent if sent.stamp_us >= tripped_us and sent.name not in ("HEARTBEAT", "TIMESYNC")
    ]
    assert after[0].message.command == mavlink.MAV_CMD_DO_SET_MODE
    assert after[1].message.get_type() == SETPOINT
    assert after[1].stamp_us == tripped_us
    safe = [sent.message for sent in after if sent.name == SETPOINT]
    assert 95 <= len(safe) <= 105
    assert all((m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate) == (0.0, 0.0, 0.0) for m in safe)
    assert 6 <= len(stamps_of(dialogue, "BRAKE")) <= 8
    dialogue.vehicle.mode = BRAKE
    dialogue.run(Phase.LANDING, 1.1)
    released_us = dialogue.now_us
    dialogue.run()
    assert not [stamp for stamp in stamps_of(dialogue, SETPOINT) if stamp > released_us]


def test_neither_brake_nor_land_is_heard_safe_setpoints_go_on_while_it_shows_guided() -> None:
    """The firmware holds the last command, whatever phase we are in."""
    dialogue = blinded(copter(answers={"BRAKE": answer(REJECTED), "LAND": silent}))
    dialogue.run(Phase.LANDING).run_for(1.0)
    late = [stamp for stamp in stamps_of(dialogue, SETPOINT) if stamp > dialogue.now_us - 500_000]
    assert len(late) >= 20
    dialogue.vehicle.mode = LAND
    dialogue.run()
    assert max(stamps_of(dialogue, SETPOINT)) < dialogue.now_us - 500_000


@pytest.mark.parametrize(
    ("reaction", "asked", "landing"),
    [("hold", BRAKE, False), ("land", BRAKE, True), ("return", RTL, True), ("pilot", LOITER, False)],
)
def test_the_reactions(reaction, asked, landing) -> None:
    guards = PARAMS.guards.model_copy(update={"jump": JumpParams(position_m=0.5, reaction=reaction)})
    dialogue = copter(PARAMS.model_copy(update={"guards": guards})).run(Phase.FLYING).run_for(0.5)
    dialogue.vehicle.east_m += 2.0
    dialogue.run(Phase.HANDING_BACK)
    dialogue.run()
    assert dialogue.agent.error.message.startswith("guard 'jump'")
    assert asked.name in names(dialogue)
    assert ("landing" in dialogue.phases) is landing
    assert dialogue.vehicle.armed is not landing


def test_who_arms_it_again_while_its_parameters_are_put_back_is_the_pilot() -> None:
    dialogue = copter(CHANGING).run(Phase.LANDING)
    heard = ScriptedCopter.hear
    dialogue.vehicle.hear = lambda message, name: (
        None if name == "PARAM_SET" else heard(dialogue.vehicle, message, name)
    )
    dialogue.run(Phase.RESTORING)
    dialogue.vehicle.armed, dialogue.vehicle.mode = True, LOITER
    dialogue.run(Phase.DONE, 1.5)
    assert sends_nothing_more(dialogue)
    assert "took over" in dialogue.agent.error.message
    assert not dialogue.agent.changed_parameters.restored


@pytest.mark.parametrize("phase", [Phase.PREPARING, Phase.WAITING, Phase.RESTORING])
def test_stop_on_the_ground_puts_the_parameters_back(phase) -> None:
    dialogue = copter(CHANGING).run(phase)
    dialogue.stop()
    dialogue.run()
    assert dialogue.agent.interrupted
    assert dialogue.agent.error is None
    assert dialogue.vehicle.parameters["GUID_TIMEOUT"][1] == pytest.approx(3.0)
    assert dialogue.vehicle.parameters["GUID_OPTIONS"][1] == 0.0
    assert not dialogue.vehicle.armed


def test_a_reboot_while_its_parameters_are_changed_does_no_harm() -> None:
    dialogue = copter(CHANGING).run(Phase.PREPARING)
    dialogue.powered = False
    dialogue.run_for(2.0)
    dialogue.powered = True
    dialogue.vehicle.ticks, dialogue.vehicle.mode = 0, STABILIZE
    dialogue.run()
    assert dialogue.agent.error is None
    assert dialogue.vehicle.parameters["GUID_TIMEOUT"][1] == pytest.approx(3.0)


def test_a_heartbeat_that_is_a_second_late_hands_back_no_later() -> None:
    """BRAKE is acknowledged at once and shown a second later: the safe setpoints bridge it."""
    dialogue = blinded(copter())
    dialogue.run(Phase.HANDING_BACK)
    began_us = dialogue.now_us
    dialogue.run(Phase.LANDING, 1.1)
    gaps = [
        later - stamp
        for stamp, later in zip(safe_after(dialogue, began_us), safe_after(dialogue, began_us)[1:], strict=False)
    ]
    assert not gaps or max(gaps) <= 20_100


@pytest.mark.parametrize(("silent_s", "roll_rad", "well"), [(0.0, 0.0, True), (2.0, 0.0, False), (0.0, 1.5, False)])
def test_disarmed_while_landing_is_a_landing_only_upright_and_told_of(silent_s, roll_rad, well) -> None:
    """One that reboots in the air, or falls on its side, shows disarmed as well."""
    dialogue = copter().run(Phase.LANDING).run_for(1.2)
    dialogue.vehicle.height_m, dialogue.vehicle.roll_rad = 0.0, roll_rad
    dialogue.vehicle.muted = {"ATTITUDE", "LOCAL_POSITION_NED"} if silent_s else set()
    dialogue.run_for(0.1 + silent_s)
    assert not dialogue.vehicle.armed or silent_s == 0.0
    dialogue.vehicle.armed = False
    dialogue.run()
    assert (dialogue.agent.error is None) is well


def safe_after(dialogue: Dialogue, stamp_us: int) -> list[int]:
    return [stamp for stamp in stamps_of(dialogue, SETPOINT) if stamp >= stamp_us]


@dataclass
class SharedCopter(ScriptedCopter):
    """Its streams come as they were asked for last, by whomever."""

    def do_interval(self) -> None:
        name = {
            mavlink.MAVLINK_MSG_ID_ATTITUDE: "attitude_ms",
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: "position_ms",
        }
        asked = name.get(int(self.command.param1))
        if asked is not None:
            setattr(self, asked, round(self.command.param2 * 1e-3))
        self.ack(ACCEPTED)


def test_streams_that_somebody_else_slows_down_in_flight_are_asked_for_again() -> None:
    """MAVProxy on the same link sets all streams to 4 Hz every 15 s (seen on 4.6.3)."""
    dialogue = Dialogue(SharedCopter(), CHANGING).run(Phase.FLYING)
    for _ in range(3):
        dialogue.run_for(0.4)
        dialogue.vehicle.attitude_ms = dialogue.vehicle.position_ms = 250
    dialogue.run()
    assert dialogue.agent.error is None
    asked = [sent for sent in dialogue.of("interval") if sent.phase is Phase.FLYING]
    assert 6 <= len(asked) <= 12
