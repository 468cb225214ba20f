"""Signatures of MAVLink 2, held against pymavlink's both ways, and what they are there to keep out."""

from __future__ import annotations

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.protocol.codec import Encoder, Framer, decode, is_valid
from mavquad.protocol.signing import EPOCH_US, Signing, key_of_hex, key_of_passphrase, timestamp_at

KEY = bytes(range(32))
NOW_US = EPOCH_US + 400_000_000_000_000
MESSAGE = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
NOW = timestamp_at(NOW_US)
MINUTE_US = 60_000_000


def signed(now_us=NOW_US, key=KEY, link_id=3, source=(9, 7), sender=None):
    sender = sender or Signing(key, link_id)
    return sender.sign(Encoder(*source).encode(MESSAGE, signed=True), now_us)


def pymavlink_end(key=KEY, link_id=3, timestamp=NOW):
    mav = dialect.MAVLink(None, srcSystem=9, srcComponent=7)
    mav.signing.secret_key = key
    mav.signing.link_id = link_id
    mav.signing.timestamp = timestamp
    mav.signing.sign_outgoing = True
    return mav


@given(st.binary(min_size=32, max_size=32), st.integers(0, 255), st.integers(1, 2**47), st.integers(1, 5))
def test_pymavlink_signs_the_same_bytes(key, link_id, timestamp, count):
    theirs, ours, encoder = pymavlink_end(key, link_id, timestamp), Signing(key, link_id), Encoder(9, 7)
    for _ in range(count):
        frame = ours.sign(encoder.encode(MESSAGE, signed=True), EPOCH_US + 10 * timestamp)
        assert frame == bytes(MESSAGE.pack(theirs))
        theirs.seq += 1


def test_pymavlink_takes_ours_and_we_take_theirs():
    theirs, ours = pymavlink_end(), Signing(KEY, 5)
    frame = signed(sender=ours)
    message = theirs.decode(bytearray(frame))
    assert message.get_signed()
    assert message.get_link_id() == 5
    assert ours.check(bytes(MESSAGE.pack(theirs)), NOW_US) is None
    assert decode(frame).to_dict() == message.to_dict()


def test_a_signed_frame_passes_the_framer_whole():
    frame = signed()
    assert is_valid(frame)
    assert Framer().push(frame) == [frame]
    assert Framer().push(frame + frame) == [frame, frame]


@given(st.integers(0, 33), st.integers(0, 7))
def test_one_flipped_bit_is_noticed(at, bit):
    frame = bytearray(signed())
    assert len(frame) == 34
    frame[at] ^= 1 << bit
    assert Signing(KEY, 0).check(bytes(frame), NOW_US) in ("wrong signature", "unsigned")


def test_another_key_and_no_signature():
    receiver = Signing(KEY, 0)
    assert receiver.check(signed(key=bytes(32)), NOW_US) == "wrong signature"
    assert receiver.check(Encoder(1, 1).encode(MESSAGE), NOW_US) == "unsigned"
    assert receiver.check(Encoder(1, 1, version=1).encode(MESSAGE), NOW_US) == "unsigned"


def test_a_frame_is_taken_once_and_none_that_was_sent_before_it():
    receiver, sender = Signing(KEY, 0), Signing(KEY, 3)
    frames = [signed(sender=sender) for _ in range(3)]
    assert receiver.check(frames[1], NOW_US) is None
    assert [receiver.check(frame, NOW_US) for frame in frames] == ["old timestamp", "old timestamp", None]


def test_streams_are_told_apart_by_link_system_and_component():
    receiver = Signing(KEY, 0)
    late = signed(NOW_US + 10)
    assert receiver.check(late, NOW_US) is None
    for other in (
        signed(link_id=4),
        signed(source=(8, 7)),
        signed(source=(9, 8)),
    ):
        assert receiver.check(other, NOW_US) is None
        assert receiver.check(other, NOW_US) == "old timestamp"
    assert receiver.check(signed(), NOW_US) == "old timestamp"


def test_links_that_share_their_streams_take_no_replay_from_each_other():
    streams = {}
    first, second = Signing(KEY, 0, streams), Signing(KEY, 1, streams)
    frame = signed()
    assert first.check(frame, NOW_US) is None
    assert second.check(frame, NOW_US) == "old timestamp"


@pytest.mark.parametrize(("age_us", "verdict"), [(0, None), (MINUTE_US, None), (MINUTE_US + 10, "old timestamp")])
def test_a_new_stream_may_be_a_minute_behind(age_us, verdict):
    assert Signing(KEY, 0).check(signed(NOW_US - age_us), NOW_US) == verdict


def test_a_known_stream_may_be_as_late_as_it_likes():
    receiver, sender = Signing(KEY, 0), Signing(KEY, 3)
    first, second = signed(NOW_US, sender=sender), signed(NOW_US + 10, sender=sender)
    assert receiver.check(first, NOW_US) is None
    assert receiver.check(second, NOW_US + 10 * MINUTE_US) is None


def test_what_is_wrongly_signed_moves_no_timestamp():
    receiver = Signing(KEY, 0)
    forged = signed(NOW_US + 100 * MINUTE_US, key=bytes(32))
    assert receiver.check(forged, NOW_US) == "wrong signature"
    assert receiver.check(signed(), NOW_US) is None
    assert receiver.timestamp == timestamp_at(NOW_US)


def test_our_own_timestamps_grow_when_time_does_not_and_follow_who_is_ahead():
    sender = Signing(KEY, 3)
    frames = [signed(now_us, sender=sender) for now_us in (NOW_US, NOW_US, NOW_US - 1_000_000)]
    stamps = [int.from_bytes(frame[-12:-6], "little") for frame in frames]
    assert stamps == [timestamp_at(NOW_US) + n for n in range(3)]
    assert sender.check(signed(NOW_US + MINUTE_US, link_id=8), NOW_US) is None
    assert int.from_bytes(signed(sender=sender)[-12:-6], "little") == timestamp_at(NOW_US + MINUTE_US) + 1


def test_timestamps_count_ten_microseconds_since_2015():
    assert timestamp_at(1_420_070_400_000_000 + 25) == 2
    assert timestamp_at(0) == 0


def test_keys():
    assert key_of_passphrase("my secret") == hashlib.sha256(b"my secret").digest()
    assert key_of_hex(KEY.hex()) == KEY
    for wrong in ("", "00", "zz" * 32, KEY.hex() + "00"):
        with pytest.raises(ValueError, match="64 hexadecimal digits"):
            key_of_hex(wrong)
