"""What counts as a measurement, and when the pose is stale."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.guards import GuardParams, Tripped
from mavquad.flight.pose import PoseIntake
from mavquad.protocol.codec import mavlink

ATTITUDE_FIELDS = ("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
POSITION_FIELDS = ("x", "y", "z", "vx", "vy", "vz")


def attitude(stamp_ms=1000, **changes):
    return mavlink.MAVLink_attitude_message(stamp_ms, **{**dict.fromkeys(ATTITUDE_FIELDS, 0.1), **changes})


def position(stamp_ms=1000, **changes):
    return mavlink.MAVLink_local_position_ned_message(stamp_ms, **{**dict.fromkeys(POSITION_FIELDS, 0.1), **changes})


def intake(stale_pose_s=0.1):
    return PoseIntake(
        GuardParams(
            stale_attitude_s=stale_pose_s,
            stale_attitude_at_torque_s=stale_pose_s,
            stale_position_s=stale_pose_s,
            late_position_s=stale_pose_s,
        )
    )


BOTH = pytest.mark.parametrize(("kind", "message"), [("attitude", attitude), ("position", position)])


def take(pose, kind, message, now_us=0):
    return getattr(pose, f"take_{kind}")(message, now_us)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("kind", "message", "field"),
    [("attitude", attitude, f) for f in ATTITUDE_FIELDS] + [("position", position, f) for f in POSITION_FIELDS],
)
def test_a_value_that_is_not_finite_trips_and_is_not_kept(kind, message, field, value):
    pose = intake()
    good = take(pose, kind, message(1000))
    tripped = take(pose, kind, message(1010, **{field: value}))
    assert isinstance(tripped, Tripped)
    assert tripped.name == "NaN"
    assert getattr(pose, kind) is good


@BOTH
def test_a_newer_one_is_kept_with_the_vehicles_stamp(kind, message):
    pose = intake()
    for stamp_ms in (1000, 1001, 5000):
        assert take(pose, kind, message(stamp_ms)).stamp_us == stamp_ms * 1000
    assert getattr(pose, kind).stamp_us == 5_000_000
    assert pose.old == 0


@BOTH
@pytest.mark.parametrize("stamp_ms", [1000, 999, 0])
def test_an_old_or_repeated_one_is_counted_and_not_used(kind, message, stamp_ms):
    pose = intake()
    first = take(pose, kind, message(1000), 100)
    assert take(pose, kind, message(stamp_ms), 200) is None
    assert pose.old == 1
    assert getattr(pose, kind) is first


@pytest.mark.parametrize("first", ["attitude", "position"])
def test_the_stale_deadline_is_that_of_the_older_stream(first):
    pose = intake(0.25)
    messages = {"attitude": attitude, "position": position}
    other = next(kind for kind in messages if kind != first)
    take(pose, first, messages[first](), 1000)
    assert pose.stale_deadline_us() < 0
    take(pose, other, messages[other](), 5000)
    assert pose.stale_deadline_us() == 1000 + 250_000


@BOTH
def test_old_and_repeated_ones_do_not_put_the_deadline_off(kind, message):
    pose = intake()
    take(pose, "attitude", attitude(), 0)
    take(pose, "position", position(), 0)
    other = "position" if kind == "attitude" else "attitude"
    take(pose, other, {"attitude": attitude, "position": position}[other](2000), 50_000)
    take(pose, kind, message(1000), 60_000)
    assert pose.stale_deadline_us() == 100_000


def test_stale_at_the_deadline_and_not_a_step_before_it():
    pose = intake()
    take(pose, "attitude", attitude(), 40_000)
    take(pose, "position", position(), 20_000)
    deadline_us = pose.stale_deadline_us()
    assert pose.stale(deadline_us - 4) is None
    assert pose.stale(deadline_us).words == "no LOCAL_POSITION_NED for 0.10 s, 0.1 s allowed"
    assert pose.stale(200_000).words == "no ATTITUDE for 0.16 s, 0.1 s allowed"


def test_nothing_ever_heard_is_stale():
    assert intake().stale(0).name == "stale pose"


def test_a_backlog_is_old_however_it_arrives():
    pose = intake()
    for k in range(100):
        take(pose, "position", position(10 * k), now_us=10_000 * k + 3_000)
    # The loop stalls for 0.3 s; then all that waited is read at once: what is older than 0.1 s is no measurement.
    late_us = 990_000 + 300_000 + 3_000
    used = [take(pose, "position", position(1000 + 10 * k), now_us=late_us) for k in range(30)]
    assert [item is not None for item in used].index(True) in (19, 20)
    assert used[-1] is not None
    assert pose.old in (19, 20)


def test_a_reboot_starts_over_on_the_ground_only():
    pose = intake()
    take(pose, "position", position(50_000), now_us=50_000_000)
    pose.may_restart = False
    assert take(pose, "position", position(10), now_us=50_010_000) is None
    pose.may_restart = True
    assert take(pose, "position", position(20), now_us=50_020_000) is not None


def test_a_simulator_that_stalls_with_its_clock_is_not_old():
    """Five stalls of 80 ms: each shifts arrival minus stamp for good; TIMESYNC sees them, the running minimum does not."""

    def fresh(age_us):
        pose = PoseIntake(GuardParams(), age_us)
        stalled_us, accepted = 0, []
        for number in range(200):
            stamp_us = 1_000_000 + number * 10_000
            stalled_us += 80_000 if number in (20, 40, 60, 80, 100) else 0
            message = mavlink.MAVLink_attitude_message(stamp_us // 1000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            accepted.append(pose.take_attitude(message, stamp_us + 500_000 + stalled_us) is not None)
        return all(accepted)

    assert not fresh(lambda stamp_us, now_us: None)
    assert fresh(lambda stamp_us, now_us: 4_000)
    assert not fresh(lambda stamp_us, now_us: 300_000)
