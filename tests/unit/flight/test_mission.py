"""Missions: where the box leads, which way it turns, when it ends."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

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


def mission_of(**keys):
    return Mission(MissionParams(hover_s=1.0, **keys), ORIGIN, START_US)


SHAPES = {
    "box": {"name": "box"},
    "box, path": {"name": "box", "yaw": "path", "repeat": 2},
    "goto": {"name": "goto", "offset_ned_m": (30.0, 40.0, -2.0), "offset_turn_deg": -90.0},
    "circle": {"name": "circle", "repeat": 3, "yaw": "path"},
    "eight": {"name": "figure_eight"},
    "level eight, path": {"name": "figure_eight", "plane": "horizontal", "yaw": "path", "period_s": 30.0},
    "waypoints": {"name": "waypoints", "waypoints_ned_m": ((3.0, 0.0, 0.0), (3.0, 3.0, -1.0), (0.0, 0.0, 0.0))},
    "waypoints, path": {"name": "waypoints", "waypoints_ned_m": ((3.0, 0.0, 0.0), (3.0, 3.0, -1.0)), "yaw": "path"},
    "file": {
        "name": "file",
        "repeat": 2,
        "points": tuple((0.5 * k, 1.0 + math.sin(0.2 * k), 0.1 * k, -0.05 * k, 10.0 * k) for k in range(20)),
    },
}


@pytest.mark.parametrize("keys", SHAPES.values(), ids=SHAPES)
def test_all_channels_have_four_continuous_derivatives_from_rest_to_rest(keys):
    mission, h = mission_of(**keys), 1000
    end = START_US + round(mission.duration_s * 1e6)
    for stamp in (START_US - 5, START_US, START_US + 900_000, end - 4, end, end + 100_000_000):
        assert all(channel[1:] == (0.0,) * 4 for channel in mission.reference(stamp).channels())
    for stamp in range(START_US, end, 70_003):
        before, now, after = (mission.reference(stamp + d).channels() for d in (-h, 0, h))
        for a, b, c in zip(before, now, after, strict=True):
            for order in range(4):
                slope = (c[order] - a[order]) / (2e-6 * h)
                # The fourth derivative has corners: there the slope of the third is off by their size times h.
                assert slope == pytest.approx(b[order + 1], abs=0.03 if order == 3 else 2e-4)
    positions = [mission.reference(stamp).channels() for stamp in range(START_US, end, 10_000)]
    for before, after in pairwise(positions):
        assert [abs(q[0] - p[0]) < 0.02 for p, q in zip(before, after, strict=True)] == [True] * 4


@pytest.mark.parametrize("keys", SHAPES.values(), ids=SHAPES)
def test_the_order_of_asking_does_not_matter(keys):
    mission = mission_of(**keys)
    stamps = [START_US + round(mission.duration_s * 1e6 * k / 50) for k in range(-3, 54)]
    forwards = [mission.reference(stamp) for stamp in stamps]
    assert [mission.reference(stamp) for stamp in reversed(stamps)][::-1] == forwards
    assert [mission_of(**keys).reference(stamp) for stamp in stamps] == forwards


@pytest.mark.parametrize("keys", SHAPES.values(), ids=SHAPES)
def test_where_it_begins_is_where_the_law_took_over(keys):
    assert pose_at(mission_of(**keys), 0.5) == (0.0, 0.0, 0.0, 0.0)


def test_goto_goes_there_and_turns_on_its_way():
    mission = mission_of(**SHAPES["goto"])
    assert pose_at(mission, mission.duration_s) == pytest.approx((30.0, -40.0, 2.0, math.pi / 2))
    middle = mission.reference(START_US + round(mission.duration_s * 5e5))
    assert math.hypot(middle.x_m[1], middle.y_m[1], middle.z_m[1]) == pytest.approx(1.5)


def test_laps_of_the_circle_end_where_they_began_having_looked_along_all_the_way():
    mission = mission_of(name="circle", repeat=3, yaw="path", radius_m=2.0, direction="counterclockwise")
    x, y, z, yaw = pose_at(mission, mission.duration_s)
    assert (x, y, z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert yaw + 0.5 == pytest.approx(3 * math.tau)  # northwards again, three turns later
    highest = max(-pose_at(mission, 0.05 * k)[1] for k in range(round(mission.duration_s * 20)))
    assert highest == pytest.approx(0.0, abs=1e-9)
    assert min(-pose_at(mission, 0.05 * k)[1] for k in range(round(mission.duration_s * 20))) == pytest.approx(
        -4.0, abs=1e-3
    )


def test_before_a_path_it_turns_towards_it_the_shorter_way():
    for yaw, change in ((3.0, -3.0), (-3.0, 3.0), (2 * math.tau + 1.0, -1.0)):
        origin = Pose((0.0, 0.0, 0.0), yaw)
        mission = Mission(MissionParams(name="circle", yaw="path", hover_s=1.0), origin, START_US)
        turn_end = mission.spans()[0][1]
        turned = mission.reference(START_US + round(turn_end * 1e6) + 1)
        assert turned.yaw_rad[0] == pytest.approx(yaw + change)
        assert turned.x_m[0] == pytest.approx(0.0, abs=1e-9)
        along = mission.reference(START_US + round((turn_end + 6.0) * 1e6))
        assert math.cos(along.yaw_rad[0] - math.atan2(along.y_m[1], along.x_m[1])) == pytest.approx(1.0)


def test_a_box_that_looks_where_it_goes_turns_at_each_corner():
    mission = mission_of(name="box", yaw="path")
    quarter = math.pi / 2
    found = [(round(x, 6), round(y, 6), round((yaw + 0.5) / quarter, 6)) for x, y, _, yaw in visited(mission)[1:]]
    assert found == [(2, 0, 0), (2, -2, -1), (0, -2, -2), (0, 0, -3)]


def test_a_box_flown_twice_turns_twice():
    mission = Mission(BOX.model_copy(update={"repeat": 2}), ORIGIN, START_US)
    assert len(visited(mission)) == 11
    assert pose_at(mission, mission.duration_s) == pytest.approx((0.0, 0.0, 0.0, -math.pi))
    assert mission.duration_s == pytest.approx(2 * MISSION.duration_s - BOX.hover_s)


def test_a_way_straight_up_keeps_the_yaw():
    mission = mission_of(name="goto", offset_ned_m=(0.0, 0.0, -3.0), yaw="path")
    assert pose_at(mission, mission.duration_s) == pytest.approx((0.0, 0.0, 3.0, 0.0))


def passes(mission, place):
    """How near it comes to a place, relative to the start in NWU."""
    return min(math.dist(pose_at(mission, 0.005 * k)[:3], place) for k in range(round(mission.duration_s * 200)))


def test_waypoints_are_passed_without_a_stop_and_as_briskly_as_allowed():
    mission = mission_of(**SHAPES["waypoints"])
    for place in ((3.0, 0.0, 0.0), (3.0, -3.0, 1.0)):
        assert passes(mission, place) < 0.01
    assert pose_at(mission, mission.duration_s)[:3] == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    points = [mission.reference(START_US + k * 5000) for k in range(round(mission.duration_s * 200))]
    shares = [
        max(math.hypot(p.x_m[order], p.y_m[order], p.z_m[order]) for p in points) / limit
        for order, limit in ((1, 1.5), (2, 1.2), (3, 2.5), (4, 8.0))
    ]
    assert max(shares) <= 1.0
    assert max(shares) > 0.98
    assert visited(mission) == [(0.0, 0.0, 0.0, 0.0)]


def test_waypoints_again_and_again():
    once, twice = mission_of(**SHAPES["waypoints"]), mission_of(**SHAPES["waypoints"], repeat=2)
    assert twice.duration_s > 1.6 * once.duration_s
    assert visited(twice) == [(0.0, 0.0, 0.0, 0.0)]


def test_a_file_is_flown_on_its_own_clock_once_it_is_up_to_pace():
    rows = tuple((100.0 + k, 1.0 + 0.5 * k, 0.0, math.sin(0.3 * k)) for k in range(20))
    mission = mission_of(name="file", points=rows, ramp_s=2.0, dwell_s=0.5)
    begin_s = mission.spans()[1][0]
    assert pose_at(mission, begin_s) == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-9)
    for k in range(3, 17):
        t_s, north, east, down = rows[k]
        place = pose_at(mission, begin_s + (t_s - 100.0) + 1.0)  # half the ramp late
        assert place == pytest.approx((north, -east, -down, 0.0), abs=1e-6)
    assert pose_at(mission, mission.duration_s)[0] == pytest.approx(10.5)


def test_the_yaw_of_a_file_is_clockwise_and_goes_on_over_half_a_turn():
    rows = tuple((float(k), 0.1 * k, 0.0, 0.0, (20.0 * k + 180.0) % 360.0 - 180.0) for k in range(40))
    mission = mission_of(name="file", points=rows)
    assert pose_at(mission, mission.duration_s)[3] == pytest.approx(-math.radians(20.0 * 39))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"name": "file"}, "needs a file"),
        ({"name": "waypoints"}, "needs waypoints_ned_m"),
        ({"name": "waypoints", "waypoints_ned_m": ((0.0, 0.0, 0.0),)}, "needs waypoints_ned_m"),
        ({"name": "waypoints", "waypoints_ned_m": ((1.0, 0.0, 0.0),) * 20, "repeat": 99}, "1980 waypoints"),
        ({"name": "hover", "repeat": 2}, "repeat has no meaning"),
        ({"name": "goto", "repeat": 2}, "repeat has no meaning"),
        ({"points": ((0.0, 0.0, 0.0, 0.0),)}, "points, row 1: 1 rows"),
        ({"points": ((0.0, 0.0, 0.0, 0.0), (1.0, 9.0, 0.0, 0.0))}, "points, row 2: a jump of 9.00 m"),
        ({"name": "file", "yaw": "path", "points": ((0.0,) * 5, (1.0, 1.0, 0.0, 0.0, 0.0))}, "a yaw of its own"),
        ({"name": "circle", "radius_m": 0.0}, "greater than 0"),
        ({"name": "circle", "period_s": 0.0}, "greater than 0.5"),
        ({"waypoints_ned_m": ((math.nan, 0.0, 0.0),)}, "waypoints_ned_m"),
    ],
)
def test_what_cannot_be_planned_is_refused(keys, words):
    with pytest.raises(ValidationError, match=words):
        MissionParams(**keys)
