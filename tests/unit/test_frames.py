"""Axis flips and angles."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad import frames

FLOATS = st.floats(-1e6, 1e6)
VECTORS = st.tuples(FLOATS, FLOATS, FLOATS)
ANGLES = st.floats(-1e3, 1e3)


@pytest.mark.parametrize("name", ["ned_from_nwu", "nwu_from_ned", "frd_from_flu", "flu_from_frd", "euler_flipped"])
def test_the_second_and_third_axes_flip(name):
    flip = getattr(frames, name)
    assert (flip(1.0, 2.0, 3.0) if name == "euler_flipped" else flip((1.0, 2.0, 3.0))) == (1.0, -2.0, -3.0)


@given(VECTORS)
def test_there_and_back(vector):
    assert frames.nwu_from_ned(frames.ned_from_nwu(vector)) == vector
    assert frames.flu_from_frd(frames.frd_from_flu(vector)) == vector
    assert frames.euler_flipped(*frames.euler_flipped(*vector)) == vector


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), row by row."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def turned(matrix, vector):
    return tuple(sum(m * v for m, v in zip(row, vector, strict=True)) for row in matrix)


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.tuples(*[st.floats(-10, 10)] * 3))
def test_flipped_angles_turn_flipped_vectors_alike(angles, body_frd):
    """A vector of the body seen from the world: through NED and FRD, or through NWU and FLU."""
    by_ned = frames.nwu_from_ned(turned(rotation(*angles), body_frd))
    by_nwu = turned(rotation(*frames.euler_flipped(*angles)), frames.flu_from_frd(body_frd))
    assert by_ned == pytest.approx(by_nwu, abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (1.0, 1.0),
        (-1.0, -1.0),
        (math.pi, -math.pi),
        (-math.pi, -math.pi),
        (4.0, 4.0 - 2 * math.pi),
        (7.0, 7.0 - 2 * math.pi),
    ],
)
def test_wrap(angle, wrapped):
    assert frames.wrap_pi(angle) == pytest.approx(wrapped, abs=1e-12)


@given(ANGLES)
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    wrapped = frames.wrap_pi(angle)
    assert -math.pi <= wrapped < math.pi + 1e-12
    assert (math.sin(wrapped), math.cos(wrapped)) == pytest.approx((math.sin(angle), math.cos(angle)), abs=1e-9)


@given(ANGLES, ANGLES)
def test_an_unwrapped_angle_is_the_same_direction_near_the_other(angle, near):
    unwrapped = frames.unwrap_near(angle, near)
    assert abs(unwrapped - near) <= math.pi + 1e-9
    assert (math.sin(unwrapped), math.cos(unwrapped)) == pytest.approx((math.sin(angle), math.cos(angle)), abs=1e-9)


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 3])
def test_a_yaw_that_goes_on_turning_stays_continuous(turns):
    assert frames.unwrap_near(-3.1, 3.1 + turns * 2 * math.pi) == pytest.approx(2 * math.pi - 3.1 + turns * 2 * math.pi)
