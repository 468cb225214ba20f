"""The pace of a log that is played back, with the time as an argument."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.drivers.play import Player
from mavquad.drivers.playback import LEAP_PLAYED_US, LEAP_US, MOST_AT_ONCE, Listener, Playback
from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import Record

T0 = 1_700_000_000_000_000
NOW = 5_000_000


def log_of(*stamps_us):
    return [Record(T0 + stamp_us, 0, b"%d" % stamp_us) for stamp_us in stamps_us]


def opened(records, opens=None):
    def open_at(stamp_us):
        if opens is not None:
            opens.append(stamp_us - T0)
        return (record for record in records if record.stamp_us >= stamp_us)

    return open_at


def playback(*stamps_us, opens=None, **options):
    records = log_of(*stamps_us)
    first, last = min(stamps_us, default=0), max(stamps_us, default=0)
    return Playback(opened(records, opens), T0 + first, T0 + last, NOW, **options)


def run(player, until_us=10**12):
    """Every frame with the time at which it goes out, as a loop that is never late would send them."""
    now, sent = NOW, []
    while (due_us := player.next_deadline_us()) <= NOW + until_us:
        now = max(due_us, now)
        sent += [(now - NOW, int(frame)) for frame in player.frames_due(now)]
    return sent


@pytest.mark.parametrize(("speed", "factor"), [(1.0, 1.0), (4.0, 0.25), (0.5, 2.0)])
def test_frames_go_out_at_the_distances_of_their_stamps(speed, factor):
    player = playback(0, 1000, 1000, 50_000, 2_000_000, speed=speed)
    assert run(player) == [(stamp * factor, stamp) for stamp in (0, 1000, 1000, 50_000, 2_000_000)]
    assert (player.done, player.frames, player.bytes, player.rounds) == (True, 5, 1 + 4 + 4 + 5 + 7, 1)
    assert player.next_deadline_us() == NEVER_US


def test_a_frame_stamped_a_little_back_goes_at_once_and_in_its_place():
    sent = run(playback(0, 500_000, 300_000, 400_000, 600_000))
    assert sent == [(0, 0), (500_000, 500_000), (500_000, 300_000), (500_000, 400_000), (600_000, 600_000)]


def test_a_log_that_begins_long_after_its_earliest_stamp_begins_at_once():
    records = log_of(365 * 86_400_000_000, 0, 1000)
    player = Playback(lambda _: iter(records), T0, records[0].stamp_us, NOW)
    assert [at for at, _ in run(player)] == [0, LEAP_PLAYED_US, LEAP_PLAYED_US + 1000]


def test_of_those_stamped_back_the_due_time_has_passed():
    player = playback(0, 500_000, 300_000)
    assert player.frames_due(NOW) == [b"0"]
    assert player.frames_due(NOW + 499_999) == []
    assert player.frames_due(NOW + 500_000) == [b"500000", b"300000"]


@pytest.mark.parametrize("leap_us", [LEAP_US + 1, 365 * 86_400_000_000, -LEAP_US - 1, -365 * 86_400_000_000])
def test_a_leap_is_played_as_a_second_either_way(leap_us):
    stamps = [40_000_000_000_000, 40_000_000_000_000 + leap_us, 40_000_000_500_000 + leap_us]
    records = log_of(*stamps)
    player = Playback(lambda _: iter(records), T0 + stamps[0], T0 + max(stamps), NOW)
    assert [at for at, _ in run(player)] == [0, LEAP_PLAYED_US, LEAP_PLAYED_US + 500_000]
    assert player.leaps == 1


def test_one_wild_stamp_costs_two_seconds_and_no_burst():
    wild = 10**14
    records = log_of(0, 1000, wild, 2000, 3000)
    player = Playback(lambda _: iter(records), T0, T0 + wild, NOW)
    assert [at for at, _ in run(player)] == [0, 1000, 1_001_000, 2_001_000, 2_002_000]


def test_a_pause_as_long_as_a_leap_allows_is_kept():
    assert run(playback(0, LEAP_US))[1][0] == LEAP_US


def test_the_loop_begins_anew_a_second_after_the_end():
    opens = []
    player = playback(0, 2_000_000, loop=True, opens=opens)
    assert run(player, 7_000_000) == [
        (0, 0), (2_000_000, 2_000_000), (3_000_000, 0), (5_000_000, 2_000_000), (6_000_000, 0),
    ]  # fmt: skip
    assert (player.done, player.rounds, opens) == (False, 2, [0, 0, 0])


def test_time_stands_still_while_paused():
    player = playback(0, 1_000_000, 2_000_000)
    assert player.frames_due(NOW) == [b"0"]
    player.pause(NOW + 400_000)
    assert player.position_us(NOW + 9_000_000) == T0 + 400_000
    assert player.next_deadline_us() == NEVER_US
    assert player.frames_due(NOW + 9_000_000) == []
    player.resume(NOW + 10_000_000)
    assert player.next_deadline_us() == NOW + 10_600_000
    assert player.frames_due(NOW + 10_600_000) == [b"1000000"]


def test_another_speed_counts_from_here():
    player = playback(0, 1_000_000, 3_000_000)
    player.frames_due(NOW)
    player.change_speed(2.0, NOW + 500_000)
    assert player.position_us(NOW + 500_000) == T0 + 500_000
    assert player.next_deadline_us() == NOW + 750_000
    player.pause(NOW + 600_000)
    player.change_speed(0.5, NOW + 700_000)
    player.resume(NOW + 800_000)
    assert player.position_us(NOW + 800_000) == T0 + 700_000
    assert player.next_deadline_us() == NOW + 1_400_000


@pytest.mark.parametrize(
    ("to_us", "frames"),
    [(1_500_000, ["2000000"]), (1_000_000, ["1000000", "2000000"]), (-5, ["0", "1000000", "2000000"])],
)
def test_seeking_plays_on_from_there(to_us, frames):
    player = playback(0, 1_000_000, 2_000_000)
    player.frames_due(NOW)
    player.seek(T0 + to_us, NOW + 100_000)
    assert player.position_us(NOW + 100_000) == T0 + max(to_us, 0)
    assert [str(stamp) for _, stamp in run(player)] == frames
    assert player.next_deadline_us() == NEVER_US
    player.seek(T0 + 10**9, NOW + 9_000_000)
    assert run(player) == [(9_000_000, 2_000_000)]  # no further than the last frame


def test_seeking_keeps_a_pause_and_takes_back_the_end():
    player = playback(0, 1_000_000)
    run(player)
    assert player.done
    player.pause(NOW + 2_000_000)
    player.seek(T0 + 500_000, NOW + 2_000_000)
    assert (player.done, player.paused, player.position_us(NOW + 3_000_000)) == (False, True, T0 + 500_000)
    player.resume(NOW + 4_000_000)
    assert run(player) == [(4_500_000, 1_000_000)]


def test_who_was_held_up_goes_on_from_there():
    player = playback(0, 1_000_000, 1_500_000, 3_000_000)
    player.frames_due(NOW)
    late = NOW + 60_000_000
    assert player.frames_due(late) == [b"1000000"]
    assert player.next_deadline_us() == late + 500_000


def test_a_little_lateness_is_made_up_for():
    player = playback(0, 100_000, 300_000)
    assert player.frames_due(NOW + 200_000) == [b"0", b"100000"]
    assert player.next_deadline_us() == NOW + 300_000


def test_many_at_once_come_in_portions():
    player = playback(*range(MOST_AT_ONCE + 50))
    assert len(player.frames_due(NOW + 1000)) == MOST_AT_ONCE
    assert player.next_deadline_us() <= NOW + 1000
    assert len(player.frames_due(NOW + 1000)) == 50


def test_nothing_to_play():
    player = playback()
    assert (player.done, player.next_deadline_us(), player.frames_due(NOW)) == (True, NEVER_US, [])


@given(
    st.lists(st.integers(0, 10**8), min_size=1, max_size=60),
    st.sampled_from([0.3, 1.0, 7.0]),
    st.lists(st.integers(0, 300_000), max_size=200),
)
def test_whatever_the_stamps_every_frame_goes_out_once_in_order_and_never_early(stamps, speed, waits):
    records = log_of(*stamps)
    player = Playback(lambda _: iter(records), T0 + min(stamps), T0 + max(stamps), NOW, speed=speed)
    now, sent = NOW, []
    for wait_us in [*waits, *[10**9] * (len(stamps) + 1)]:
        due_us = player.next_deadline_us()
        frames = player.frames_due(now)
        assert not frames or due_us <= now
        assert min(stamps) <= player.position_us(now) - T0 <= max(stamps)
        sent += frames
        now += wait_us
    assert sent == [record.frame for record in records]
    assert player.done


# ---------------------------------------------------------------------- what is played


def heartbeat(sender, kind):
    return Encoder(*sender).encode(mavlink.MAVLink_heartbeat_message(kind, 12, 0, 0, 4, 3))


def attitude(sender):
    return Encoder(*sender).encode(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))


@pytest.mark.parametrize(
    ("inbound", "outbound", "wanted"), [(True, False, [0, 3]), (False, True, [1, 2, 4]), (True, True, [0, 1, 2, 3, 4])]
)
def test_directions(inbound, outbound, wanted):
    listener = Listener(inbound, outbound)
    records = [
        Record(T0, 0, heartbeat((1, 1), mavlink.MAV_TYPE_QUADROTOR)),
        Record(T0, 3, attitude((1, 1))),
        Record(T0, 0, heartbeat((255, 190), mavlink.MAV_TYPE_GCS)),
        Record(T0, 0, attitude((1, 1))),
        Record(T0, 0, attitude((255, 190))),
    ]
    assert [number for number, record in enumerate(records) if listener.hears(record)] == wanted


# ---------------------------------------------------------------------- wishes


class Clock:
    def __init__(self):
        self.now_us = NOW

    def __call__(self):
        return self.now_us


@pytest.fixture
def player():
    clock = Clock()
    records = log_of(*range(0, 100_000_000, 1_000_000))
    made = Player(Playback(opened(records), T0, T0 + 99_000_000, NOW), T0, clock)
    made.clock = clock
    return made


def test_wishes(player):
    player.clock.now_us += 20_500_000
    while player.playback.next_deadline_us() <= player.clock.now_us:
        player.playback.frames_due(player.playback.next_deadline_us())
    assert player.position_s == pytest.approx(20.5)
    for wish, position_s in (
        ("seek +10.0", 30.5),
        ("seek -10", 20.5),
        ("seek 42", 42.0),
        (" seek  7.5 ", 7.5),
        ("seek 1e6", 99),
    ):
        assert player.wish(wish) == ""
        assert player.position_s == pytest.approx(position_s)
    player.wish("faster")
    assert player.playback.speed == 2.0
    player.wish("speed 0.25")
    player.wish("slower")
    assert player.playback.speed == 0.125
    for wish, paused in (
        ("toggle", True),
        ("toggle", False),
        ("pause", True),
        ("pause", True),
        ("play", False),
        ("", False),
    ):
        assert player.wish(wish) == ""
        assert player.playback.paused is paused


@pytest.mark.parametrize(
    ("wish", "fault"),
    [
        ("dance", "'dance' is not known; on stdin: pause, play"),
        ("seek", "seek: '' is not a number"),
        ("seek soon", "seek: 'soon' is not a number"),
        ("seek nan", "seek: nan is out of range"),
        ("seek 1e300", "seek: 1e300 is out of range"),
        ("speed 0", "speed: 0 is out of range"),
        ("speed -1", "speed: -1 is out of range"),
        ("speed inf", "speed: inf is out of range"),
    ],
)
def test_what_cannot_be_wished_for_changes_nothing(player, wish, fault):
    assert player.wish(wish).startswith(fault)
    assert (player.position_s, player.playback.speed) == (0.0, 1.0)
