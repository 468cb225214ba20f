"""What is left out loses no extreme, keeps the order of time, and leaves gaps where the data have them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mavquad.analysis.report.thinning import extremes, strided, with_gaps

NUMBERS = hnp.arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(np.nan))


@given(NUMBERS, st.integers(2, 120))
def test_the_extremes_are_kept_in_fewer_rows(values, rows):
    times_s = np.arange(len(values)) * 0.1
    thin_s, [thin] = extremes(times_s, [values], rows)
    assert len(thin_s) == len(thin) <= max(rows, 2)
    assert np.all(np.diff(thin_s) >= 0)
    if np.isfinite(values).any():
        assert np.nanmax(thin) == np.nanmax(values)
        assert np.nanmin(thin) == np.nanmin(values)
    else:
        assert np.isnan(thin).all()


def test_a_spike_of_one_sample_stays_where_it_was():
    values = np.zeros(100_000)
    values[31_415] = 7.0
    values[92_653] = -3.0
    times_s = np.arange(100_000) * 0.01
    thin_s, [thin] = extremes(times_s, [values], 1000)
    assert abs(thin_s[thin.argmax()] - 314.15) < 2.0
    assert abs(thin_s[thin.argmin()] - 926.53) < 2.0
    assert sorted(thin)[1] == sorted(thin)[-2] == 0.0


def test_least_and_greatest_keep_their_order():
    _, [thin] = extremes(np.arange(8.0), [np.array([5.0, 1, 2, 3, 0, 9, 4, 4])], 4)
    assert thin.tolist() == [5, 1, 0, 9]


def test_few_rows_are_left_as_they_are():
    times_s, values = np.arange(5.0), np.arange(5.0) ** 2
    assert extremes(times_s, [values], 5)[1][0] is values
    assert strided(times_s, [values], 5)[1][0] is values


def test_points_of_a_path_are_points_of_it():
    angle = np.linspace(0, 20, 5000)
    east, north = np.cos(angle), np.sin(angle)
    thin_s, (thin_east, thin_north) = strided(angle, [east, north], 100)
    assert len(thin_s) == 100
    assert np.allclose(np.hypot(thin_east, thin_north), 1.0)
    assert (thin_s[0], thin_s[-1]) == (0, 20)


def test_a_gap_is_a_row_of_nan_amid_it():
    times_s = np.array([0.0, 0.1, 0.2, 5.2, 5.3])
    with_s, [values] = with_gaps(times_s, [np.ones(5)])
    assert with_s.tolist() == [0.0, 0.1, 0.2, 2.7, 5.2, 5.3]
    assert np.isnan(values).tolist() == [False, False, False, True, False, False]


def test_slow_data_are_no_gaps():
    times_s = np.array([0.0, 4.0, 8.0, 12.5, 16.0])
    assert with_gaps(times_s, [np.ones(5)])[0] is times_s
