"""The rule of time."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.endpoint import GRID_US, NEVER_US, advance, deliver, floor_to_grid_us, grid_us
from mavquad.errors import InternalError


class Beats:
    def __init__(self, deadlines):
        self.deadlines = sorted(deadlines)
        self.calls = []
        self._outbox = []

    def receive(self, data, now_us):
        self.calls.append((now_us, data))
        self._outbox += [b"a", b"b"]

    def next_deadline_us(self):
        return self.deadlines[0] if self.deadlines else NEVER_US

    def on_deadline(self, now_us):
        self.calls.append((now_us, b"deadline"))
        self._outbox.append(b"%d" % self.deadlines.pop(0))

    def datagrams_to_send(self):
        outbox, self._outbox = self._outbox, []
        return outbox


class Stuck(Beats):
    def on_deadline(self, now_us):
        self.calls.append((now_us, b"deadline"))


@given(st.integers(-(2**61), 2**61))
def test_the_grid(time_us):
    floored = floor_to_grid_us(time_us)
    assert floored % GRID_US == 0
    assert 0 <= time_us - floored < GRID_US


@pytest.mark.parametrize(
    ("duration_s", "expected_us"), [(0.1, 100_000), (1e-6, 0), (3.99e-6, 4), (0.3, 300_000), (3.5, 3_500_000)]
)
def test_durations(duration_s, expected_us):
    assert grid_us(duration_s) == expected_us


def test_every_deadline_fires_at_its_own_time_up_to_and_including_now():
    endpoint = Beats([4, 8, 100, 104])
    assert list(advance(endpoint, 100)) == [(4, b"4"), (8, b"8"), (100, b"100")]
    assert [now_us for now_us, _ in endpoint.calls] == [4, 8, 100]
    assert list(advance(endpoint, 103)) == []


def test_deadlines_come_before_the_frame_and_what_it_causes_behind_it():
    endpoint = Beats([4, 100])
    assert list(deliver(endpoint, b"frame", 100)) == [(4, b"4"), (100, b"100"), (100, b"a"), (100, b"b")]
    assert endpoint.calls[-1] == (100, b"frame")


@given(st.sets(st.integers(0, 250).map(lambda n: 4 * n), max_size=20), st.lists(st.integers(0, 1000), max_size=20))
def test_the_wakes_in_between_change_nothing(deadlines, wakes):
    woken, prompt = Beats(deadlines), Beats(deadlines)
    sent = [item for wake in sorted(wakes) for item in advance(woken, wake)]
    assert sent + list(advance(woken, 1000)) == list(advance(prompt, 1000))


def test_a_deadline_that_does_not_move_on_is_an_error_of_ours_and_not_a_hang():
    with pytest.raises(InternalError, match="Stuck: the deadline at 4 us does not move on"):
        list(advance(Stuck([4]), 100))
