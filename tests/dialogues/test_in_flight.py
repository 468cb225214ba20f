"""What ends the law's control in flight, what is sent then, and how the flight ends."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from mavquad.endpoint import GRID_US
from mavquad.errors import FlightEnded
from mavquad.flight.machine import Phase
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.protocol.firmware import px4
from tests.dialogues.peer import PARAMS, POSCTL, SETPOINT, Dialogue, heartbeat, with_law

POSITION_FIELDS = ("x", "y", "z", "vx", "vy", "vz")
ATTITUDE_FIELDS = ("roll", "pitch", "yaw")


def flying(vehicle=None, seconds=0.3, params=PARAMS):
    return Dialogue(vehicle, params).run(Phase.FLYING).run_for(seconds)


def handed_back(dialogue, at):
    """Mode change first, a safe setpoint at once and every 20 ms until HEARTBEAT shows the mode; landed with exit code 4."""
    after = [sent for sent in dialogue.sent[at:] if sent.name not in ("HEARTBEAT", "TIMESYNC")]
    assert [sent.name for sent in after[:2]] == ["loiter", SETPOINT]
    assert after[0].stamp_us == after[1].stamp_us
    dialogue.run()
    rest = [sent.name for sent in dialogue.sent[at:] if sent.name not in ("HEARTBEAT", "TIMESYNC")]
    safe = [sent for sent in dialogue.sent[at:] if sent.name == SETPOINT]
    assert all(list(sent.message.controls[:3]) == [0.0, 0.0, 0.0] for sent in safe)
    hover = dialogue.agent.status().hover_thrust_norm
    assert all(sent.message.controls[3] == pytest.approx(hover, abs=1e-6) for sent in safe)
    assert len(safe) == dialogue.agent.status().safe_setpoints
    assert all(later.stamp_us - sent.stamp_us == 20_000 for sent, later in pairwise(safe))
    assert all(sent.phase is Phase.HANDING_BACK for sent in safe)
    assert [name for name in rest if name != SETPOINT] == ["loiter", "land"]
    assert dialogue.phases[-5:] == ["flying", "handing back", "landing", "restoring", "done"]
    assert isinstance(dialogue.agent.error, FlightEnded)
    assert dialogue.agent.error.exit_code == 4
    assert not dialogue.vehicle.armed
    return after[0].stamp_us, dialogue.agent.error.message


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("name", POSITION_FIELDS + ATTITUDE_FIELDS)
def test_nan_in_a_pose_hands_back_at_once(name, value):
    dialogue = flying()
    at = len(dialogue.sent)
    message = dialogue.vehicle.position if name in POSITION_FIELDS else dialogue.vehicle.attitude
    dialogue.deliver(message(**{name: value}))
    heard_us = [stamp for stamp, _, outbound in dialogue.record if not outbound][-1]
    stamp_us, words = handed_back(dialogue, at)
    assert stamp_us == heard_us
    assert words.startswith("guard 'NaN'")
    assert ("LOCAL_POSITION_NED" if name in POSITION_FIELDS else "ATTITUDE") in words


@pytest.mark.parametrize(
    ("muted", "named"),
    [
        ({"LOCAL_POSITION_NED"}, "LOCAL_POSITION_NED"),
        ({"ATTITUDE"}, "ATTITUDE"),
        ({"ATTITUDE", "LOCAL_POSITION_NED"}, "ATTITUDE"),
    ],
)
def test_a_pose_stream_that_stops_hands_back_a_tenth_of_a_second_later(muted, named):
    dialogue = flying()
    dialogue.vehicle.muted |= muted
    ids = {"ATTITUDE": 30, "LOCAL_POSITION_NED": 32}
    heard = [stamp for stamp, frame, outbound in dialogue.record if not outbound and frame[7] == ids[named]]
    dialogue.run(Phase.HANDING_BACK)
    at = next(i for i, sent in enumerate(dialogue.sent) if sent.name == "loiter")
    stamp_us, words = handed_back(dialogue, at)
    assert stamp_us == heard[-1] + 100_000
    assert words.startswith(f"guard 'stale pose': no {named} for 0.10 s, 0.1 s allowed")


def test_a_pose_stream_that_comes_back_does_not_bring_the_law_back():
    dialogue = flying()
    dialogue.vehicle.muted = {"LOCAL_POSITION_NED"}
    dialogue.run(Phase.HANDING_BACK)
    dialogue.vehicle.muted = set()
    at = len(dialogue.sent)
    dialogue.run()
    setpoints = [sent.message for sent in dialogue.sent[at:] if sent.name == SETPOINT]
    assert all(list(message.controls[:3]) == [0.0, 0.0, 0.0] for message in setpoints)
    assert len(dialogue.agent.take_trace()) == dialogue.agent.status().setpoints_sent


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "trips"), [(64, 0, False), (66, 0, True), (0, -66, True), (50, 50, True)]
)
def test_the_tilt_guard(roll_deg, pitch_deg, trips):
    dialogue = flying(seconds=0.1)
    dialogue.vehicle.roll_rad, dialogue.vehicle.pitch_rad = math.radians(roll_deg), math.radians(pitch_deg)
    at = len(dialogue.sent)
    dialogue.step()
    if trips:
        _, words = handed_back(dialogue, at)
        assert words.startswith("guard 'tilt'")
    else:
        assert dialogue.agent.phase is Phase.FLYING


@pytest.mark.parametrize(
    ("east_m", "height_m", "words"),
    [(20.5, 2.5, "20.5 m from"), (0.0, 20.5, "height is 20.5 m"), (0.0, 0.4, "height is 0.4 m")],
)
def test_the_volume_guard(east_m, height_m, words):
    dialogue = flying(seconds=0.1)
    dialogue.vehicle.east_m, dialogue.vehicle.height_m = east_m, height_m
    dialogue.vehicle.ticks += 1
    at = len(dialogue.sent)
    dialogue.deliver(dialogue.vehicle.position())
    _, said = handed_back(dialogue, at)
    assert said.startswith("guard 'volume'")
    assert words in said


@pytest.mark.parametrize("mode", [POSCTL, px4.LOITER, px4.mode(4, 5), px4.LAND])
def test_not_one_frame_is_sent_after_the_pilot_took_over(mode):
    dialogue = flying()
    dialogue.vehicle.mode = mode
    dialogue.run(Phase.DONE, 1.1)
    at = len(dialogue.sent)
    dialogue.run_for(2.0)
    assert len(dialogue.sent) == at
    [seen_us] = [note.stamp_us for note in dialogue.notes if note.text == "done"]
    assert dialogue.sent[-1].stamp_us < seen_us
    error = dialogue.agent.error
    assert isinstance(error, FlightEnded)
    assert error.exit_code == 4
    assert f"took over: mode {mode.name} while flying" in error.message


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.ENGAGING, Phase.HANDING_BACK, Phase.LANDING])
def test_the_pilot_may_take_over_in_every_phase_of_the_flight(phase):
    dialogue = Dialogue().run(phase).run_for(0.02)
    dialogue.vehicle.mode = POSCTL
    dialogue.vehicle.answers = {
        "offboard": lambda vehicle: None,
        "loiter": lambda vehicle: None,
        "land": lambda vehicle: None,
    }
    dialogue.run(Phase.DONE, 1.1)
    at = len(dialogue.sent)
    dialogue.run_for(2.0)
    assert len(dialogue.sent) == at
    assert f"mode POSCTL while {phase.value}" in dialogue.agent.error.message
    assert dialogue.agent.error.exit_code == 4


def test_a_vehicle_that_falls_silent_in_flight_is_handed_back_then_lost():
    dialogue = flying()
    dialogue.powered = False
    dialogue.run()
    assert dialogue.phases[-3:] == ["flying", "handing back", "done"]
    assert dialogue.agent.error.exit_code == 4
    assert "stale pose" in dialogue.agent.error.message
    assert dialogue.setpoints[-1].stamp_us <= dialogue.sent[-1].stamp_us
    assert 100 < dialogue.agent.status().safe_setpoints < 200
    heard = max(stamp for stamp, _, outbound in dialogue.record if not outbound)
    assert dialogue.sent[-1].stamp_us <= heard + 3_500_000
    dialogue.deliver(dialogue.vehicle.position())
    assert dialogue.sent[-1].stamp_us <= heard + 3_500_000


@pytest.mark.parametrize(("phase", "code"), [(Phase.TAKING_OFF, 4), (Phase.LANDING, 4), (Phase.WAITING, 3)])
def test_a_vehicle_that_falls_silent_is_lost(phase, code):
    dialogue = Dialogue().run(phase)
    dialogue.powered = False
    dialogue.run()
    assert dialogue.agent.error.exit_code == code
    assert ("lost in flight" in dialogue.agent.error.message) is (code == 4)


def test_a_vehicle_that_disarms_in_flight_ends_it():
    dialogue = flying()
    dialogue.vehicle.armed = False
    dialogue.run(Phase.DONE, 1.1)
    assert "disarmed while flying" in dialogue.agent.error.message
    assert dialogue.agent.error.exit_code == 4


@pytest.mark.parametrize(
    ("measurements", "stepping", "other"), [("full", "attitude", "position"), ("position_yaw", "position", "attitude")]
)
def test_old_and_repeated_poses_make_no_setpoint(measurements, stepping, other):
    dialogue = flying(params=with_law(measurements=measurements))
    fresh = getattr(dialogue.vehicle, stepping)()
    sent, old = len(dialogue.of(SETPOINT)), dialogue.agent.status().old_poses
    dialogue.deliver(fresh)
    fresh.time_boot_ms -= 500
    dialogue.deliver(fresh)
    assert len(dialogue.of(SETPOINT)) == sent
    assert dialogue.agent.status().old_poses == old + 2
    fresh.time_boot_ms += 501
    dialogue.deliver(fresh)
    assert len(dialogue.of(SETPOINT)) == sent + 1
    newer = getattr(dialogue.vehicle, other)()
    newer.time_boot_ms += 1
    dialogue.deliver(newer)
    assert len(dialogue.of(SETPOINT)) == sent + 1
    assert dialogue.agent.status().old_poses == old + 2


@pytest.mark.parametrize("name", ["ATTITUDE", "LOCAL_POSITION_NED"])
def test_repeated_poses_do_not_keep_the_law_alive(name):
    dialogue = flying()
    frozen = dialogue.vehicle.attitude() if name == "ATTITUDE" else dialogue.vehicle.position()
    dialogue.vehicle.muted = {name}
    start_us = dialogue.now_us
    while dialogue.agent.phase is Phase.FLYING:
        dialogue.step()
        dialogue.deliver(frozen)
        assert dialogue.now_us < start_us + 200_000
    assert "stale pose" in dialogue.agent.error.message


def test_foreign_frames_do_not_disturb():
    dialogue = flying(seconds=0.1)
    sent, foreign = len(dialogue.sent), dialogue.agent.link.foreign
    vehicle = dialogue.vehicle
    forged = (
        heartbeat(mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR, POSCTL),
        vehicle.position(x=math.nan),
        vehicle.position(y=900.0),
        vehicle.attitude(roll=3.0),
        mavlink.MAVLink_timesync_message(0, 1),
    )
    dialogue.deliver(*forged, sender=Encoder(9, 1))
    dialogue.deliver(*forged, sender=Encoder(1, 191))
    assert len(dialogue.sent) == sent
    assert dialogue.agent.link.foreign == foreign + 10
    assert dialogue.run().agent.error is None


def test_an_attitude_that_stopped_before_the_hand_over_keeps_the_law_off():
    dialogue = Dialogue().run(Phase.TAKING_OFF)
    dialogue.vehicle.muted = {"ATTITUDE"}
    dialogue.run()
    assert SETPOINT not in dialogue.names()
    assert dialogue.names()[-1] == "land"
    stamps = [stamp for stamp, _, _ in dialogue.record]
    assert stamps == sorted(stamps)


def test_nan_before_the_law_is_on_ends_nothing():
    dialogue = Dialogue().run(Phase.TAKING_OFF)
    dialogue.deliver(dialogue.vehicle.position(x=math.nan))
    assert dialogue.agent.phase is Phase.TAKING_OFF


def test_the_stale_deadline_is_asked_for_while_the_law_is_on_alone():
    dialogue = Dialogue().run(Phase.TAKING_OFF).run_for(0.1)
    assert dialogue.agent.next_deadline_us() > dialogue.now_us + 100_000
    dialogue.run(Phase.FLYING).run_for(0.1)
    assert dialogue.agent.next_deadline_us() <= dialogue.now_us + 100_000 + 10 * GRID_US
