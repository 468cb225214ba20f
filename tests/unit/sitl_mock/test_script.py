"""Each scripted fault, seen from the far side."""

import itertools
import math

import pytest

from mavquad.endpoint import NEVER_US, advance
from mavquad.errors import ConfigError
from mavquad.protocol.codec import decode, frame_sequence, frame_source, frame_version, mavlink, message_id
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.config.faults import Silent
from sitl_mock.personality.px4.personality import Px4
from sitl_mock.world import World
from tests.unit.sitl_mock.conftest import NAN, START_US

ACCEPTED, TEMPORARILY_REJECTED, DENIED, FAILED = 0, 1, 2, 4


def test_refuse_so_many_times(pilot):
    p = pilot(faults=[{"kind": "refuse", "command": 400, "result": 1, "times": 2, "text": "No"}]).run(1.1).heartbeat()
    assert [p.command(400, 1)[0] for _ in range(3)] == [TEMPORARILY_REJECTED, TEMPORARILY_REJECTED, ACCEPTED]
    assert p.texts().count("No") == 2
    assert p.mock.armed


def test_acknowledge_without_acting(pilot):
    p = pilot(faults=[{"kind": "ack_without_acting", "command": 176}]).hover()
    p.torque()
    assert p.offboard() == [ACCEPTED]
    p.stream(lambda q: q.torque(), 1.0)
    assert p.mock.mode == "AUTO.LOITER"


def test_silent_for_a_while(pilot):
    p = pilot(faults=[{"kind": "silent", "from_s": 1.0, "for_s": 0.5}]).run(1.2)
    assert p.command(511, 30, 10000) == []
    p.run(1.0)
    stamps = p.stamps_us("ATTITUDE")
    gaps = [b - a for a, b in itertools.pairwise(stamps)]
    assert max(gaps) == pytest.approx(500_000, abs=20_000)


def test_one_stream_stops(pilot):
    p = pilot(faults=[{"kind": "stream_stops", "message": "LOCAL_POSITION_NED", "from_s": 1.0, "for_s": 1.0}]).run(3.0)
    assert not any(1e6 <= stamp < 2e6 for stamp in p.stamps_us("LOCAL_POSITION_NED"))
    assert len(p.messages("LOCAL_POSITION_NED")) == pytest.approx(60, abs=2)
    assert len(p.messages("ATTITUDE")) == pytest.approx(300, abs=2)


def test_nan_pose(pilot):
    p = pilot(faults=[{"kind": "nan_pose", "from_s": 1.0, "for_s": 0.5}]).run(2.0)
    for stamp, message in zip(p.stamps_us("LOCAL_POSITION_NED"), p.messages("LOCAL_POSITION_NED"), strict=True):
        assert math.isnan(message.x) == (1e6 <= stamp < 1.5e6)
    assert all(math.isfinite(message.roll) for message in p.messages("ATTITUDE"))


def test_dies_for_ever(pilot):
    p = pilot(faults=[{"kind": "die", "at_s": 1.0}]).run(3.0)
    assert max(stamp for stamp in p.stamps_us("ATTITUDE")) <= 1_000_000
    assert p.command(511, 30, 0) == []
    assert p.mock.next_deadline_us() == NEVER_US


def test_the_pilot_takes_over(pilot):
    p = pilot(faults=[{"kind": "mode_change", "at_s": 0.5, "mode": "POSCTL", "since": "offboard"}]).hover()
    p.torque()
    p.offboard()
    p.stream(lambda q: q.torque(), 0.4)
    assert p.mock.mode == "OFFBOARD"
    p.stream(lambda q: q.torque(), 0.2)
    assert p.mock.mode == "POSCTL"
    p.offboard()
    p.stream(lambda q: q.torque(), 0.6)
    assert p.mock.mode == "OFFBOARD"  # once only


def test_since_offboard_does_not_start_before(pilot):
    p = pilot(faults=[{"kind": "silent", "from_s": 0.0, "for_s": 9.0, "since": "offboard"}]).hover()
    assert len(p.run(1.0).messages("ATTITUDE")) == 100
    p.torque()
    p.offboard()
    p.forget()
    assert p.run(0.5).frames == []


def test_since_offboard_counts_from_when_it_is_armed_too(pilot):
    p = pilot(faults=[{"kind": "silent", "from_s": 0.0, "for_s": 9.0, "since": "offboard"}]).run(1.1)
    p.torque(thrust=0.0)
    p.offboard()
    assert p.mock.mode == "OFFBOARD"
    p.forget()
    assert p.stream(lambda q: q.torque(thrust=0.0), 0.5).frames != []
    p.command(400, 1)
    p.run(0.1)
    p.forget()
    assert p.stream(lambda q: q.torque(thrust=0.0), 0.5).frames == []


@pytest.mark.parametrize(
    ("fault", "key"),
    [
        ({"kind": "refuse"}, "faults.0.refuse.command"),
        ({"kind": "explode"}, "faults.0"),
        ({"kind": "stream_stops", "message": "NOPE", "from_s": 0, "for_s": 1}, "faults.0.stream_stops.message"),
        ({"kind": "silent", "from_s": -1.0, "for_s": 1.0}, "faults.0.silent.from_s"),
    ],
)
def test_bad_faults_are_refused(pilot, fault, key):
    with pytest.raises(ConfigError) as caught:
        pilot(faults=[fault])
    assert caught.value.key == key


def test_refused_by_name_only_in_its_window(pilot):
    p = pilot(
        faults=[{"kind": "refuse", "command": "REQUEST_MESSAGE", "result": "FAILED", "from_s": 1.0, "for_s": 1.0}]
    )
    assert p.command(512, 0) == [ACCEPTED]
    assert p.run(1.5).command(512, 0) == [FAILED]
    assert p.run(1.0).command(512, 0) == [ACCEPTED]


def test_a_late_answer_is_obeyed_at_once(pilot):
    p = pilot(faults=[{"kind": "late_answer", "command": "SET_MESSAGE_INTERVAL", "late_s": 0.5, "times": 1}]).run(1.0)
    assert p.command(511, 30, -1) == []
    asked_us = p.now_us - START_US
    p.forget()
    p.run(1.0)
    assert p.messages("ATTITUDE") == []
    assert [m.command for m in p.messages("COMMAND_ACK")] == [511]
    assert p.stamps_us("COMMAND_ACK")[0] - asked_us == pytest.approx(500_000, abs=4_000)
    assert p.command(511, 30, 0) == [ACCEPTED]


def test_deaf_and_talking(pilot):
    p = pilot(faults=[{"kind": "deaf", "from_s": 1.0, "for_s": 1.0}]).run(1.2)
    assert p.command(512, 0) == []
    p.forget()
    p.run(1.0)
    assert len(p.messages("ATTITUDE")) == 100
    assert p.command(512, 0) == [ACCEPTED]


def test_what_is_held_back_leaves_no_gap_in_the_numbers(pilot):
    p = pilot(faults=[{"kind": "stream_stops", "message": "ATTITUDE", "from_s": 0.2, "for_s": 0.5}]).run(1.0)
    sequence = [frame_sequence(frame) for _, frame in p.frames]
    assert sequence == [k % 256 for k in range(len(sequence))]


@pytest.mark.parametrize("jump_s", [5.0, -0.3])
def test_the_clock_jumps_and_nothing_else(pilot, jump_s):
    p, calm = (pilot(faults=f).run(2.0) for f in ([{"kind": "clock_jump", "at_s": 1.0, "jump_s": jump_s}], []))
    times_ms = {name: [m.time_boot_ms for m in p.messages(name)] for name in ("ATTITUDE", "LOCAL_POSITION_NED")}
    for name, told in times_ms.items():
        true = [m.time_boot_ms for m in calm.messages(name)]
        late = [(stamp >= 1_000_000) * round(jump_s * 1000) for stamp in calm.stamps_us(name)]
        assert told == [t + jump for t, jump in zip(true, late, strict=True)]
    assert p.stamps_us("ATTITUDE") == calm.stamps_us("ATTITUDE")
    asked_us = p.now_us + 400 - START_US
    (answer,) = p.send(mavlink.MAVLink_timesync_message(0, 7))
    assert (answer.ts1, answer.tc1) == (7, (asked_us + round(jump_s * 1e6)) * 1000)


def test_the_clock_jumps_once_on_every_port():
    config = parse_section(MockConfig, {"faults": [{"kind": "clock_jump", "jump_s": 100.0}]}, "test")
    mock = MockAutopilot(config, 1, START_US, ("onboard", "onboard"))
    for _ in advance(mock, START_US + 1_000_000):
        pass
    times_ms = [decode(frame).time_boot_ms for frame in mock.datagrams_to_send(1) if message_id(frame) == 30]
    assert 100_000 <= times_ms[0] < 100_020
    assert times_ms[-1] == pytest.approx(101_000, abs=20)


def test_a_clock_never_runs_below_zero(pilot):
    p = pilot(faults=[{"kind": "clock_jump", "at_s": 0.5, "jump_s": -100.0}]).run(1.0)
    assert p.messages("ATTITUDE")[-1].time_boot_ms == 0


def test_a_second_vehicle_with_the_same_id(pilot):
    twin = {"kind": "second_vehicle", "from_s": 1.0, "for_s": 2.0, "attitude_hz": 20.0}
    p, calm = pilot(faults=[twin]).run(4.0), pilot().run(4.0)
    ours = {frame for _, frame in calm.frames}
    strange = [(stamp - START_US, frame) for stamp, frame in p.frames if frame not in ours]
    assert ours < {frame for _, frame in p.frames}
    assert all(1_000_000 <= stamp < 3_000_000 for stamp, _ in strange)
    assert {frame_source(frame) for _, frame in strange} == {(1, 1)}
    kinds = [decode(frame).get_type() for _, frame in strange]
    assert (kinds.count("HEARTBEAT"), kinds.count("ATTITUDE")) == (2, 40)
    assert [frame_sequence(frame) for _, frame in strange] == list(range(42))


def test_forged_heartbeats_as_recorded_from_an_attack(pilot):
    forged = {"kind": "second_vehicle", "looks": "forged", "mavlink": 1, "heartbeat_hz": 170.0, "attitude_hz": 0.0}
    frames = [
        frame for _, frame in pilot(firmware="1.16", faults=[forged]).run(1.0).frames if frame_version(frame) == 1
    ]
    assert len(frames) == pytest.approx(170, abs=1)
    message = decode(frames[0])
    assert (message.type, message.autopilot, message.base_mode, message.system_status) == (0, 8, 0, 4)


def test_reboot_in_flight(pilot):
    p = pilot(faults=[{"kind": "reboot", "since": "takeoff", "at_s": 14.0, "down_s": 3.0}]).hover()
    p.run(10.0)
    silence = [b - a for a, b in itertools.pairwise(p.stamps_us("ATTITUDE"))]
    assert max(silence) == pytest.approx(3_000_000, abs=20_000)
    times_ms = [m.time_boot_ms for m in p.messages("ATTITUDE")]
    again = next(k for k, (a, b) in enumerate(itertools.pairwise(times_ms), 1) if b < a)
    assert times_ms[again] < 20
    assert times_ms[again:] == sorted(times_ms[again:])
    assert p.truth.crashed  # it fell from 2.5 m
    assert not p.truth.armed
    assert p.truth.position_ned_m[2] == pytest.approx(0.0, abs=0.01)


def test_reboot_on_the_ground_is_as_a_new_start(pilot):
    p = pilot(faults=[{"kind": "reboot", "at_s": 2.0, "down_s": 1.0}])
    p.run(0.5).command(511, 30, -1)
    p.run(1.5)
    p.forget()
    assert p.run(0.5).command(512, 0) == []  # it is away
    p.run(1.0)
    assert len(p.messages("ATTITUDE")) == pytest.approx(50, abs=4)
    assert frame_sequence(p.frames[0][1]) == 0
    assert p.run(1.1).command(400, 1) == [ACCEPTED]


@pytest.mark.parametrize(("autopilot", "name"), [("px4", b"MIS_TAKEOFF_ALT"), ("ardupilot", b"RTL_SPEED")])
def test_parameters_outlive_a_reboot(pilot, autopilot, name):
    p = pilot(autopilot=autopilot, faults=[{"kind": "reboot", "at_s": 2.0, "down_s": 1.0}]).run(1.0)
    p.send(mavlink.MAVLink_param_set_message(1, 1, name, 7.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.run(3.0).forget()
    p.send(mavlink.MAVLink_param_request_read_message(1, 1, name, -1))
    p.run(0.5)
    assert [m.param_value for m in p.messages("PARAM_VALUE") if m.param_id == name.decode()] == [7.0]


def test_a_dead_autopilots_vehicle_falls(pilot):
    p = pilot(faults=[{"kind": "die", "since": "takeoff", "at_s": 8.5}]).hover().run(3.0)
    assert p.truth.position_ned_m[2] == pytest.approx(0.0, abs=0.01)
    assert p.truth.crashed
    assert p.mock.next_deadline_us() == NEVER_US


@pytest.mark.parametrize(
    ("fault", "name", "arguments"),
    [
        ({"kind": "payload_drop"}, "drop_payload", ()),
        ({"kind": "weak_rotor", "rotor": 3, "share": 0.4}, "weaken_rotor", (3, 0.4)),
        ({"kind": "estimator_reset", "offset_ned_m": [1, 2, -3]}, "jump_position", ((1.0, 2.0, -3.0),)),
        ({"kind": "low_battery", "remaining": 0.1}, "drain_battery", (0.1,)),
        ({"kind": "wind_step", "change_ned_m_s": [4, 0, 0]}, "change_wind", ((4.0, 0.0, 0.0),)),
    ],
    ids=str,
)
def test_what_happens_to_the_world_happens_once_and_then(pilot, monkeypatch, fault, name, arguments):
    calls = []
    p = pilot(faults=[{**fault, "at_s": 1.0}])
    monkeypatch.setattr(World, name, lambda self, *given: calls.append((p.mock.truth().boot_us, given)))
    p.run(0.9)
    assert calls == []
    p.run(1.0)
    assert calls == [(1_000_000, arguments)]


def test_the_geofence_is_breached_once(pilot, monkeypatch):
    calls = []
    monkeypatch.setattr(Px4, "breach_geofence", lambda self: calls.append(1))
    p = pilot(faults=[{"kind": "geofence_breach", "since": "armed", "at_s": 1.0}]).run(1.1)
    p.command(400, 1)
    assert p.run(0.9) and calls == []
    assert p.run(3.0) and calls == [1]


def test_a_stronger_wind_is_felt(pilot):
    gust = {"kind": "wind_step", "since": "takeoff", "at_s": 9.0, "change_ned_m_s": [6.0, 0.0, 0.0]}
    windy, calm = (pilot(faults=faults).hover().run(4.0).truth for faults in ([gust], []))
    assert windy.euler_rad[1] > calm.euler_rad[1] + 0.1  # blown north, it leans back: nose up


@pytest.mark.parametrize(("since", "before_s"), [("armed", 0.0), ("takeoff", 1.0), ("AUTO.TAKEOFF", 0.0)])
def test_times_count_from_the_moment_that_is_named(pilot, since, before_s):
    p = pilot(faults=[{"kind": "silent", "since": since, "from_s": 1.0, "for_s": 0.5}]).run(1.1)
    p.command(400, 1)
    p.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
    moment_us = p.now_us - START_US
    p.run(6.0)
    gaps = [a for a, b in itertools.pairwise(p.stamps_us("ATTITUDE")) if b - a > 400_000]
    assert len(gaps) == 1
    assert gaps[0] - moment_us > (1.0 + before_s) * 1e6 - 20_000
    if since != "takeoff":
        assert gaps[0] - moment_us < 1_020_000


def test_without_faults_that_act_the_bytes_are_the_same(pilot):
    idle = [{"kind": kind, "from_s": 900.0} for kind in ("silent", "deaf", "nan_pose", "second_vehicle")]
    assert pilot(faults=idle).run(3.0).frames == pilot().run(3.0).frames


def test_a_fault_that_is_added_waits_for_its_moment_from_then_on(pilot):
    p = pilot().run(1.1)
    p.command(400, 1)
    p.run(3.0).mock.fail(Silent(kind="silent", since="armed", from_s=1.0, for_s=1.0), from_now=False)
    added_us = p.now_us - START_US
    p.forget()
    p.run(4.0)
    (gap_us,) = [a for a, b in itertools.pairwise(p.stamps_us("ATTITUDE")) if b - a > 500_000]
    assert gap_us - added_us == pytest.approx(1_000_000, abs=20_000)


def test_a_fault_that_is_added_counts_from_the_moment_that_is_given(pilot):
    p = pilot().run(2.0)
    p.mock.fail(Silent(kind="silent", for_s=0.5))
    p.forget()
    assert min(p.run(1.0).stamps_us("ATTITUDE")) == pytest.approx(2_500_000, abs=10_000)


@pytest.fixture
def copter(pilot):
    """An ArduCopter in GUIDED with these faults, ready to be armed."""

    def ready(*faults):
        p = pilot(autopilot="ardupilot", faults=faults).run(5.0)
        assert p.command(176, 1, 4) == [ACCEPTED]
        return p.run(2.0)

    return ready


def test_arducopter_refuses_and_acknowledges_without_acting(copter):
    p = copter(
        {"kind": "refuse", "command": "COMPONENT_ARM_DISARM", "result": "FAILED", "times": 1, "text": "No"},
        {"kind": "ack_without_acting", "command": "DO_SET_MODE", "since": "armed"},
    )
    assert p.command(400, 1) == [FAILED]
    assert not p.mock.armed
    assert "No" in p.texts()
    assert p.command(400, 1) == [ACCEPTED]
    assert p.mock.armed
    assert p.run(0.5).command(176, 1, 9) == [ACCEPTED]
    assert p.run(0.5).mock.mode == "GUIDED"


def test_arducopters_pilot_takes_over_after_guided(copter):
    p = copter({"kind": "mode_change", "mode": "STABILIZE", "since": "offboard", "at_s": 4.0})
    assert p.mock.mode == "GUIDED"
    p.run(3.0)
    assert p.mock.mode == "STABILIZE"


def test_arducopters_fence(copter):
    p = copter({"kind": "geofence_breach", "since": "takeoff", "at_s": 5.0})
    p.command(400, 1)
    p.run(3.0).command(22, 0, 0, 0, 0, 0, 0, 5.0)
    p.run(4.0)
    assert p.mock.mode == "GUIDED"
    p.run(5.0)
    assert p.mock.mode == "RTL"


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_twin_shows_the_same_autopilot(pilot, autopilot):
    p = pilot(autopilot=autopilot, faults=[{"kind": "second_vehicle", "heartbeat_hz": 50.0}]).run(2.0)
    assert len(p.messages("HEARTBEAT")) > 95
    assert len({message.autopilot for message in p.messages("HEARTBEAT")}) == 1
