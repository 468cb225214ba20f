"""Intervals: when a message is due."""

import math

import pytest

from mavquad.endpoint import NEVER_US
from sitl_mock.personality.streams import OFF_HZ, UNLIMITED_HZ, StreamKind, Streams

TICK_US = 4000


def sent_us(streams, message_id, until_us, from_us=TICK_US):
    return [us for us in range(from_us, until_us + 1, TICK_US) if message_id in streams.due(us)]


def test_a_period_begins_at_boot_whenever_it_was_asked_for():
    early, late = (Streams([StreamKind(1, 1.0, TICK_US)]) for _ in range(2))
    early.set_interval(1, 20_000, 0)
    late.set_interval(1, 20_000, 13_000)
    assert (
        sent_us(early, 1, 100_000, 16_000)
        == sent_us(late, 1, 100_000, 16_000)
        == [20_000, 40_000, 60_000, 80_000, 100_000]
    )


def test_no_message_without_news():
    streams = Streams([StreamKind(1, 100.0, 8_000)])
    assert sent_us(streams, 1, 60_000) == [4_000, 12_000, 20_000, 32_000, 40_000, 52_000, 60_000]


def test_unlimited_is_whatever_is_new():
    streams = Streams([StreamKind(1, UNLIMITED_HZ, 20_000)])
    assert sent_us(streams, 1, 100_000) == [4_000, 20_000, 40_000, 60_000, 80_000, 100_000]
    assert streams.interval_us(1) == -1


def test_off_until_asked_for_and_off_again():
    streams = Streams([StreamKind(1, OFF_HZ, TICK_US)])
    assert sent_us(streams, 1, 40_000) == []
    assert streams.next_us == NEVER_US
    assert streams.set_interval(1, 8_000, 40_000)
    assert sent_us(streams, 1, 64_000, 44_000) == [48_000, 56_000, 64_000]
    assert streams.set_interval(1, 0, 64_000)  # the default: off
    assert sent_us(streams, 1, 90_000, 68_000) == []


def test_intervals_below_a_microsecond_are_the_fastest():
    streams = Streams([StreamKind(1, 1.0, TICK_US)])
    assert streams.set_interval(1, 1e-30, 0)
    assert len(sent_us(streams, 1, 40_000)) == 10


@pytest.mark.parametrize(("message_id", "known"), [(1, True), (2, True), (3, False)])
def test_known_ids(message_id, known):
    streams = Streams([StreamKind(1, 1.0, TICK_US)], frozenset({2}))
    assert streams.set_interval(message_id, 1000.0, 0) is known
    assert 2 not in streams.due(TICK_US)


def test_nothing_is_due_before_next_us():
    streams = Streams([StreamKind(1, 10.0, TICK_US), StreamKind(2, 30.0, TICK_US)])
    streams.due(TICK_US)
    for us in range(2 * TICK_US, 2_000_000, TICK_US):
        was_next_us = streams.next_us
        assert bool(streams.due(us)) == (us >= was_next_us)
    assert not math.isinf(streams.next_us)
