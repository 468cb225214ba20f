"""Frames lost by their sequence numbers, late and repeated ones not; the round trip; the ground station."""

from __future__ import annotations

import random

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.flight.guard_link import GcsLossMonitor, GcsLossParams, LinkLossMonitor, LinkLossParams

PARAMS = LinkLossParams(share=0.5, window_s=2.0)
PERIOD_US = 2_000


def run(keeps, seconds=6.0, params=PARAMS, start=250):
    """Frames at 500 Hz of which those that `keeps` chooses arrive; what was said, without its Nones."""
    monitor = LinkLossMonitor(params)
    said = []
    for number in range(round(seconds * 1e6 / PERIOD_US)):
        for sequence in keeps(number):
            said.append(monitor.take((start + sequence) % 256, number * PERIOD_US))
    return [each for each in said if each is not None]


def lossy(share, seed=1):
    generator = random.Random(seed)
    return lambda number: [number] if generator.random() >= share else []


def test_a_whole_stream():
    assert run(lambda number: [number]) == []


@pytest.mark.parametrize("seed", range(5))
def test_a_share_below_and_above_the_limit(seed):
    assert run(lossy(0.4, seed)) == []
    tripped = run(lossy(0.6, seed))
    assert tripped[0].name == "link loss"
    assert tripped[0].words.endswith("% of the frames are lost, 50 % allowed")


def test_the_share_in_words_is_the_one_that_was_lost():
    assert run(lambda number: [number] if number % 4 == 0 else [])[0].words.startswith("75 % of the frames")


def test_repeated_frames_make_up_for_none_that_are_lost():
    assert run(lambda number: [number] * 5 if number % 4 == 0 else []) != []


def test_nor_do_those_that_are_repeated_behind_a_later_one():
    assert run(lambda number: [number, number + 1] * 2 if number % 8 == 0 else [])[0].words.startswith("75 %")


def test_a_loss_that_begins_after_a_long_good_time_is_seen_within_the_window():
    said = run(lambda number: [number] if number < 5000 or number % 4 == 0 else [], seconds=13.0)
    assert said[-1].words.startswith("75 %")
    assert run(lambda number: [number] if number < 5000 or number % 4 == 0 else [], seconds=11.0) == []


def test_late_frames_are_not_lost():
    assert run(lambda number: [number + 9, number + 8, number + 7, number + 6] if number % 4 == 0 else []) == []


def test_late_and_repeated_ones():
    """Each group of four comes backwards, and twice, three quarters of the groups not at all."""

    def keeps(number):
        return [number + 3, number + 2, number + 1, number] * 2 if number % 16 == 0 else []

    assert run(keeps)[0].words.startswith("75 %")


def test_the_window_must_be_whole_and_slides_on():
    gone = run(lambda number: [number] if number >= 500 or number % 4 == 0 else [], seconds=2.0)
    assert gone == []  # one second of loss, then one without, in a window of two: 38 %
    assert run(lambda number: [number] if number % 4 == 0 else [], seconds=1.9) == []


def test_few_frames_say_nothing_of_a_share():
    monitor = LinkLossMonitor(PARAMS)
    assert [monitor.take(number * 3, number * 1_000_000) for number in range(20)] == [None] * 20


def test_zero_is_off():
    assert run(lambda number: [number] if number % 50 == 0 else [], params=LinkLossParams(share=0.0)) == []


def test_three_slow_round_trips_in_a_row():
    monitor = LinkLossMonitor(LinkLossParams(round_trip_s=0.5, reaction="land"))
    assert [monitor.take_round_trip(each) for each in (600_000, 600_000, 400_000, 600_000, 600_000)] == [None] * 5
    tripped = monitor.take_round_trip(620_000)
    assert tripped.words == "a round trip over the link takes 0.62 s, 0.5 allowed"
    assert tripped.reaction == "land"
    off = LinkLossMonitor(LinkLossParams(round_trip_s=0.0))
    assert [off.take_round_trip(9_000_000) for _ in range(9)] == [None] * 9


# ---------------------------------------------------------------------- the ground station


def gcs(silent_s=5.0):
    return GcsLossMonitor(GcsLossParams(silent_s=silent_s, reaction="return"))


def test_a_silent_ground_station():
    monitor = gcs()
    monitor.heard(1_000_000)
    assert monitor.next_deadline_us() == NEVER_US  # nobody flies yet
    monitor.start(2_000_000)
    assert monitor.next_deadline_us() == 6_000_000
    monitor.heard(3_000_000)
    assert monitor.check(7_999_996) is None
    tripped = monitor.check(8_000_000)
    assert (tripped.words, tripped.reaction) == ("no ground station's HEARTBEAT for 5 s", "return")


def test_it_is_told_once_until_one_is_heard_again():
    monitor = gcs()
    monitor.start(0)
    assert monitor.check(5_000_000) is not None
    assert monitor.next_deadline_us() == NEVER_US
    monitor.heard(6_000_000)
    assert monitor.next_deadline_us() == 11_000_000


def test_silent_for_long_already_it_trips_just_after_the_start():
    monitor = gcs()
    monitor.heard(0)
    monitor.start(60_000_000)
    assert monitor.next_deadline_us() == 60_000_004


def test_none_that_was_ever_heard_is_missing():
    assert gcs().is_missing
    monitor = gcs()
    monitor.heard(0)
    assert not monitor.is_missing


def test_it_is_off_by_default():
    monitor = GcsLossMonitor(GcsLossParams())
    assert not monitor.is_missing
    monitor.start(0)
    monitor.heard(4)
    assert monitor.next_deadline_us() == NEVER_US
    assert monitor.check(10**12) is None
