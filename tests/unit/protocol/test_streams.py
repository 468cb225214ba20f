"""Streams: what is asked for, and what arrives."""

from __future__ import annotations

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import PX4
from mavquad.protocol.streams import StreamKeeper, StreamMonitor, StreamParams, requests, shortfalls, wanted


def monitor(rate_hz, until_us=5_000_000):
    one = StreamMonitor()
    for stamp_us in range(0, until_us, round(1e6 / rate_hz)):
        one.on_message(stamp_us)
    return one


def test_nothing_heard():
    assert StreamMonitor().rate_hz(10**6) == 0.0


@pytest.mark.parametrize("rate_hz", [1, 10, 50, 100, 250])
def test_the_rate_is_that_of_the_last_second(rate_hz):
    assert monitor(rate_hz).rate_hz(4_999_996) == rate_hz


def test_it_falls_to_nothing_within_a_second_of_silence():
    one = monitor(100)
    assert one.rate_hz(5_490_000) == pytest.approx(50, abs=1)
    assert one.rate_hz(5_990_000) == 0.0


def test_the_second_is_half_open():
    one = StreamMonitor()
    one.on_message(1000)
    assert one.rate_hz(1_000_996) == 1.0
    assert one.rate_hz(1_001_000) == 0.0


def test_it_takes_a_second_to_reach_the_rate():
    one = monitor(100, until_us=250_000)
    assert one.rate_hz(250_000) == 25.0


@pytest.mark.parametrize(("rate_hz", "short"), [(59, True), (60, False), (100, False)])
def test_the_least_share(rate_hz, short):
    params = StreamParams(position_hz=100.0, attitude_hz=100.0, least_share=0.6)
    one = StreamMonitor()
    for i in range(rate_hz):
        one.on_message(10**6 + i * 10_000)
    monitors = {"ATTITUDE": one, "LOCAL_POSITION_NED": monitor(100, until_us=2_000_000)}
    words = shortfalls(params, monitors, 1_990_000)
    assert words == ([f"ATTITUDE arrives at {rate_hz} Hz, 100 Hz asked"] if short else [])


def test_both_streams_are_named():
    monitors = {"ATTITUDE": StreamMonitor(), "LOCAL_POSITION_NED": StreamMonitor()}
    assert [words.split()[0] for words in shortfalls(StreamParams(), monitors, 0)] == ["ATTITUDE", "LOCAL_POSITION_NED"]


def test_the_requests_set_the_intervals():
    commands = requests(StreamParams(position_hz=50.0, attitude_hz=200.0), PX4)
    intervals = {int(command.params[0]): command.params[1] for command in commands}
    assert intervals[mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED] == 20_000.0
    assert intervals[mavlink.MAVLINK_MSG_ID_ATTITUDE] == 5_000.0
    assert intervals[mavlink.MAVLINK_MSG_ID_HIGHRES_IMU] == -1.0
    assert len(commands) == len(wanted(StreamParams(), PX4))


@pytest.mark.parametrize(("rate_hz", "gap_us"), [(50.0, 80_000), (100.0, 40_000), (250.0, 40_000)])
def test_a_pose_stream_that_falls_silent_is_asked_for_until_it_comes(rate_hz, gap_us):
    keeper = StreamKeeper(StreamParams(attitude_hz=rate_hz, position_hz=rate_hz), PX4)
    assert keeper.gap_deadline_us() == NEVER_US
    attitude, position = mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
    keeper.on_message(attitude, 1_000_000)
    keeper.on_message(position, 1_020_000)
    assert keeper.gap_deadline_us() == 1_000_000 + gap_us
    assert keeper.after_gap(1_000_000 + gap_us - 4) == []
    for late in (1, 2):
        [asked] = keeper.after_gap(1_000_000 + late * gap_us)
        assert asked.params[:2] == (attitude, 1e6 / rate_hz)
        keeper.on_message(position, 1_020_000 + late * gap_us)
    keeper.on_message(attitude, 2_000_000)
    keeper.on_message(position, 2_000_000)
    assert keeper.gap_deadline_us() == 2_000_000 + gap_us
