"""Rows of a trajectory: which can be flown, and what they mean."""

from __future__ import annotations

import math

import pytest

from mavquad.control.reference import ReferenceParams
from mavquad.flight.trajectory_rows import row_fault, samples

GOOD = [(0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0), (2.0, 1.0, 1.0, -1.0)]


def replaced(index, row):
    return [row if number == index else good for number, good in enumerate(GOOD)]


def test_good_rows():
    assert row_fault(GOOD, ReferenceParams()) is None


@pytest.mark.parametrize(
    ("rows", "index", "words"),
    [
        ([], -1, "0 rows; 2 to 20000"),
        (GOOD[:1], 0, "1 rows"),
        (replaced(1, (1.0, 1.0, 0.0)), 1, "3 values; 4 are wanted, or 5 with yaw_deg"),
        (replaced(2, (2.0, 1.0, 1.0, -1.0, 5.0)), 2, "5 values"),
        ([row[:2] for row in GOOD], 0, "2 values"),
        (replaced(1, (1.0, math.nan, 0.0, 0.0)), 1, "north_m is nan, not a finite number"),
        (replaced(1, (1.0, 0.0, 0.0, math.inf)), 1, "down_m is inf"),
        (replaced(1, (math.nan, 0.0, 0.0, 0.0)), 1, "t_s is nan"),
        (replaced(1, (1.0, 0.0, -2e4, 0.0)), 1, "east_m is -20000, more than 10000"),
        (replaced(2, (1e5, 1.0, 1.0, -1.0)), 2, "t_s is 100000, more than 14400"),
        (replaced(2, (1.0, 1.0, 0.0, 0.0)), 2, "t_s is 1 after 1; time must grow"),
        (replaced(2, (0.5, 1.0, 0.0, 0.0)), 2, "t_s is 0.5 after 1"),
        (replaced(2, (2.0, 4.0, 0.0, 4.0)), 2, "a jump of 5.00 m in 1.000 s is 5.00 m/s, 3.50 m/s above"),
        ([(*row, 60.0 * row[0]) for row in GOOD], 1, "a turn of 60.0 deg in 1.000 s is 60.0 deg/s, 15.0 deg/s above"),
    ],
)
def test_the_first_bad_row_is_told(rows, index, words):
    fault = row_fault(rows, ReferenceParams())
    assert fault is not None
    assert fault[0] == index
    assert words in fault[1]


def test_a_wrapped_yaw_is_no_jump():
    assert row_fault([(0.0, 0.0, 0.0, 0.0, 175.0), (1.0, 0.0, 0.0, 0.0, -175.0)], ReferenceParams()) is None


def test_rounding_is_no_jump():
    rows = [(0.01 * k, round(0.0149 * k, 2), 0.0, 0.0) for k in range(100)]
    assert row_fault(rows, ReferenceParams()) is None


def test_rows_as_samples_in_nwu_with_a_continuous_yaw():
    rows = [(3.0, 1.0, 2.0, -4.0, 170.0), (4.0, 1.0, 2.0, -4.0, -170.0)]
    (t0, x, y, z, yaw0), (t1, *_, yaw1) = samples(rows)
    assert (t0, x, y, z, t1) == (3.0, 1.0, -2.0, 4.0, 4.0)
    assert yaw1 - yaw0 == pytest.approx(-math.radians(20.0))
    assert math.cos(yaw0 + math.radians(170.0)) == pytest.approx(1.0)
    assert samples([row[:4] for row in rows])[1][4] == 0.0
