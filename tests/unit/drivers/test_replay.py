"""The replay comparison: equal, and every way of not being equal."""

from __future__ import annotations

import pytest

from mavquad.drivers.replay import OperatorEvent, replay
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import Record

START_US = 1_000_000


def frame(number):
    return Encoder(1, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, number, 4, 3))


BEAT = frame(77)


class Echo:
    """Answers every frame with the same frame, and sends one of its own every 1000 us."""

    def __init__(self):
        self._next_us = START_US + 1000
        self._outbox = []

    def receive(self, data, now_us):
        self._outbox.append(data)

    def next_deadline_us(self):
        return self._next_us

    def on_deadline(self, now_us):
        self._next_us += 1000
        self._outbox.append(BEAT)

    def stop(self, now_us):
        self._outbox.append(b"stopped at %d" % (now_us - START_US))

    def goto(self, now_us, north_m, east_m):
        self._outbox.append(b"at %d to %a %a" % (now_us - START_US, north_m, east_m))

    def datagrams_to_send(self):
        outbox, self._outbox = self._outbox, []
        return outbox


def inbound(offset_us, data):
    return Record(START_US + offset_us, 0, data)


def outbound(offset_us, data):
    return Record(START_US + offset_us, 3, data)


RECORDS = [
    inbound(400, frame(1)),
    outbound(400, frame(1)),
    outbound(1000, BEAT),
    outbound(1200, b"stopped at 1200"),
    inbound(1600, frame(2)),
    outbound(1600, frame(2)),
    outbound(2000, BEAT),
]
EVENTS = [
    OperatorEvent(START_US, "start"),
    OperatorEvent(START_US + 1200, "stop"),
    OperatorEvent(START_US + 2400, "end"),
]


def result(records=RECORDS, events=EVENTS):
    return replay(Echo(), START_US, records, list(events))


def test_equal():
    found = result()
    assert found.equal
    assert (found.inbound, found.recorded, found.replayed, found.matched) == (2, 5, 5, 5)
    assert found.sent == [(r.stamp_us, r.frame) for r in RECORDS if r.outbound]


def test_the_order_of_the_events_in_their_file_does_not_matter():
    assert result(events=reversed(EVENTS)).equal


def test_a_changed_byte():
    records = [*RECORDS[:5], outbound(1600, frame(3)), *RECORDS[6:]]
    found = result(records)
    assert not found.equal
    assert (found.matched, found.first_mismatch.index) == (4, 3)
    assert found.first_mismatch.recorded == (START_US + 1600, frame(3))
    assert found.first_mismatch.replayed == (START_US + 1600, frame(2))


def test_a_changed_stamp():
    found = result([*RECORDS[:2], outbound(1004, BEAT), *RECORDS[3:]])
    assert (found.matched, found.first_mismatch.index) == (4, 1)


def test_a_changed_input():
    found = result([inbound(400, frame(9)), *RECORDS[1:]])
    assert (found.matched, found.first_mismatch.index) == (4, 0)


def test_a_last_frame_that_was_not_recorded():
    found = result(RECORDS[:-1])
    assert (found.recorded, found.replayed, found.matched) == (4, 5, 4)
    assert found.first_mismatch.recorded is None
    assert found.first_mismatch.replayed == (START_US + 2000, BEAT)


def test_a_recorded_frame_that_is_not_sent_again():
    found = result([*RECORDS, outbound(2200, frame(7))])
    assert (found.recorded, found.replayed, found.matched) == (6, 5, 5)
    assert found.first_mismatch.index == 5
    assert found.first_mismatch.replayed is None


def test_a_frame_missing_in_between_shows_there():
    found = result([*RECORDS[:2], *RECORDS[3:]])
    assert found.first_mismatch.index == 1
    assert found.matched == 1


def test_an_event_that_is_left_out_is_seen():
    found = result(events=[EVENTS[0], EVENTS[2]])
    assert found.first_mismatch.index == 2


def test_time_passes_up_to_the_end_and_no_further():
    assert result(RECORDS[:-1], [*EVENTS[:2], OperatorEvent(START_US + 1996, "end")]).equal
    assert result(RECORDS, [*EVENTS[:2], OperatorEvent(START_US + 2000, "end")]).equal


def test_an_event_behind_the_last_frame():
    records = [*RECORDS, outbound(2200, b"stopped at 2200")]
    assert result(records, [*EVENTS, OperatorEvent(START_US + 2200, "stop")]).equal


def test_an_event_with_arguments():
    records = [*RECORDS, outbound(2200, b"at 2200 to 0.1 -2.0")]
    assert result(records, [*EVENTS, OperatorEvent(START_US + 2200, "goto", (0.1, -2.0))]).equal
    assert not result(records, [*EVENTS, OperatorEvent(START_US + 2200, "goto", (0.1, -2.5))]).equal


def test_the_mismatch_for_people_and_machines():
    found = result([*RECORDS[:5], outbound(1600, frame(3)), *RECORDS[6:]])
    shown = found.first_mismatch.to_json()
    assert shown["index"] == 3
    assert shown["recorded"]["hex"] == frame(3).hex()
    assert "custom_mode : 3" in shown["recorded"]["message"]
    assert "custom_mode : 2" in shown["replayed"]["message"]
    assert shown["replayed"]["stamp_us"] == START_US + 1600


@pytest.mark.parametrize("side", ["recorded", "replayed"])
def test_a_side_without_a_frame(side):
    records = RECORDS[:-1] if side == "recorded" else [*RECORDS, outbound(2200, frame(7))]
    shown = result(records).first_mismatch.to_json()
    assert shown[side] is None
