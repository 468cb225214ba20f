"""Missions: where the box leads, which way it turns, when it ends."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.control.reference import Pose
from mavquad.flight.mission import Mission, MissionParams, stops

ORIGIN = Pose((10.0, 20.0, 3.0), 0.5)
START_US = 7_000_000
BOX = MissionParams(name="box", hover_s=2.0, side_m=2.0, turn_deg=90.0, dwell_s=0.5)
MISSION = Mission(BOX, ORIGIN, START_US)


def pose_at(mission, seconds):
    """(x, y, z, yaw) relative to the start, NWU."""
    reference = mission.reference(START_US + round(seconds * 1e6))
    (z, *_), (yaw, *_), (x, *_), (y, *_) = reference.channels()
    return (x - 10.0, y - 20.0, z - 3.0, yaw - 0.5)


def visited(mission):
    """The poses at rest, in order."""
    found = []
    for step in range(round(mission.duration_s * 20) + 1):
        reference = mission.reference(START_US + step * 50_000)
        if all(channel[1] == 0.0 for channel in reference.channels()):
            pose = tuple(round(value, 9) + 0.0 for value in pose_at(mission, step * 0.05))
            if not found or found[-1] != pose:
                found.append(pose)
    return found


def test_the_box_goes_north_then_east_turns_clockwise_there_and_goes_home():
    turned = round(-math.pi / 2, 9)
    assert visited(MISSION) == [
        (0.0, 0.0, 0.0, 0.0),
        (2.0, 0.0, 0.0, 0.0),
        (2.0, -2.0, 0.0, 0.0),
        (2.0, -2.0, 0.0, turned),
        (0.0, -2.0, 0.0, turned),
        (0.0, 0.0, 0.0, turned),
    ]


def test_yaw_never_rises():
    yaws = [pose_at(MISSION, step * 0.02)[3] for step in range(round(MISSION.duration_s * 50))]
    assert all(later <= earlier + 1e-12 for earlier, later in pairwise(yaws))
    assert yaws[-1] == pytest.approx(-math.pi / 2)


def test_the_hover_stays():
    mission = Mission(MissionParams(name="hover", hover_s=3.0), ORIGIN, START_US)
    assert visited(mission) == [(0.0, 0.0, 0.0, 0.0)]
    assert mission.duration_s == 3.0


def test_it_hovers_first():
    assert pose_at(MISSION, 2.0) == (0.0, 0.0, 0.0, 0.0)
    assert pose_at(MISSION, 2.9)[0] > 0.0


def test_its_own_end():
    end_us = START_US + round(MISSION.duration_s * 1e6)
    assert not MISSION.over(end_us - 4)
    assert MISSION.over(end_us + 4)
    assert MISSION.elapsed_s(START_US + 1_500_000) == 1.5


def test_a_shorter_duration_cuts_it():
    cut = Mission(BOX.model_copy(update={"duration_s": 1.0}), ORIGIN, START_US)
    assert not cut.over(START_US + 999_996)
    assert cut.over(START_US + 1_000_000)


def test_a_longer_duration_holds_the_last_pose():
    held = Mission(BOX.model_copy(update={"duration_s": 1000.0}), ORIGIN, START_US)
    assert not held.over(START_US + 999_000_000)
    assert pose_at(held, 999.0) == pytest.approx((0.0, 0.0, 0.0, -math.pi / 2))


def test_stops_in_ned():
    assert [stop.offset_ned_m for stop in stops(BOX)] == [
        (0, 0, 0),
        (2, 0, 0),
        (2, 2, 0),
        (2, 2, 0),
        (0, 2, 0),
        (0, 0, 0),
    ]
    assert [stop.turn_deg for stop in stops(BOX)] == [0, 0, 0, 90, 90, 90]
    assert [stop.stay_s for stop in stops(BOX)] == [2.0, 0.5, 0.5, 0.5, 0.5, 0.5]


@given(st.floats(0.0, 1.0))
def test_the_reference_keeps_to_its_speed(share):
    reference = MISSION.reference(START_US + round(share * MISSION.duration_s * 1e6))
    speed = math.hypot(reference.x_m[1], reference.y_m[1], reference.z_m[1])
    assert speed <= BOX.reference.speed_max_m_s + 1e-9
    assert abs(reference.yaw_rad[1]) <= math.radians(BOX.reference.yaw_rate_max_deg_s) + 1e-9
