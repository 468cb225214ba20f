"""What is sent at each depth of the law, and which measurement each setpoint answers."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from mavquad.control.defaults import DEPTHS
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import decode, mavlink
from mavquad.protocol.streams import StreamParams
from tests.dialogues.peer import SETPOINTS, Dialogue, ScriptedVehicle, at_depth, with_law

IGNORED = {"rate": 0x80, "attitude": 0x07}
FAST_ATTITUDE = StreamParams(attitude_hz=250.0, position_hz=50.0)


def flying(depth, seconds=0.3, **vehicle):
    return at_depth(depth, **vehicle).run(Phase.FLYING).run_for(seconds)


def yaw_of(quaternion):
    """Yaw of (w, x, y, z) that leans nowhere."""
    w, x, y, z = quaternion
    assert (x, y) == (0.0, 0.0)
    return 2.0 * math.atan2(z, w)


def is_safe(message, depth, hover, yaw_rad):
    """Hover thrust and no rotation."""
    if depth == "torque":
        assert list(message.controls) == pytest.approx([0.0, 0.0, 0.0, hover, 0.0, 0.0, 0.0, 0.0], abs=1e-6)
        return
    assert message.type_mask == IGNORED[depth]
    assert message.thrust == pytest.approx(hover, abs=1e-6)
    assert (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate) == (0.0, 0.0, 0.0)
    if depth == "attitude":
        assert yaw_of(message.q) == pytest.approx(yaw_rad, abs=1e-6)


# ---------------------------------------------------------------------- which depth, and its message


@pytest.mark.parametrize(
    ("version", "asked", "depth"),
    [
        ((1, 12, 0), "auto", "torque"),
        ((1, 13, 3), "auto", "torque"),
        ((1, 14, 0), "auto", "rate"),
        ((1, 16, 2), "auto", "rate"),
        ((1, 13, 3), "rate", "rate"),
        ((1, 13, 3), "attitude", "attitude"),
        ((1, 16, 2), "attitude", "attitude"),
    ],
)
def test_the_firmware_chooses_the_depth_where_the_configuration_does_not(version, asked, depth):
    dialogue = Dialogue(ScriptedVehicle(version=version), with_law(depth=asked)).run(Phase.FLYING).run_for(0.3)
    assert dialogue.agent.status().depth == depth
    assert next(note.text for note in dialogue.notes if note.kind == "law") == f"depth {depth}, measurements full"
    assert {sent.name for sent in dialogue.setpoints} == {SETPOINTS[depth]}
    assert {len(row.zeta_hat[0]) for row in dialogue.agent.take_trace()} == {4 - DEPTHS.index(depth)}


def test_torque_is_message_139_for_the_flight_controls():
    for sent in flying("torque").setpoints:
        assert sent.message.get_msgId() == 139
        assert sent.message.group_mlx == 0
        assert list(sent.message.controls[4:]) == [0.0] * 4


def test_rates_are_sent_without_an_attitude():
    for sent in flying("rate").setpoints:
        assert sent.message.get_msgId() == 82
        assert sent.message.type_mask == 0x80
        assert list(sent.message.q) == [1.0, 0.0, 0.0, 0.0]


def test_an_attitude_is_sent_without_rates():
    for sent in flying("attitude").setpoints:
        message = sent.message
        assert message.get_msgId() == 82
        assert message.type_mask == 0x07
        assert (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate) == (0.0, 0.0, 0.0)
        assert math.hypot(*message.q) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("measurements", ["position_yaw", "position_attitude"])
def test_the_story_tells_what_is_measured(measurements):
    dialogue = Dialogue(params=with_law(measurements=measurements)).run(Phase.WAITING)
    assert f"depth torque, measurements {measurements}" in [note.text for note in dialogue.notes]


@pytest.mark.parametrize("depth", DEPTHS)
def test_the_first_setpoint_of_a_hover_holds_it(depth):
    message = at_depth(depth).run(Phase.FLYING).setpoints[0].message
    if depth == "torque":
        assert list(message.controls[:4]) == pytest.approx([0.0, 0.0, 0.0, 0.5], abs=1e-4)
    else:
        assert message.thrust == pytest.approx(0.5, abs=1e-4)
        rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        assert rates == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    if depth == "attitude":
        assert list(message.q) == pytest.approx([math.cos(0.15), 0.0, 0.0, math.sin(0.15)], abs=1e-4)


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_flight_at_each_depth_in_its_order(depth):
    dialogue = at_depth(depth).run()
    setpoint = SETPOINTS[depth]
    assert dialogue.names() == ["arm", "takeoff", setpoint, "offboard", setpoint, "loiter", setpoint, "land"]
    assert dialogue.agent.error is None
    assert dialogue.agent.status().safe_setpoints == 0


# ---------------------------------------------------------------------- the end of the law's control


def nan_pose(vehicle):
    return [vehicle.attitude(), vehicle.position(x=math.nan)]


def leaning(vehicle):
    vehicle.ticks += 1
    return [vehicle.attitude(pitch=1.2)]


def far_away(vehicle):
    vehicle.ticks += 1
    return [vehicle.position(y=30.0)]


def handed_back(dialogue, at):
    """The mode change and a safe setpoint, both at once; then safe ones alone, until the hand-back is over."""
    after = [sent for sent in dialogue.sent[at:] if sent.name not in ("HEARTBEAT", "TIMESYNC")]
    depth = dialogue.agent.status().depth
    assert [sent.name for sent in after[:2]] == ["loiter", SETPOINTS[depth]]
    assert after[0].stamp_us == after[1].stamp_us
    dialogue.run()
    safe = [sent for sent in dialogue.sent[at:] if sent.name == SETPOINTS[depth]]
    for sent in safe:
        is_safe(sent.message, depth, dialogue.agent.status().hover_thrust_norm, dialogue.vehicle.yaw_rad)
        assert sent.phase is Phase.HANDING_BACK
    assert dialogue.agent.status().safe_setpoints == len(safe)
    assert dialogue.agent.error.exit_code == 4
    return True


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("trouble", [nan_pose, leaning, far_away])
@pytest.mark.parametrize("yaw_rad", [0.3, -2.9])
def test_the_safe_setpoint_of_each_depth_follows_the_mode_change_at_once(depth, trouble, yaw_rad):
    dialogue = flying(depth, yaw_rad=yaw_rad, thrust=0.55)
    at = len(dialogue.sent)
    dialogue.deliver(*trouble(dialogue.vehicle))
    assert handed_back(dialogue, at)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("stopped", ["ATTITUDE", "LOCAL_POSITION_NED"])
def test_a_stream_that_stops_ends_in_the_safe_setpoint_of_each_depth(depth, stopped):
    dialogue = flying(depth)
    dialogue.vehicle.muted = {stopped}
    last_us = dialogue.arrivals(stopped)[-1]
    dialogue.run(Phase.HANDING_BACK)
    at = next(index for index, sent in enumerate(dialogue.sent) if sent.name == "loiter")
    assert dialogue.sent[at].stamp_us == last_us + 100_000
    assert handed_back(dialogue, at)


@pytest.mark.parametrize("depth", DEPTHS)
def test_the_last_resort_of_each_depth(depth):
    dialogue = flying(depth, yaw_rad=2.0, thrust=0.55)
    hold, setpoint = map(decode, dialogue.agent.last_resort())
    assert (hold.command, hold.param2, hold.param3) == (mavlink.MAV_CMD_DO_SET_MODE, 4.0, 3.0)
    assert setpoint.get_type() == SETPOINTS[depth]
    is_safe(setpoint, depth, 0.55, 2.0)


# ---------------------------------------------------------------------- which measurement is answered


def with_streams(streams, **law):
    return with_law(**law).model_copy(update={"streams": streams})


@pytest.mark.parametrize(
    ("depth", "measurements", "attitude_ms", "position_ms", "stepping"),
    [
        ("torque", "full", 4, 20, "ATTITUDE"),
        ("rate", "full", 4, 20, "ATTITUDE"),
        ("torque", "position_attitude", 4, 20, "ATTITUDE"),
        ("rate", "position_attitude", 4, 20, "ATTITUDE"),
        ("torque", "position_yaw", 4, 10, "LOCAL_POSITION_NED"),
        ("rate", "position_yaw", 4, 10, "LOCAL_POSITION_NED"),
        ("torque", "full", 20, 10, "LOCAL_POSITION_NED"),
        ("rate", "full", 20, 10, "LOCAL_POSITION_NED"),
        # There roll and pitch are what is commanded: no row of the chains measures them.
        ("attitude", "full", 4, 20, "LOCAL_POSITION_NED"),
    ],
)
def test_one_of_two_streams_of_different_rates_steps_the_law(depth, measurements, attitude_ms, position_ms, stepping):
    vehicle = ScriptedVehicle(tick_us=2_000, attitude_ms=attitude_ms, position_ms=position_ms)
    streams = StreamParams(attitude_hz=1000 / attitude_ms, position_hz=1000 / position_ms)
    dialogue = Dialogue(vehicle, with_streams(streams, depth=depth, measurements=measurements))
    dialogue.run(Phase.FLYING).run_for(0.5)
    stamps = [sent.stamp_us for sent in dialogue.setpoints]
    assert stamps == [stamp_us for stamp_us in dialogue.arrivals(stepping) if stamp_us >= stamps[0]]
    period_ms = attitude_ms if stepping == "ATTITUDE" else position_ms
    assert {round((b - a) / 1000) for a, b in pairwise(stamps)} == {period_ms}
    rows = dialogue.agent.take_trace()
    assert all(later.vehicle_stamp_us > earlier.vehicle_stamp_us for earlier, later in pairwise(rows))
    assert dialogue.agent.status().old_poses == 0


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_whole_flight_on_streams_of_different_rates(depth):
    vehicle = ScriptedVehicle(tick_us=2_000, attitude_ms=4, position_ms=20)
    dialogue = Dialogue(vehicle, with_streams(FAST_ATTITUDE, depth=depth)).run()
    assert dialogue.agent.error is None
    assert dialogue.agent.status().safe_setpoints == 0


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("late_ms", [0, 10, 20])
def test_a_position_later_than_the_attitude_of_its_stamp_counts_for_its_own_moment(depth, late_ms):
    """The vehicle drifts by 0.4 m/s: taken for a position of now, one of 20 ms ago would be 8 mm off."""
    dialogue = flying(depth, position_late_ms=late_ms)
    dialogue.vehicle.drift_m_s = 0.4
    row = dialogue.run_for(1.0).agent.take_trace()[-1]
    west_m, late_m = -dialogue.vehicle.east_m, 0.4 * late_ms / 1000
    assert row.vehicle_stamp_us == dialogue.vehicle.boot_ms * 1000
    if depth == "attitude":  # stepped by the position itself
        assert row.measured[3] == pytest.approx(west_m + late_m, abs=1e-6)
        assert row.zeta_hat[3][0] == pytest.approx(west_m + late_m, abs=0.004)
    else:
        assert row.measured[3] == pytest.approx(west_m + late_m + 0.004, abs=1e-6)
        assert row.zeta_hat[3][0] == pytest.approx(west_m, abs=0.004)
    assert row.zeta_hat[3][1] == pytest.approx(-0.4, abs=0.05)
    assert dialogue.agent.status().old_poses == 0


def test_a_position_is_no_setpoint_where_the_attitude_steps():
    dialogue = flying("rate")
    count = len(dialogue.setpoints)
    dialogue.vehicle.ticks += 1
    dialogue.deliver(dialogue.vehicle.position())
    assert len(dialogue.setpoints) == count
    dialogue.deliver(dialogue.vehicle.attitude())
    assert len(dialogue.setpoints) == count + 1
