"""What holds over whole flights, whatever is lost on the way; and that the same inputs give the same bytes."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.agent import Agent
from mavquad.control.defaults import DEPTHS
from mavquad.drivers.replay import OperatorEvent, replay
from mavquad.endpoint import GRID_US
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import mavlink
from mavquad.tlog import Record
from tests.dialogues.peer import (
    PARAMS,
    SETPOINT,
    SETPOINTS,
    START_US,
    VERSIONS,
    Dialogue,
    ScriptedVehicle,
    with_law,
)

LAW_PHASES = {Phase.ENGAGING, Phase.FLYING, Phase.HANDING_BACK}


def lossy_flight(seed, loss, repeats=0.0, depth="torque", measurements="full"):
    chance = random.Random(seed)
    vehicle = ScriptedVehicle(
        version=VERSIONS[depth],
        lost=lambda message: chance.random() < loss,
        repeated=lambda message: chance.random() < repeats,
    )
    return Dialogue(vehicle, with_law(depth=depth, measurements=measurements)).run(limit_s=300.0)


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**31),
    loss=st.sampled_from([0.0, 0.02, 0.1, 0.3]),
    depth=st.sampled_from(DEPTHS),
    measurements=st.sampled_from(["full", "position_attitude", "position_yaw"]),
)
def test_every_setpoint_answers_a_fresh_measurement_but_for_one_safe_one(seed, loss, depth, measurements):
    dialogue = lossy_flight(seed, loss, 0.1, depth, measurements)
    by_position = depth == "attitude" or measurements == "position_yaw"
    stepping = "LOCAL_POSITION_NED" if by_position else "ATTITUDE"
    fresh = set(dialogue.arrivals(stepping))
    without = [sent for sent in dialogue.setpoints if sent.stamp_us not in fresh]
    status = dialogue.agent.status()
    assert len(without) <= status.safe_setpoints <= 1
    assert len(dialogue.setpoints) == status.setpoints_sent + status.safe_setpoints
    assert {sent.name for sent in dialogue.setpoints} <= {SETPOINTS[depth]}
    assert all(stamped(sent) for sent in dialogue.setpoints)
    assert {sent.phase for sent in dialogue.setpoints} <= LAW_PHASES


def stamped(sent):
    """Whether a setpoint carries the moment that it was sent at."""
    if sent.name == SETPOINT:
        return sent.message.time_usec == sent.stamp_us
    return sent.message.time_boot_ms == sent.stamp_us // 1000 % 2**32


@settings(max_examples=15)
@given(seed=st.integers(0, 2**31), loss=st.sampled_from([0.0, 0.05, 0.2]))
def test_a_lossy_flight_ends_on_the_ground(seed, loss):
    dialogue = lossy_flight(seed, loss)
    assert not dialogue.vehicle.armed
    assert dialogue.vehicle.height_m == 0.0


@pytest.mark.parametrize("seed", range(10))
def test_a_few_losses_do_not_end_a_flight(seed):
    dialogue = lossy_flight(seed, 0.02)
    assert dialogue.agent.error is None
    assert dialogue.lost > 0


def test_stamps_go_forward_on_the_grid():
    dialogue = lossy_flight(5, 0.1)
    stamps = [stamp for stamp, _, _ in dialogue.record]
    inputs = [stamp for stamp, _, outbound in dialogue.record if not outbound]
    assert stamps == sorted(stamps)
    assert len(set(inputs)) == len(inputs)
    assert all(stamp % GRID_US == 0 for stamp in stamps)


@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_the_same_inputs_give_the_same_bytes(loss):
    assert lossy_flight(7, loss).record == lossy_flight(7, loss).record


@pytest.mark.parametrize("loss", [0.0, 0.1])
@pytest.mark.parametrize("stopped", [False, True])
def test_the_record_alone_replays_the_flight(loss, stopped):
    chance = random.Random(11)
    dialogue = Dialogue(ScriptedVehicle(lost=lambda message: chance.random() < loss)).run(Phase.TAKING_OFF)
    dialogue.run_for(0.55)
    if stopped:
        dialogue.stop()
    dialogue.run()
    records = [Record(stamp, 3 if outbound else 0, frame) for stamp, frame, outbound in dialogue.record]
    events = [OperatorEvent(*event) for event in dialogue.events]
    result = replay(Agent(PARAMS, START_US), START_US, records, events)
    assert result.first_mismatch is None
    assert result.matched == result.recorded == len(dialogue.sent)


def test_heartbeats_go_out_once_a_second_from_the_first_frame_heard_on():
    dialogue = Dialogue().run()
    stamps = [sent.stamp_us for sent in dialogue.of("HEARTBEAT")]
    first = dialogue.record[0][0]
    assert stamps == [first + i * 1_000_000 for i in range(len(stamps))]
    assert len(stamps) >= 5


def test_the_status_before_the_version_is_known_tells_no_depth():
    dialogue = Dialogue().run(Phase.IDENTIFYING)
    assert (dialogue.agent.status().version, dialogue.agent.status().depth) == ((0, 0, 0), "")


def test_timesync_is_answered_with_our_clock_and_its_own_stamp():
    dialogue = Dialogue().run(Phase.WAITING)
    dialogue.deliver(mavlink.MAVLink_timesync_message(0, 123_456_789))
    [reply] = [sent for sent in dialogue.of("TIMESYNC") if sent.message.tc1 != 0]
    assert (reply.message.tc1, reply.message.ts1) == (reply.stamp_us * 1000, 123_456_789)


def test_an_answer_to_a_timesync_is_not_answered():
    dialogue = Dialogue().run(Phase.WAITING)
    dialogue.deliver(mavlink.MAVLink_timesync_message(5, 123_456_789))
    assert all(sent.message.tc1 == 0 for sent in dialogue.of("TIMESYNC"))


def test_acks_to_others_are_not_ours():
    dialogue = Dialogue(ScriptedVehicle(answers={"arm": lambda vehicle: None})).run(Phase.ARMING)
    ack = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 2, 0, 0, 255, 190)
    dialogue.deliver(ack)
    dialogue.run_for(0.5)
    assert dialogue.agent.phase is Phase.ARMING
    ack.target_system = 245
    dialogue.deliver(ack)
    assert dialogue.run().agent.error.result == "DENIED"


def test_every_frame_is_addressed_to_the_vehicle():
    for sent in Dialogue().run().sent:
        if hasattr(sent.message, "target_system"):
            assert (sent.message.target_system, sent.message.target_component) in ((1, 1), (0, 0))
        assert (sent.message.get_srcSystem(), sent.message.get_srcComponent()) == (245, 190)


def test_the_status_of_a_flight_for_a_display():
    status = Dialogue().run(Phase.FLYING).run_for(0.5).agent.status()
    assert (status.phase, status.mode, status.armed, status.vehicle) == (
        Phase.FLYING.value,
        "OFFBOARD",
        True,
        "PX4 1.13.3 (1/1)",
    )
    assert status.depth == "torque"
    assert status.height_m == pytest.approx(2.5, abs=0.03)
    assert status.position_error_m == pytest.approx(0.0, abs=1e-3)
    assert (status.mission_duration_s, status.position_hz) == (2.5, 100.0)
    assert 0.4 < status.mission_s < 0.6
