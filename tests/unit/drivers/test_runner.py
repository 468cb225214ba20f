"""The runner: stamps, the rule of time, and the record in the order of cause and effect."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.drivers.runner import Runner
from mavquad.endpoint import GRID_US, NEVER_US
from mavquad.protocol.codec import Encoder, mavlink

START_US = 1_000_000
FRAMES = [Encoder(1, 1).encode(mavlink.MAVLink_attitude_message(i, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)) for i in range(3)]


class Clockwork:
    """Sends b"tick" every `period_us` and b"re" + the frame's length for every frame."""

    def __init__(self, period_us=NEVER_US):
        self.calls = []
        self._period_us = period_us
        self._next_us = START_US + period_us
        self._outbox = []

    def receive(self, data, now_us):
        self.calls.append(("frame", now_us))
        self._outbox.append(b"re%d" % len(data))

    def next_deadline_us(self):
        return self._next_us

    def on_deadline(self, now_us):
        self.calls.append(("deadline", now_us))
        self._next_us += self._period_us
        self._outbox.append(b"tick")

    def stop(self, now_us):
        self.calls.append(("stop", now_us))
        self._outbox.append(b"stopped")

    def goto(self, now_us, *place):
        self.calls.append(("goto", now_us, *place))

    def datagrams_to_send(self):
        outbox, self._outbox = self._outbox, []
        return outbox


class Notebook:
    def __init__(self):
        self.lines = []

    def frame(self, stamp_us, frame, outbound):
        self.lines.append((stamp_us, frame if outbound else "in"))

    def event(self, stamp_us, name, args=()):
        self.lines.append((stamp_us, name, *args))


def run(period_us=NEVER_US, start_us=START_US):
    endpoint, notebook, sent = Clockwork(period_us), Notebook(), []
    runner = Runner(endpoint, start_us, lambda stamp_us, data: sent.append((stamp_us, data)), notebook)
    return endpoint, notebook, sent, runner


@given(st.lists(st.integers(-50, 50), max_size=30))
def test_stamps_of_inputs_always_grow_and_lie_on_the_grid(steps):
    endpoint, _, _, runner = run()
    now_us = START_US
    for step in steps:
        now_us += step
        runner.frame(FRAMES[0], now_us)
    stamps = [stamp_us for _, stamp_us in endpoint.calls]
    assert len(stamps) == len(steps)
    assert all(stamp % GRID_US == 0 for stamp in stamps)
    assert all(b >= a + GRID_US for a, b in zip([START_US, *stamps], stamps, strict=False))


def test_a_stamp_is_the_grid_point_before_the_arrival():
    endpoint, _, _, runner = run()
    runner.frame(FRAMES[0], START_US + 1003)
    assert endpoint.calls == [("frame", START_US + 1000)]


def test_frames_of_one_moment_are_four_microseconds_apart():
    endpoint, _, _, runner = run()
    runner.datagram(b"".join(FRAMES), START_US + 100)
    assert [stamp - START_US for _, stamp in endpoint.calls] == [100, 104, 108]


def test_deadlines_fire_at_their_own_times_before_a_late_frame():
    endpoint, _, sent, runner = run(period_us=1000)
    runner.frame(FRAMES[0], START_US + 2500)
    assert endpoint.calls == [
        ("deadline", START_US + 1000),
        ("deadline", START_US + 2000),
        ("frame", START_US + 2500),
    ]
    assert [stamp - START_US for stamp, _ in sent] == [1000, 2000, 2500]


def test_a_deadline_at_the_arrival_fires_first():
    endpoint, _, _, runner = run(period_us=1000)
    runner.frame(FRAMES[0], START_US + 1000)
    assert endpoint.calls == [("deadline", START_US + 1000), ("frame", START_US + 1000)]


@given(st.lists(st.integers(0, 5000), min_size=1, max_size=20))
def test_when_the_loop_wakes_does_not_matter(wakes):
    ends_us = START_US + 20_000
    _, notebook, _, runner = run(period_us=700)
    for wake in sorted(wakes):
        runner.advance(START_US + wake)
    runner.advance(ends_us)
    _, prompt, _, other = run(period_us=700)
    other.advance(ends_us)
    assert notebook.lines == prompt.lines


def test_the_record_is_in_the_order_of_cause_and_effect():
    _, notebook, _, runner = run(period_us=1000)
    runner.frame(FRAMES[0], START_US + 500)
    runner.advance(START_US + 1001)
    runner.command("stop", runner.endpoint.stop, START_US + 1500)
    runner.end(START_US + 2200)
    answer = b"re%d" % len(FRAMES[0])
    assert [(stamp - START_US, what) for stamp, what in notebook.lines] == [
        (0, "start"),
        (500, "in"),
        (500, answer),
        (1000, b"tick"),
        (1500, "stop"),
        (1500, b"stopped"),
        (2000, b"tick"),
        (2200, "end"),
    ]


def test_a_command_has_a_stamp_of_its_own():
    endpoint, _, _, runner = run()
    runner.frame(FRAMES[0], START_US + 100)
    runner.command("stop", endpoint.stop, START_US + 100)
    assert endpoint.calls == [("frame", START_US + 100), ("stop", START_US + 104)]


def test_a_command_goes_with_its_arguments():
    endpoint, notebook, _, runner = run()
    runner.command("goto", endpoint.goto, START_US + 100, (1.0, -2.0, 3.0))
    assert endpoint.calls == [("goto", START_US + 100, 1.0, -2.0, 3.0)]
    assert notebook.lines[-1] == (START_US + 100, "goto", 1.0, -2.0, 3.0)


def test_what_is_no_frame_is_not_handed_over():
    endpoint, _, _, runner = run()
    runner.datagram(b"garbage" + FRAMES[0][:-1] + b"\x00", START_US + 100)
    assert endpoint.calls == []
    assert runner.framer.bad_bytes > 0


def test_it_works_without_a_recorder():
    sent = []
    runner = Runner(Clockwork(), START_US + 3, lambda stamp_us, data: sent.append((stamp_us, data)))
    runner.frame(FRAMES[0], START_US + 10)
    runner.end(START_US + 20)
    assert [stamp for stamp, _ in sent] == [START_US + 8]


@pytest.mark.parametrize("start_us", [START_US, START_US + 3])
def test_the_start_is_on_the_grid(start_us):
    _, notebook, _, _ = run(start_us=start_us)
    assert notebook.lines == [(START_US, "start")]


class Alarm(Clockwork):
    """A frame, or a command, sets its deadline to 100 us later."""

    def receive(self, data, now_us):
        super().receive(data, now_us)
        self._next_us = now_us + 100

    def on_deadline(self, now_us):
        super().on_deadline(now_us)
        self._next_us = NEVER_US

    def stop(self, now_us):
        super().stop(now_us)
        self._next_us = now_us + 100


@pytest.mark.parametrize("by_frame", [True, False])
def test_a_deadline_that_an_input_sets_is_kept(by_frame):
    sent, endpoint = [], Alarm()
    runner = Runner(endpoint, START_US, lambda stamp_us, data: sent.append((stamp_us, data)))
    if by_frame:
        runner.frame(FRAMES[0], START_US + 1000)
    else:
        runner.command("stop", endpoint.stop, START_US + 1000)
    assert runner.deadline_us == START_US + 1100
    runner.advance(START_US + 5000)
    assert sent[1:] == [(START_US + 1100, b"tick")]
    assert runner.deadline_us == NEVER_US
