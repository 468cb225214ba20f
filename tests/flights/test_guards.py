"""Every guard ends a flight of the real agent, on either personality: named, the mode change first, safe setpoints until
HEARTBEAT shows it, and none after it; and every reaction leaves the vehicle where it says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from mavquad.protocol.codec import Encoder, Message, decode, mavlink, message_id
from sitl_mock.config.faults import faults_of
from tests.bench.safety_flight import ended
from tests.bench.scenarios import ARDUCOPTER, PX4_1_13, PX4_1_16, Craft
from tests.support import LockstepFlight, prepare, run

SHORT = {"mission.name": '"hover"', "mission.duration_s": 6.0, "flight.settle_s": 0.5, "flight.takeoff_m": 1.5}
SETPOINTS = (mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET, mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET)
ON_ALL = {"from_s": 0.0}
NOW = {"at_s": 0.0}
WIND = {"mock.wind_ned_m_s": [5.0, 0.0, 0.0]}

TIGHT_LINK = {"guards.link_loss.slower_s": 0.08}

Act = Callable[[LockstepFlight], None]


def nothing(flight: LockstepFlight) -> None:
    """The configuration or the fault does it."""


@dataclass(frozen=True)
class Case:
    """What trips a guard.

    Attributes:
        guard: its name in the outcome, and words of it.
        keys: of the configuration.
        fault: of the mock, half a second after the law took over.
        act: done then.
        before: done all along, every tenth of a second, until then.
    """

    guard: str
    keys: dict[str, object] = field(default_factory=dict)
    fault: dict[str, object] = field(default_factory=dict)
    act: Act = nothing
    before: Act = nothing


def runs_for(flight: LockstepFlight, seconds: float) -> None:
    end_us = flight.lockstep.now_us + round(seconds * 1e6)
    flight.lockstep.run(lambda: flight.agent.done or flight.lockstep.now_us >= end_us, 1e6)


def say(flight: LockstepFlight, message: Message, sender: Encoder) -> None:
    """A frame arrives at the agent."""
    flight.lockstep.near.datagram(sender.encode(message), flight.lockstep.now_us)


def tell_unfit(flight: LockstepFlight) -> None:
    """The autopilot's estimator has lost its position, it says, for half a second."""
    fit = mavlink.ESTIMATOR_ATTITUDE | mavlink.ESTIMATOR_VELOCITY_VERT | mavlink.ESTIMATOR_POS_VERT_ABS
    if flight.config.mock["autopilot"] == "ardupilot":
        message = mavlink.MAVLink_ekf_status_report_message(fit, *(0.1,) * 5)
    else:
        message = mavlink.MAVLink_estimator_status_message(0, fit, *(0.1,) * 8)
    fail(flight, stops(message.get_type()))
    sender = Encoder(1, 1)
    for _ in range(6):
        say(flight, message, sender)
        runs_for(flight, 0.1)


def ground_station(flight: LockstepFlight) -> None:
    heartbeat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
    say(flight, heartbeat, Encoder(255, 190))


def leaves_late(flight: LockstepFlight) -> None:
    for _ in range(5):
        flight.lockstep.command("late", flight.agent.late, 150_000.0)
        runs_for(flight, 0.15)


def moves_twice(flight: LockstepFlight) -> None:
    """By less than what the jump guard takes for a reset."""
    for _ in range(2):
        fail(flight, {"kind": "estimator_reset", "offset_ned_m": [0.45, 0.0, 0.0], **NOW})
        runs_for(flight, 0.1)


def fail(flight: LockstepFlight, fault: dict[str, object]) -> None:
    flight.mock.fail(*faults_of([fault], "test"))


def no_number(flight: LockstepFlight) -> None:
    flight.agent.law.controls = lambda command: (0.0, math.nan, 0.0, 0.5)


def stops(message: str) -> dict[str, object]:
    return {"kind": "stream_stops", "message": message, **ON_ALL}


CASES = {
    "tilt": Case("tilt", {"guards.tilt_deg": 5.5, "law.limits.tilt_max_deg": 5.0, **WIND}),
    "volume": Case("volume", {"guards.radius_m": 0.6}, act=moves_twice),
    "speed": Case("speed", {"guards.speed.limit_m_s": 0.4, "mission.name": '"goto"', "mission.hover_s": 0.5}),
    "jump": Case("jump", {}, {"kind": "estimator_reset", "offset_ned_m": [1.0, 0.0, 0.0], **NOW}),
    "estimator": Case("estimator", act=tell_unfit),
    "sigma": Case("sigma", {"guards.sigma.wind_m_s2": 0.5, **WIND}),
    "innovation": Case("innovation", {"guards.innovation.position_m": 0.001, "guards.innovation.for_s": 0.02}),
    "battery": Case("battery", {"guards.battery.for_s": 0.2}, {"kind": "low_battery", "remaining": 0.13, **NOW}),
    "link loss": Case(
        "link loss': ",
        {"guards.link_loss.share": 0.2},
        {"kind": "drop", "direction": "from_vehicle", "probability": 0.4, **ON_ALL},
    ),
    "round trip": Case("link loss': a round trip", TIGHT_LINK, {"kind": "delay", "delay_ms": 60.0, **ON_ALL}),
    "GCS loss": Case("GCS loss", {"guards.gcs_loss.silent_s": 1.0}, before=ground_station),
    "rate": Case(
        "rate': LOCAL_POSITION_NED comes at",
        {},
        {"kind": "drop", "message": "LOCAL_POSITION_NED", "probability": 0.65, **ON_ALL},
    ),
    "lateness": Case("lateness", {}, {}, leaves_late),
    "NaN of the pose": Case("NaN': LOCAL_POSITION_NED", {}, {"kind": "nan_pose", **ON_ALL}),
    "NaN of the law": Case("NaN': the law", {}, {}, no_number),
    "stale attitude": Case("stale pose': no ATTITUDE", {}, stops("ATTITUDE")),
    "stale position": Case("stale pose': no LOCAL_POSITION_NED", {}, stops("LOCAL_POSITION_NED")),
}


def fly(craft: Craft, case: Case, **more: object) -> LockstepFlight:
    """Fly until the guard has tripped and the agent is done."""
    flight = prepare({**SHORT, **craft.keys, **case.keys, **more})
    while flight.agent.phase.value not in ("flying", "done"):
        case.before(flight)
        run(flight, (flight.lockstep.now_us - 1_577_836_800_000_000) * 1e-6 + 0.1, until="flying")
        assert flight.seconds < 60.0, flight.agent.phase
    runs_for(flight, 0.5)
    if case.fault:
        fail(flight, case.fault)
    case.act(flight)
    run(flight)
    return flight


def handed_back(flight: LockstepFlight) -> None:
    """The mode change went first; then safe setpoints, every 20 ms, until HEARTBEAT showed a mode that is not ours."""
    tripped_us = next(note.stamp_us for note in flight.notes if note.text.startswith("guard '"))
    after = [record for record in flight.recording.records if record.stamp_us >= tripped_us]
    sent = [record for record in after if record.outbound]
    ids = [message_id(record.frame) for record in sent if message_id(record.frame) not in (0, 111)]
    assert ids[0] == mavlink.MAVLINK_MSG_ID_COMMAND_LONG
    assert ids[1] in SETPOINTS
    safe = [record for record in sent if message_id(record.frame) in SETPOINTS]
    assert len(safe) == flight.agent.status().safe_setpoints
    assert all(is_safe(decode(record.frame)) for record in safe)
    assert all(later.stamp_us - record.stamp_us <= 20_100 for record, later in pairwise(safe))
    assert safe[-1].stamp_us <= released_us(flight, tripped_us) <= safe[-1].stamp_us + 20_100


def is_safe(setpoint: Message) -> bool:
    """No rotation, hover thrust."""
    if setpoint.get_type() == "SET_ACTUATOR_CONTROL_TARGET":
        return list(setpoint.controls[:3]) == [0.0, 0.0, 0.0] and 0.2 < setpoint.controls[3] < 0.8
    rates = (setpoint.body_roll_rate, setpoint.body_pitch_rate, setpoint.body_yaw_rate)
    return setpoint.type_mask == 0x80 and rates == (0.0, 0.0, 0.0) and 0.2 < setpoint.thrust < 0.8


def released_us(flight: LockstepFlight, since_us: int) -> int:
    """When the first HEARTBEAT came that shows another mode than the one that takes our setpoints."""
    heartbeats = [
        (record.stamp_us, decode(record.frame))
        for record in flight.recording.records
        if not record.outbound and message_id(record.frame) == 0 and record.stamp_us >= since_us
    ]
    ours = 4 if heartbeats[0][1].autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA else 6 << 16
    return next(stamp_us for stamp_us, heartbeat in heartbeats if heartbeat.custom_mode != ours)


@pytest.mark.parametrize("craft", [PX4_1_16, ARDUCOPTER], ids=lambda craft: craft.name)
@pytest.mark.parametrize("name", CASES)
def test_each_guard(craft: Craft, name: str) -> None:
    flight = fly(craft, CASES[name])
    assert flight.exit_code == 4
    assert flight.agent.error is not None
    assert flight.agent.error.message.startswith(f"guard '{CASES[name].guard}")
    handed_back(flight)
    assert ended(flight) == "landed"


def test_at_depth_torque_the_mode_change_is_asked_for_a_twentieth_of_a_second_after_the_last_attitude() -> None:
    flight = fly(PX4_1_13, Case("stale pose", {}, stops("ATTITUDE")))
    attitudes = [r.stamp_us for r in flight.recording.records if not r.outbound and message_id(r.frame) == 30]
    tripped_us = next(note.stamp_us for note in flight.notes if note.text.startswith("guard 'stale pose': no ATTITUDE"))
    assert 0.045 < (tripped_us - attitudes[-1]) * 1e-6 <= 0.05
    handed_back(flight)
    assert ended(flight) == "landed"


def sticks(flight: LockstepFlight) -> None:
    """A pilot's, all in the middle: without one PX4 does not enter POSCTL."""
    centred = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)
    flight.lockstep.far.datagram(Encoder(255, 190).encode(centred), flight.lockstep.now_us)


def jump_beside_a_pilot(flight: LockstepFlight) -> None:
    sticks(flight)
    runs_for(flight, 0.1)
    sticks(flight)
    fail(flight, CASES["jump"].fault)


REACTIONS = {
    "hold": {"PX4 1.16": ("holds", "AUTO.LOITER"), "ArduCopter 4.7": ("holds", "BRAKE")},
    "land": {"PX4 1.16": ("landed", "AUTO.LAND"), "ArduCopter 4.7": ("landed", "LAND")},
    "return": {"PX4 1.16": ("landed", "AUTO.RTL"), "ArduCopter 4.7": ("landed", "RTL")},
}


@pytest.mark.parametrize("craft", [PX4_1_16, ARDUCOPTER], ids=lambda craft: craft.name)
@pytest.mark.parametrize("reaction", REACTIONS)
def test_each_reaction(craft: Craft, reaction: str) -> None:
    flight = fly(craft, CASES["jump"], **{"guards.jump.reaction": f'"{reaction}"'})
    end, mode = REACTIONS[reaction][craft.name]
    handed_back(flight)
    assert mode in [note.text for note in flight.notes if note.kind == "mode"]
    phases = [note.text for note in flight.notes if note.kind == "phase"]
    assert ("landing" in phases) is (reaction in ("land", "return"))
    assert ended(flight) == end


@pytest.mark.parametrize(("craft", "mode"), [(PX4_1_16, "POSCTL"), (ARDUCOPTER, "LOITER")], ids=["PX4", "ArduCopter"])
def test_the_reaction_that_hands_it_to_the_pilot(craft: Craft, mode: str) -> None:
    flight = fly(craft, Case("jump", act=jump_beside_a_pilot, before=sticks), **{"guards.jump.reaction": '"pilot"'})
    handed_back(flight)
    assert flight.agent.error is not None
    assert flight.agent.error.message.startswith("guard 'jump'")
    assert "landing" not in [note.text for note in flight.notes]
    assert flight.mock.truth().mode == mode
    assert flight.mock.truth().armed


def test_where_no_pilot_is_px4_refuses_his_mode_and_is_landed() -> None:
    flight = fly(PX4_1_16, CASES["jump"], **{"guards.jump.reaction": '"pilot"'})
    assert flight.agent.error is not None
    assert "then POSCTL" in flight.agent.error.message or "mode POSCTL" in flight.agent.error.message
    assert ended(flight) == "landed"
