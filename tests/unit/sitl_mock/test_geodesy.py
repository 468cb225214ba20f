"""Local and geographic positions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_mock.geodesy import Origin

ORIGIN = Origin(47.3977432, 8.5455942, 489.4)
METRES_PER_DEGREE = math.pi * 6371000.0 / 180.0


def test_the_origin_is_where_nothing_is_added():
    assert ORIGIN.geographic((0.0, 0.0, 0.0)) == (47.3977432, 8.5455942, 489.4)
    assert ORIGIN.local(47.3977432, 8.5455942, 489.4) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("position", "moved"),
    [
        ((100.0, 0.0, 0.0), (100.0 / METRES_PER_DEGREE, 0.0, 0.0)),
        ((0.0, 100.0, 0.0), (0.0, 100.0 / (METRES_PER_DEGREE * math.cos(math.radians(47.3977432))), 0.0)),
        ((0.0, 0.0, 7.0), (0.0, 0.0, -7.0)),
    ],
)
def test_north_east_down(position, moved):
    latitude, longitude, altitude = ORIGIN.geographic(position)
    assert (latitude - 47.3977432, longitude - 8.5455942) == pytest.approx(moved[:2], abs=1e-8)
    assert altitude - 489.4 == pytest.approx(moved[2])


@given(st.floats(-20e3, 20e3), st.floats(-20e3, 20e3), st.floats(-500, 5000))
def test_there_and_back(north, east, down):
    assert ORIGIN.local(*ORIGIN.geographic((north, east, down))) == pytest.approx((north, east, down), abs=1e-5)


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_any_position_has_a_latitude_and_a_longitude(north, east):
    latitude, longitude, _ = ORIGIN.geographic((north, east, 0.0))
    assert -90 <= latitude <= 90
    assert -180 <= longitude < 180


def test_distances_from_the_origin_are_true():
    latitude, longitude, _ = ORIGIN.geographic((3e6, 4e6, 0.0))
    phi0, phi, turn = (math.radians(x) for x in (47.3977432, latitude, longitude - 8.5455942))
    angle = math.acos(math.sin(phi0) * math.sin(phi) + math.cos(phi0) * math.cos(phi) * math.cos(turn))
    assert 6371000.0 * angle == pytest.approx(5e6, rel=1e-9)
