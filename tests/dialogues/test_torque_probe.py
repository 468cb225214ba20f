"""Whether a PX4 1.13 takes torques is found out on the ground: with zeros, disarmed, and back in hold before it is armed."""

from __future__ import annotations

from itertools import pairwise

import pytest

from mavquad.flight.machine import Phase
from mavquad.flight.parameters import VehicleParameters
from mavquad.flight.torque_probe import REFUSALS, TorqueProbe
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import px4
from tests.dialogues.peer import (
    ACCEPTED,
    PARAMS,
    POSCTL,
    REJECTED,
    SETPOINT,
    VERSIONS,
    Dialogue,
    ScriptedVehicle,
    answer,
    at_depth,
    silent,
)

CHANGING = PARAMS.model_copy(update={"parameters": VehicleParameters(px4={"COM_OF_LOSS_T": 0.5})})


def probed(probe=ScriptedVehicle.do_offboard, **answers) -> Dialogue:
    """A vehicle that answers the probe so; its parameters are changed for the flight."""
    return Dialogue(ScriptedVehicle(answers={"probe": probe, **answers}), CHANGING)


def on_the_ground(dialogue) -> bool:
    """It was never armed, no setpoint was anything but zero, and its parameters are what they were."""
    assert dialogue.of("arm") == dialogue.of("takeoff") == dialogue.of(SETPOINT) == []
    assert not any(any(sent.message.controls) for sent in dialogue.of("zero"))
    assert dialogue.agent.changed_parameters.restored
    return dialogue.vehicle.parameters["COM_OF_LOSS_T"][1] == 1.0 and not dialogue.vehicle.armed


def in_pilots_hands(dialogue) -> bool:
    """It was taken over: it was never armed by us, and nothing is sent any more, not even parameters."""
    assert dialogue.agent.done
    assert dialogue.agent.error.exit_code == 4
    assert "took over" in dialogue.agent.error.message
    assert dialogue.of("arm") == []
    sent = len(dialogue.sent)
    dialogue.run_for(3.0)
    return len(dialogue.sent) == sent


def switched(vehicle):
    """The mode changes, and the ACK is lost."""
    vehicle.mode = px4.OFFBOARD


def test_zeros_flow_offboard_is_asked_for_and_left_again_before_it_is_armed():
    dialogue = Dialogue().run(Phase.ARMING)
    zeros, [probe], [withdraw] = dialogue.of("zero"), dialogue.of("probe"), dialogue.of("withdraw")
    assert {tuple(sent.message.controls) for sent in zeros} == {(0.0,) * 8}
    assert {(m.group_mlx, m.target_system, m.target_component) for m in (sent.message for sent in zeros)} == {(0, 1, 1)}
    assert {b.stamp_us - a.stamp_us for a, b in pairwise(zeros)} == {20_000}
    assert probe.stamp_us - zeros[0].stamp_us >= 400_000
    # Right behind a HEARTBEAT: a pilot's choice in the second before would have been seen.
    heartbeats = [stamp for stamp, frame, outbound in dialogue.record if not outbound and frame[7:10] == bytes(3)]
    assert probe.stamp_us in heartbeats
    assert withdraw.stamp_us > probe.stamp_us
    assert dialogue.vehicle.mode == px4.LOITER
    assert dialogue.phases[-5:] == ["waiting", "probing", "withdrawing", "waiting", "arming"]
    # They go on until HEARTBEAT shows that it has left the mode: the loss of them would change it.
    assert {sent.phase for sent in zeros} == {Phase.PROBING, Phase.WITHDRAWING}
    assert 0 <= heartbeats[-1] - zeros[-1].stamp_us <= 20_000
    assert dialogue.agent.status().setpoints_sent == 0
    assert dialogue.of(SETPOINT) == []


def test_a_heartbeat_right_behind_the_beginning_is_too_early_to_ask():
    probe = TorqueProbe(px4.OFFBOARD)
    probe.start(1_000_000)
    assert [probe.on_heartbeat((1, 1), stamp) for stamp in (1_000_000, 1_399_996)] == [[], []]
    assert not probe.asked
    assert len(probe.on_heartbeat((1, 1), 1_400_000)) == 1
    assert probe.asked


def test_a_build_that_ignores_torques_is_refused_on_the_ground():
    dialogue = probed(answer(REJECTED)).run()
    error = dialogue.agent.error
    assert error.exit_code == 3
    assert "this build of PX4 1.13.3 ignores torque setpoints" in error.message
    assert f"(TEMPORARILY_REJECTED, {REFUSALS} times)" in error.message
    assert "lockstep" in error.hint
    assert "--depth rate" in error.hint
    assert on_the_ground(dialogue)
    assert dialogue.phases[-3:] == ["probing", "restoring", "done"]
    asked = [sent.stamp_us for sent in dialogue.of("probe")]
    assert len(asked) == REFUSALS == 3
    assert min(b - a for a, b in pairwise(asked)) >= 1_000_000
    assert dialogue.of("withdraw") == []  # its mode never changed


@pytest.mark.parametrize("refusals", [1, 2])
def test_a_few_refusals_decide_nothing(refusals):
    def act(vehicle):
        first = len(dialogue.of("probe")) <= refusals
        answer(REJECTED)(vehicle) if first else vehicle.do_offboard()

    dialogue = probed(act)
    dialogue.run()
    assert dialogue.agent.error is None
    assert len(dialogue.of("probe")) == refusals + 1


def test_one_refusal_told_twice_counts_once():
    dialogue = probed(answer(REJECTED, REJECTED)).run()
    assert len(dialogue.of("probe")) == REFUSALS
    assert on_the_ground(dialogue)


def test_an_acceptance_without_its_ack_is_seen_in_heartbeat():
    dialogue = probed(switched).run(Phase.WITHDRAWING)
    assert dialogue.vehicle.mode == px4.OFFBOARD
    assert dialogue.run().agent.error is None
    assert len(dialogue.of("probe")) == 1


def test_a_vehicle_that_does_not_answer_is_left_on_the_ground():
    dialogue = probed(silent).run()
    assert dialogue.agent.error.exit_code == 3
    assert "mode OFFBOARD while torques of zero come" in dialogue.agent.error.message
    assert "(waited 15.0 s)" in dialogue.agent.error.message
    assert len(dialogue.of("withdraw")) == 1  # it may be in the mode all the same
    assert dialogue.phases[-4:] == ["probing", "withdrawing", "restoring", "done"]
    assert on_the_ground(dialogue)


# ---------------------------------------------------------------------- back out of the mode


def test_hold_is_asked_for_again_while_heartbeat_shows_offboard():
    asked = []

    def refuse_twice(vehicle):
        asked.append(vehicle)
        answer(REJECTED)(vehicle) if len(asked) <= 2 else vehicle.do_loiter()

    dialogue = probed(withdraw=refuse_twice).run()
    assert len(asked) == 3
    assert dialogue.agent.error is None


def test_hold_without_its_ack_is_seen_in_heartbeat():
    def hold(vehicle):
        vehicle.mode = px4.LOITER

    dialogue = probed(switched, withdraw=hold).run(Phase.ARMING)
    assert dialogue.run().agent.error is None


@pytest.mark.parametrize("hold", [answer(ACCEPTED), answer(REJECTED), silent])
def test_a_vehicle_that_does_not_leave_offboard_is_not_armed(hold):
    dialogue = probed(withdraw=hold).run()
    assert "mode AUTO.LOITER (waited 15.0 s" in dialogue.agent.error.message
    assert "before it is armed" in dialogue.agent.error.hint
    assert len(dialogue.of("withdraw")) >= 5
    assert dialogue.phases[-4:] == ["probing", "withdrawing", "restoring", "done"]
    assert on_the_ground(dialogue)


def test_the_last_resort_is_the_hold_mode_alone():
    dialogue = Dialogue().run(Phase.PROBING)
    [hold] = dialogue.agent.last_resort()
    dialogue.run(Phase.WITHDRAWING)
    assert [frame[7:10] for frame in (hold, *dialogue.agent.last_resort())] == [
        bytes((mavlink.MAVLINK_MSG_ID_COMMAND_LONG, 0, 0))
    ] * 2


# ---------------------------------------------------------------------- the pilot wins


@pytest.mark.parametrize("mode", [POSCTL, px4.OFFBOARD, px4.RTL])
def test_a_mode_change_before_it_is_asked_for_one_is_the_pilots(mode):
    dialogue = Dialogue(ScriptedVehicle(prearm=False)).run_for(5.0)
    dialogue.vehicle.prearm = True
    dialogue.run(Phase.PROBING).run_for(0.05)
    dialogue.vehicle.mode = mode
    dialogue.run(Phase.DONE, 1.0)
    assert dialogue.of("probe") == []
    assert in_pilots_hands(dialogue)


@pytest.mark.parametrize("mode", [POSCTL, px4.RTL, px4.LAND])
def test_a_mode_change_while_it_is_asked_is_the_pilots(mode):
    def pilot(vehicle):
        vehicle.mode = mode

    dialogue = probed(pilot).run(Phase.DONE, 17.0)
    assert f"mode {mode.name} while probing" in dialogue.agent.error.message
    assert in_pilots_hands(dialogue)


@pytest.mark.parametrize("mode", [POSCTL, px4.RTL])
def test_a_mode_change_on_the_way_back_is_the_pilots(mode):
    def pilot(vehicle):
        vehicle.mode = mode

    dialogue = probed(withdraw=pilot).run(Phase.DONE, 17.0)
    assert f"mode {mode.name} while withdrawing" in dialogue.agent.error.message
    assert in_pilots_hands(dialogue)


@pytest.mark.parametrize("phase", [Phase.PROBING, Phase.WITHDRAWING])
def test_who_arms_it_meanwhile_is_the_pilot(phase):
    def arms(vehicle):
        vehicle.armed = True

    answers = {Phase.PROBING: {"probe": arms}, Phase.WITHDRAWING: {"withdraw": arms}}[phase]
    dialogue = probed(**answers).run(Phase.DONE, 17.0)
    assert f"armed, mode {dialogue.vehicle.mode.name}, while {phase.value}" in dialogue.agent.error.message
    assert in_pilots_hands(dialogue)


# ---------------------------------------------------------------------- the operator stops


def test_a_stop_before_it_is_asked_for_a_mode_asks_for_none():
    dialogue = probed().run(Phase.PROBING).run_for(0.1)
    dialogue.stop()
    dialogue.run()
    assert dialogue.of("probe") == dialogue.of("withdraw") == []
    assert dialogue.agent.interrupted
    assert dialogue.agent.error is None
    assert on_the_ground(dialogue)


@pytest.mark.parametrize("when", ["probe", "withdraw"])
def test_a_stop_leaves_the_mode_first(when):
    dialogue = probed().until_sent(when)
    dialogue.stop()
    dialogue.run()
    assert dialogue.vehicle.mode == px4.LOITER
    assert dialogue.phases[-4:] == ["probing", "withdrawing", "restoring", "done"]
    assert dialogue.agent.interrupted
    assert dialogue.agent.error is None
    assert on_the_ground(dialogue)


# ---------------------------------------------------------------------- whom it concerns


@pytest.mark.parametrize("depth", ["rate", "attitude"])
@pytest.mark.parametrize("version", [(1, 13, 3), VERSIONS["rate"]])
def test_at_other_depths_nothing_is_probed(depth, version):
    dialogue = at_depth(depth)
    dialogue.vehicle.version = version
    dialogue.run()
    assert dialogue.agent.error is None
    assert "probing" not in dialogue.phases
    assert dialogue.of("zero") == dialogue.of("probe") == []
