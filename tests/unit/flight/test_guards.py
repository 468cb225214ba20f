"""Each guard trips beyond its limit and not before it, in every direction."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.guards import GuardParams, check, not_a_number, stale, tilt_rad
from mavquad.types import Attitude, Position

PARAMS = GuardParams(tilt_deg=40.0, radius_m=5.0, ceiling_m=8.0, floor_m=1.0)
ORIGIN = (10.0, -20.0, 3.0)
GROUND_M = 100.0


def attitude(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0):
    return Attitude(1, *map(math.radians, (roll_deg, pitch_deg, yaw_deg)), (0.0, 0.0, 0.0))


def tripped(north_m=0.0, west_m=0.0, height_m=4.0, roll_deg=0.0, pitch_deg=0.0):
    position = Position(1, (10.0 + north_m, -20.0 + west_m, GROUND_M + height_m), (0.0, 0.0, 0.0))
    return check(PARAMS, attitude(roll_deg, pitch_deg), position, ORIGIN, GROUND_M)


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "tilt_deg"),
    [
        (0.0, 0.0, 0.0),
        (25.0, 0.0, 25.0),
        (-25.0, 0.0, 25.0),
        (0.0, -70.0, 70.0),
        # cos 30 cos 30 = 3/4, acos(3/4) = 41.4096...: by hand, not the 42.43 of a root of squares.
        (30.0, 30.0, 41.40962210927086),
        (-30.0, 30.0, 41.40962210927086),
        (180.0, 0.0, 180.0),
        (90.0, 90.0, 90.0),
    ],
)
def test_tilt(roll_deg, pitch_deg, tilt_deg):
    assert math.degrees(tilt_rad(attitude(roll_deg, pitch_deg, 77.0))) == pytest.approx(tilt_deg, abs=1e-9)


def test_all_is_well_at_the_hand_over():
    assert tripped() is None


@pytest.mark.parametrize(
    "angles", [{"roll_deg": 1.0}, {"roll_deg": -1.0}, {"pitch_deg": 1.0}, {"pitch_deg": -1.0}], ids=str
)
def test_tilt_trips_beyond_its_limit(angles):
    [(name, sign)] = angles.items()
    assert tripped(**{name: sign * 39.9}) is None
    assert tripped(**{name: sign * 40.1}).name == "tilt"


def test_both_tilts_together_trip_where_neither_does_alone():
    assert tripped(roll_deg=30.0) is None
    assert tripped(pitch_deg=30.0) is None
    assert tripped(roll_deg=30.0, pitch_deg=30.0).words == "tilt is 41 degrees, 40 allowed"


@pytest.mark.parametrize(("north", "west"), [(1, 0), (-1, 0), (0, 1), (0, -1), (0.6, 0.8), (-0.8, 0.6)])
def test_radius_trips_beyond_its_limit_from_the_hand_over_point(north, west):
    assert tripped(north_m=4.99 * north, west_m=4.99 * west) is None
    assert tripped(north_m=5.1 * north, west_m=5.1 * west).words == "5.1 m from the hand-over point, 5 m allowed"


@pytest.mark.parametrize(("inside_m", "outside_m"), [(7.99, 8.01), (1.01, 0.99)])
def test_height_trips_above_the_ceiling_and_below_the_floor(inside_m, outside_m):
    assert tripped(height_m=inside_m) is None
    assert tripped(height_m=outside_m).name == "volume"


def test_words_of_the_height():
    assert tripped(height_m=9.26).words == "height is 9.3 m, 1 to 8 m allowed"


def test_tilt_comes_first():
    assert tripped(roll_deg=60.0, height_m=50.0, north_m=50.0).name == "tilt"


def test_words_of_a_stale_pose_and_of_nan():
    assert stale("ATTITUDE", 0.123, 0.2).words == "no ATTITUDE for 0.12 s, 0.2 s allowed"
    assert not_a_number("ATTITUDE").words == "ATTITUDE holds a value that is not a number"
