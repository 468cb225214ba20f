"""The count of what was lost."""

import pytest

from mavquad.protocol.sequence import SequenceCount


@pytest.mark.parametrize(
    ("sequences", "lost"),
    [
        ([0, 1, 2, 3], 0),
        ([0, 2], 1),
        ([0, 4, 5], 3),
        ([200], 0),
        ([254, 255, 0, 1], 0),
        ([254, 1], 2),
        ([255, 0], 0),
        ([10, 12, 11], 0),  # 11 came late
        ([10, 14, 11, 13], 1),
        ([253, 1, 255], 2),  # 254, 255, 0 missing, 255 came late
        ([10, 10, 11], 0),
        ([10, 12, 12, 13], 1),  # a frame that came twice is not the one that was lost
        ([0, 127], 126),
    ],
)
def test_lost_frames_are_counted_over_the_wrap_and_with_late_ones(sequences, lost):
    count = SequenceCount()
    for sequence in sequences:
        count.take(sequence)
    assert count.lost == lost
