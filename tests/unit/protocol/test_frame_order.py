"""Frames of the vehicle that come twice, and HEARTBEATs that come late."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mavquad.protocol.codec import Encoder, mavlink
from mavquad.protocol.frame_order import FrameOrder

LOITER, OFFBOARD, POSCTL = 0x03040000, 0x00060000, 0x00030000
TICK_US = 4_000
"""Between two frames of the vehicle."""


class Sender:
    """A vehicle: every frame has the next sequence number."""

    def __init__(self, sequence=0):
        self._encoder = Encoder(1, 1)
        self._encoder.sequence = sequence
        self._stamp_ms = 0

    def heartbeat(self, mode=LOITER):
        return self._encoder.encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, mode, 4, 3))

    def attitude(self):
        self._stamp_ms += 4
        return self._encoder.encode(mavlink.MAVLink_attitude_message(self._stamp_ms, 0, 0, 0, 0, 0, 0))

    def attitudes(self, count):
        return [self.attitude() for _ in range(count)]


class Receiver:
    """Takes frames a tick apart."""

    def __init__(self):
        self._order = FrameOrder()
        self.now_us = 1_700_000_000_000_000

    def take(self, frame, is_heartbeat=False):
        self.now_us += TICK_US
        return self._order.fault(frame, is_heartbeat, self.now_us)

    def beat(self, frame):
        return self.take(frame, True)

    def take_all(self, frames):
        return [fault for frame in frames if (fault := self.take(frame)) is not None]


def begun(sequence=0):
    """A sender and a receiver in the middle of a flight."""
    sender, receiver = Sender(sequence), Receiver()
    for mode in (LOITER, OFFBOARD):
        assert receiver.beat(sender.heartbeat(mode)) is None
        assert receiver.take_all(sender.attitudes(249)) == []
    return sender, receiver


@pytest.mark.parametrize("behind", [0, 1, 50, 127, 128, 200, 254, 257, 400, 1000])
def test_a_heartbeat_that_comes_again_is_a_copy_however_late(behind):
    sender, receiver = begun()
    copied = sender.heartbeat(LOITER)
    assert receiver.beat(copied) is None
    for _ in range(behind // 250):
        receiver.take_all(sender.attitudes(249))
        assert receiver.beat(sender.heartbeat(OFFBOARD)) is None
    receiver.take_all(sender.attitudes(behind % 250))
    assert receiver.beat(copied) == "doubled"
    assert receiver.beat(copied) == "doubled"
    assert receiver.beat(sender.heartbeat(OFFBOARD)) is None


def test_every_frame_that_comes_again_is_a_copy():
    sender, receiver = begun()
    frames = sender.attitudes(100)
    assert receiver.take_all(frames) == []
    assert receiver.take_all(frames) == ["doubled"] * 100


def test_a_heartbeat_after_a_later_one_is_late():
    sender, receiver = begun()
    first, _, second = sender.heartbeat(LOITER), sender.attitudes(60), sender.heartbeat(OFFBOARD)
    assert receiver.beat(second) is None
    assert receiver.beat(first) == "late"


def test_a_late_pose_is_left_to_its_stamp():
    sender, receiver = begun()
    first, *rest = sender.attitudes(50)
    assert receiver.take_all([*rest, first]) == []


def test_what_follows_the_newest_frame_is_new_whatever_was_said_before():
    sender, receiver = begun()
    assert receiver.beat(sender.heartbeat(LOITER)) is None
    receiver.take_all(sender.attitudes(255))
    assert receiver.beat(sender.heartbeat(LOITER)) is None  # the same bytes, a turn later


@given(overtaken=st.integers(0, 127), lost=st.integers(0, 127), sequence=st.integers(0, 255))
def test_a_take_over_is_seen_at_its_first_heartbeat(overtaken, lost, sequence):
    """Lost frames before it, and frames that have overtaken it, do not hide it."""
    assume(overtaken + lost <= 127)
    sender, receiver = begun(sequence)
    sender.attitudes(lost)
    first = sender.heartbeat(POSCTL)
    receiver.take_all(sender.attitudes(overtaken))
    assert receiver.beat(first) is None


@given(
    sequence=st.integers(0, 255),
    modes=st.lists(st.sampled_from((LOITER, OFFBOARD, POSCTL)), min_size=2, max_size=6),
    between=st.integers(20, 120),
    data=st.data(),
)
def test_modes_are_heard_in_the_order_in_which_they_were_shown(sequence, modes, between, data):
    """Any HEARTBEATs doubled, copies up to three HEARTBEATs late: the modes heard are those shown, in their order."""
    sender, receiver = Sender(sequence), Receiver()
    sent, heard, copies = [], [], {}
    for turn, mode in enumerate(modes):
        frame = sender.heartbeat(mode)
        sent.append(mode)
        if receiver.beat(frame) is None:
            heard.append(mode)
        if data.draw(st.booleans()):
            copies.setdefault(turn + data.draw(st.integers(0, 3)), []).append((frame, mode))
        receiver.take_all(sender.attitudes(between))
        heard += [mode for copy, mode in copies.pop(turn, []) if receiver.beat(copy) is None]
    assert heard == sent


@given(
    before=st.integers(0, 255),
    flown=st.integers(0, 600),
    silent_us=st.integers(0, 5_000_000),
    between=st.integers(2, 249),
)
def test_a_vehicle_that_reboots_is_heard_again_at_its_fourth_heartbeat_at_the_latest(before, flown, silent_us, between):
    sender, receiver = begun(before)
    receiver.beat(sender.heartbeat(OFFBOARD))
    receiver.take_all(sender.attitudes(flown))
    receiver.now_us += silent_us
    rebooted, heard = Sender(), []
    for _ in range(4):
        heard.append(receiver.beat(rebooted.heartbeat(LOITER)) is None)
        receiver.take_all(rebooted.attitudes(between))
        receiver.now_us += 1_000_000 - between * TICK_US
    assert any(heard)
    if silent_us > 1_000_000:  # where its streams were missed, at the first
        assert heard[0]
