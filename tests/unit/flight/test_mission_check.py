"""Missions that must not be flown: which quantity, where, by how much."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, ReferenceParams
from mavquad.flight.guards import GuardParams
from mavquad.flight.mission import Mission, MissionParams
from mavquad.flight.mission_check import height_fault, mission_extent, mission_fault

BRISK = ReferenceParams(
    speed_max_m_s=20.0, acceleration_max_m_s2=15.0, jerk_max_m_s3=200.0, snap_max_m_s4=5000.0, yaw_rate_max_deg_s=360.0,
    yaw_acceleration_max_deg_s2=1000.0, yaw_jerk_max_deg_s3=20000.0, yaw_snap_max_deg_s4=500000.0,
)  # fmt: skip
WIDE = GuardParams(radius_m=1000.0, ceiling_m=1000.0)


def fault(guards=None, law=None, **keys):
    return mission_fault(MissionParams(**keys), guards or GuardParams(), law or LawParams())


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"yaw": "path"},
        {"name": "hover"},
        {"name": "goto"},
        {"name": "circle"},
        {"name": "circle", "yaw": "path", "repeat": 50},
        {"name": "figure_eight"},
        {"name": "figure_eight", "plane": "horizontal", "repeat": 3},
        {"name": "waypoints", "waypoints_ned_m": ((1.0, 0.0, 0.0),)},
    ],
    ids=str,
)
def test_missions_of_a_default_size_may_be_flown(keys):
    assert fault(**keys) is None


def test_fifty_metres_may_be_flown_where_there_is_room():
    far = {"name": "goto", "offset_ned_m": (30.0, -40.0, 0.0)}
    assert fault(guards=WIDE, **far) is None
    assert fault(**far) == (
        "mission.offset_ned_m puts the goal 50.0 m away, beyond guards.radius_m (20 m) by 30.0 m,"
        " 41.7 s into the mission"
    )


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"name": "box", "side_m": 15.0}, ("mission.side_m puts a corner 21.2 m away", "by 1.2 m")),
        ({"name": "circle", "radius_m": 11.0, "period_s": 90.0}, ("mission.radius_m", "22.0 m away", "by 2.0 m")),
        ({"name": "goto", "offset_ned_m": (0.0, 0.0, -25.0)}, ("25.0 m up and 0.0 m down", "guards.ceiling_m")),
        ({"name": "goto", "offset_ned_m": (0.0, 0.0, 25.0)}, ("0.0 m up and 25.0 m down", "5.5 m more")),
        ({"name": "circle", "period_s": 3.0}, ("3.142 m/s of speed", "1.64 m/s above mission.reference.speed_max_m_s")),
        ({"name": "circle", "period_s": 3.0}, ("mission.period_s and mission.ramp_s", "times as long would do")),
        (
            {"name": "circle", "period_s": 5.0, "radius_m": 1.0},
            ("1.579 m/s^2 of acceleration", "above mission.reference.acceleration_max_m_s2"),
        ),
        (
            {"name": "figure_eight", "plane": "horizontal", "yaw": "path"},
            ("110.4 deg/s of yaw rate", "65.4 deg/s above mission.reference.yaw_rate_max_deg_s"),
        ),
        ({"name": "figure_eight", "yaw": "path"}, ('mission.yaw = "path"', "reverses 3.00 s after its beginning")),
        (
            {"name": "waypoints", "waypoints_ned_m": ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "yaw": "path"},
            ("stands still or reverses",),
        ),
        (
            {"name": "circle", "period_s": 3.3, "radius_m": 4.0, "reference": BRISK},
            ("deg of tilt", "law.limits.tilt_max_deg"),
        ),
        (
            {"name": "figure_eight", "period_s": 7.0, "along_m": 0.1, "across_m": 2.3, "reference": BRISK},
            ("g of loss of thrust", "above 1 - law.limits.thrust_min_g"),
        ),
        (
            {"name": "goto", "offset_turn_deg": 179.0, "offset_ned_m": (0.0, 0.0, 0.0), "reference": BRISK},
            ("yaw acceleration (friction included)", "law.limits.yaw_acceleration_max_deg_s2"),
        ),
    ],
)
def test_what_is_too_much_is_named_with_its_place_and_excess(keys, words):
    said = fault(**keys)
    assert said is not None
    for part in words:
        assert part in said


def test_a_climb_needs_thrust():
    law = LawParams()
    weak = law.model_copy(update={"limits": law.limits.model_copy(update={"thrust_max_g": 1.2})})
    climb = {"name": "goto", "offset_ned_m": (0.0, 0.0, -5.0)}
    assert fault(**climb) is None
    said = str(fault(**climb, law=weak))
    assert "g of thrust" in said
    assert "above law.limits.thrust_max_g" in said


def test_a_turn_needs_its_acceleration_and_what_friction_takes():
    law = LawParams(angular_friction_1_s=0.9)
    mission = Mission(MissionParams(), Pose((0.0, 0.0, 0.0), 0.0), 0)
    yaws = [mission.reference(round(mission.duration_s * 1e3 * k)).yaw_rad for k in range(1000)]
    needed_deg_s2 = math.degrees(max(abs(yaw[2] + 0.9 * yaw[1]) for yaw in yaws))
    assert needed_deg_s2 > 1.1 * math.degrees(max(0.9 * abs(yaw[1]) for yaw in yaws))
    for share, refused in ((0.98, True), (1.02, False)):
        limits = law.limits.model_copy(update={"yaw_acceleration_max_deg_s2": share * needed_deg_s2})
        assert (fault(law=law.model_copy(update={"limits": limits})) is not None) is refused


def test_the_moment_told_is_the_worst_one():
    keys = {"name": "figure_eight", "period_s": 7.0, "hover_s": 2.0, "ramp_s": 3.0}
    said = str(fault(**keys))
    assert "m/s of speed" in said
    value, at_s = float(said.split("asks for ")[1].split()[0]), float(said.split("speed, ")[1].split()[0])
    mission = Mission(MissionParams(**keys), Pose((0.0, 0.0, 0.0), 0.0), 0)

    def speed(t_s):
        point = mission.reference(round(t_s * 1e6))
        return math.hypot(point.x_m[1], point.z_m[1])

    assert value == pytest.approx(max(speed(0.01 * k) for k in range(1400)), rel=1e-3)
    assert speed(at_s) == pytest.approx(value, rel=1e-3)


def test_the_remedy_is_one():
    keys = {"name": "figure_eight", "plane": "horizontal", "yaw": "path"}
    said = fault(**keys)
    assert said is not None
    factor = float(said.split("ramp_s ")[1].split(" times")[0])
    assert fault(**keys, period_s=12.0 * factor, ramp_s=4.0 * factor) is None
    assert fault(**keys, period_s=12.0 * factor * 0.97, ramp_s=4.0 * factor * 0.97) is not None


def test_what_is_cut_off_is_not_looked_at():
    far = {"name": "goto", "offset_ned_m": (30.0, 0.0, 0.0)}
    assert fault(**far, duration_s=10.0) is None
    assert fault(**far, duration_s=25.0) is not None


def test_a_file_with_corners_is_too_far_from_its_rows():
    square = [(0.1 * k, 0.1 * min(k, 50), 0.1 * max(0, k - 50), 0.0) for k in range(101)]
    said = fault(name="file", points=tuple(square), knot_s=2.0, reference=BRISK)
    assert said is not None
    assert "mission.file, row at t_s = 5" in said
    assert "m more than allowed" in said


def test_a_file_whose_times_are_too_uneven():
    rows = [(0.0, 0.0, 0.0, 0.0)]
    for k in range(30):
        t, north, *_ = rows[-1]
        rows.append((t + (2e-4 if k % 3 else 400.0), north + (0.009 if k % 2 else 0.0), 0.0, 0.0))
    assert "too uneven" in str(fault(name="file", points=tuple(rows), knot_s=0.0))


def test_the_height_is_known_only_in_flight():
    params = MissionParams(name="figure_eight", across_m=2.0, period_s=20.0)
    extent = mission_extent(params)
    assert (extent.rise_m, extent.sink_m) == pytest.approx((2.0, 2.0), abs=1e-3)
    assert extent.radius_m == pytest.approx(1.25, abs=1e-3)
    guards = GuardParams(floor_m=0.5, ceiling_m=10.0)
    assert height_fault(params, guards, 5.0) is None
    assert height_fault(params, guards, 2.0) == "the mission leads 0.5 m below guards.floor_m (0.5 m)"
    assert height_fault(params, guards, 9.0) == "the mission leads 1.0 m above guards.ceiling_m (10 m)"


@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 6.0), st.floats(2.0, 40.0), st.floats(0.5, 8.0))
def test_what_passes_keeps_to_every_limit_between_the_looks_too(radius_m, period_s, ramp_s):
    params = MissionParams(name="circle", radius_m=radius_m, period_s=period_s, ramp_s=ramp_s, hover_s=0.0)
    if mission_fault(params, GuardParams(), LawParams()) is None:
        mission = Mission(params, Pose((0.0, 0.0, 0.0), 0.0), 0)
        for k in range(2000):
            point = mission.reference(round(mission.duration_s * 1e6 * k / 2000) + 777)
            for order, limit in ((1, 1.5), (2, 1.2), (3, 2.5), (4, 8.0)):
                assert math.hypot(point.x_m[order], point.y_m[order]) <= limit * 1.01
