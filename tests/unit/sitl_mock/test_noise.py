"""Random series with a memory: size, memory and slope, across the borders of the blocks."""

import math

import numpy as np
import pytest

from sitl_mock.noise import Memory, Smooth, stream


def series(made, blocks=800, steps=250):
    random = stream("test", 7)
    return [made.block(random.standard_normal((2, steps))) for _ in range(blocks)]


def correlation(row, lag):
    return np.corrcoef(row[:-lag], row[lag:])[0, 1]


def test_without_a_memory_it_is_white():
    white = stream("test", 1).standard_normal((2, 100))
    assert Memory(0.0, np.zeros(2), 0.004).block(white) is white


@pytest.mark.parametrize("time_s", [0.01, 0.2])
def test_memory(time_s):
    rows = np.hstack(series(Memory(time_s, np.zeros(2), 0.004)))
    assert rows.std(axis=1) == pytest.approx([1.0, 1.0], rel=0.05)
    assert correlation(rows[0], round(time_s / 0.002)) == pytest.approx(
        math.exp(-round(time_s / 0.002) * 0.004 / time_s), abs=0.05
    )
    assert np.corrcoef(rows)[0, 1] == pytest.approx(0.0, abs=0.06)


def test_blocks_follow_on_each_other():
    """Whatever the length of the blocks, the series is the same."""
    white = stream("test", 3).standard_normal((2, 100))
    one, many = Memory(0.1, np.ones(2), 0.004), Memory(0.1, np.ones(2), 0.004)
    parts = [many.block(white[:, k : k + 20]) for k in range(0, 100, 20)]
    walked = one.block(white)
    assert np.abs(walked - np.hstack(parts)).max() < 1e-12
    # the recursion itself: x[k] = a x[k-1] + sqrt(1 - a^2) n[k], x[-1] = 1
    a, x = math.exp(-0.04), 1.0
    for now, n in zip(walked[1], white[1], strict=True):
        x = a * x + math.sqrt(1 - a * a) * n
        assert now == pytest.approx(x, abs=1e-12)


def test_smooth_has_a_slope():
    made = Smooth(2.0, np.zeros(4), 0.01)
    blocks = series(made, 2000)
    rows, slopes = np.hstack([b[0] for b in blocks]), np.hstack([b[1] for b in blocks])
    assert rows.std(axis=1) == pytest.approx([1.0, 1.0], rel=0.07)
    assert slopes.std(axis=1) == pytest.approx([0.5, 0.5], rel=0.07)
    # the slope is what the series does from step to step, at 0.01 s to 1 %
    assert np.abs(np.diff(rows)[0] / 0.01 - slopes[0, 1:]).max() < 0.02
    assert correlation(rows[0], 200) == pytest.approx(2 * math.exp(-1), abs=0.06)


def test_both_start_as_they_go_on():
    random = stream("test", 5)
    start, white = random.standard_normal(8000), random.standard_normal((4000, 1))
    assert Memory(2.0, start[:4000], 0.01).block(white).std() == pytest.approx(1.0, rel=0.05)
    place, slope = Smooth(2.0, start, 0.01).block(white)
    assert place.std() == pytest.approx(1.0, rel=0.05)
    assert slope.std() == pytest.approx(0.5, rel=0.05)


def test_streams_are_apart_and_come_again():
    draw = [stream(name, seed).standard_normal(3).tolist() for name, seed in [("a", 1), ("a", 1), ("b", 1), ("a", -2)]]
    assert draw[0] == draw[1]
    assert draw[0] != draw[2]
    assert draw[0] != draw[3]
