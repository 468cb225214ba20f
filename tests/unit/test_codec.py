"""The codec against pymavlink's own parser, and the framer against every way that a transport cuts a stream."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.errors import InternalError
from mavquad.protocol import codec
from mavquad.protocol.codec import Encoder, Framer, mavlink
from mavquad.protocol.codec import framer as framer_module
from mavquad.protocol.codec.frame import is_one_frame

FLOATS = st.floats(width=32)
NAMES = st.binary(max_size=50).map(lambda text: text.replace(b"\0", b"."))
MESSAGES = st.one_of(
    st.builds(dialect.MAVLink_attitude_message, st.integers(0, 2**32 - 1), *[FLOATS] * 6),
    st.builds(dialect.MAVLink_local_position_ned_message, st.integers(0, 2**32 - 1), *[FLOATS] * 6),
    st.builds(
        dialect.MAVLink_heartbeat_message, *[st.integers(0, 255)] * 3, st.integers(0, 2**32 - 1), st.just(4), st.just(3)
    ),
    st.builds(dialect.MAVLink_statustext_message, st.integers(0, 7), NAMES),
    st.builds(dialect.MAVLink_timesync_message, *[st.integers(-(2**63), 2**63 - 1)] * 2),
)


def packed(message, kind="v2", sequence=0):
    """A frame of system 7, component 9: MAVLink 1, 2, or 2 with a signature."""
    sender = dialect.MAVLink(None, srcSystem=7, srcComponent=9)
    sender.seq = sequence
    if kind == "signed":
        sender.signing.secret_key = bytes(range(32))
        sender.signing.sign_outgoing = True
        sender.signing.timestamp = 123456789
    return bytes(message.pack(sender, force_mavlink1=kind == "v1"))


FRAMES = st.builds(packed, MESSAGES, st.sampled_from(["v1", "v2", "signed"]), st.integers(0, 255))
HEARTBEAT = packed(dialect.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3))
ATTITUDE = packed(dialect.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6))


def fields(message):
    """Name and values, where NaN equals NaN and 0.0 is not -0.0."""
    return message.get_type(), repr([getattr(message, name) for name in message.get_fieldnames()])


@given(FRAMES)
def test_decoded_values_are_those_of_pymavlinks_stream_parser(frame):
    [theirs] = dialect.MAVLink(None).parse_buffer(frame)
    assert fields(codec.decode(frame)) == fields(theirs)


@pytest.mark.parametrize("kind", ["v1", "v2", "signed"])
def test_header_fields(kind):
    frame = packed(dialect.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6), kind, sequence=201)
    assert codec.frame_length(frame, 0) == len(frame)
    assert codec.frame_source(frame) == (7, 9)
    assert codec.frame_sequence(frame) == 201
    assert codec.message_id(frame) == 30
    assert codec.is_valid(frame)


def test_message_id_of_three_bytes():
    frame = packed(dialect.MAVLink_cubepilot_firmware_update_start_message(1, 2, 3, 4))
    assert codec.message_id(frame) == 50004


@given(FRAMES, st.data())
def test_one_flipped_bit_is_noticed_or_changes_the_length(frame, data):
    body = len(frame) - 13 if frame[0] == codec.MAGIC_V2 and frame[2] else len(frame)
    position = data.draw(st.integers(1, body - 1))
    damaged = bytearray(frame)
    damaged[position] ^= 1 << data.draw(st.integers(0, 7))
    assert codec.frame_length(damaged, 0) != len(frame) or not codec.is_valid(bytes(damaged))


DATAGRAMS = st.one_of(
    FRAMES,
    st.builds(bytes.__add__, FRAMES, st.binary(max_size=3)),
    st.builds(lambda frame, kept: frame[: kept % (len(frame) + 1)], FRAMES, st.integers(0, 300)),
    st.binary(max_size=20),
    st.builds(bytes.__add__, st.sampled_from([b"\xfd\x00\x00", b"\xfe\x00", b"\xfd\x00\x02"]), st.binary(max_size=12)),
)


@given(DATAGRAMS, st.data())
def test_a_datagram_that_is_one_frame_is_told_by_its_length_and_its_crc(datagram, data):
    changed = bytearray(datagram)
    if changed and data.draw(st.booleans()):
        changed[data.draw(st.integers(0, len(changed) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    datagram = bytes(changed)
    is_whole = len(datagram) >= 8 and codec.frame_length(datagram, 0) == len(datagram)
    assert is_one_frame(datagram) is (is_whole and codec.is_valid(datagram))


def test_an_incompatible_flag_other_than_signed_starts_no_frame():
    assert codec.frame_length(bytes((codec.MAGIC_V2, 9, 0x02)), 0) == -1


def test_too_short_to_tell():
    assert codec.frame_length(bytes((codec.MAGIC_V2, 9)), 0) == 0
    assert codec.frame_length(bytes((codec.MAGIC_V1,)), 0) == 0


@pytest.mark.parametrize("frame", [b"", b"\xfe", HEARTBEAT[:-1], HEARTBEAT + b"\0", b"\0" + HEARTBEAT[1:]])
def test_decode_refuses_what_is_no_whole_frame(frame):
    with pytest.raises(InternalError, match="invalid frame"):
        codec.decode(frame)


@given(st.lists(FRAMES, max_size=6), st.data())
def test_a_stream_cut_anywhere_gives_the_same_frames(frames, data):
    stream = b"".join(frames)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    framer = codec.Framer()
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert [frame for piece in pieces for frame in framer.push(piece)] == frames
    assert framer.bad_bytes == 0
    assert framer.bad_chunks == 0


@given(st.lists(st.tuples(st.binary(max_size=30), FRAMES), min_size=1, max_size=5))
def test_garbage_between_frames_costs_no_frame(pairs):
    framer = codec.Framer()
    found = framer.push(b"".join(garbage + frame for garbage, frame in pairs))
    found += framer.push(bytes(300))
    assert found == [frame for _, frame in pairs]
    assert framer.bad_bytes == sum(len(garbage) for garbage, _ in pairs) + 300


@given(FRAMES, FRAMES, FRAMES, st.data())
def test_a_truncated_datagram_does_not_delay_whole_ones(first, second, third, data):
    kept = data.draw(st.integers(1, len(first) - 1))
    framer = codec.Framer()
    assert framer.push(first[:kept]) == []
    assert framer.push(second) == [second]
    assert framer.push(third) == [third]
    assert framer.bad_bytes == kept
    assert framer.bad_chunks == 1


def test_every_byte_alone():
    framer = codec.Framer()
    stream = HEARTBEAT + ATTITUDE
    found = [framer.push(stream[i : i + 1]) for i in range(len(stream))]
    assert found[len(HEARTBEAT) - 1] == [HEARTBEAT]
    assert found[-1] == [ATTITUDE]
    assert sum(map(len, found)) == 2


def test_bad_chunks_counts_chunks_not_bytes():
    framer = codec.Framer()
    framer.push(b"\x00\x00\x00" + HEARTBEAT + b"\x00")
    framer.push(HEARTBEAT)
    framer.push(b"\x01")
    assert (framer.bad_bytes, framer.bad_chunks) == (5, 2)


def test_one_frame_is_taken_whole_and_nothing_else_is():
    frame = Encoder(7, 9).encode(mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3))
    framer = Framer()
    for chunk in (b"", frame[:-1], frame + b"x", frame + frame, frame[:-1] + bytes((frame[-1] ^ 1,))):
        assert not framer.takes(chunk)
    assert framer.push(frame[:5]) == []
    assert not framer.takes(frame)  # what began before it comes first
    assert framer.push(frame) == [frame]
    encoder = Encoder(7, 9)
    encoder.sequence = 4
    assert framer.takes(encoder.encode(mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)))
    assert framer.lost((7, 9)) == 3
    assert framer.bad_bytes == 5


def test_empty_chunk():
    framer = codec.Framer()
    assert framer.push(b"") == []
    framer.push(HEARTBEAT[:5])
    assert framer.push(b"") == []
    assert framer.push(HEARTBEAT[5:]) == [HEARTBEAT]


def test_encoder_counts_its_sequence_round_and_names_its_sender():
    encoder = codec.Encoder(245, 191)
    frames = [encoder.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)) for _ in range(257)]
    assert [codec.frame_sequence(frame) for frame in frames] == [*range(256), 0]
    assert {codec.frame_source(frame) for frame in frames} == {(245, 191)}
    assert all(frame[0] == codec.MAGIC_V2 and codec.is_valid(frame) for frame in frames)


def unknown_frame(number: int = 410, sequence: int = 7, payload: bytes = b"\xfd\x01\x02") -> bytes:
    """A frame of a message that the dialect does not have, as PX4 sends its events; its CRC cannot be checked."""
    header = bytes((0xFD, len(payload), 0, 0, sequence, 1, 1)) + number.to_bytes(3, "little")
    return header + payload + b"\xab\xcd"


def test_frames_of_unknown_messages_are_frames_and_not_damage():
    framer = Framer()
    encoder = Encoder(1, 1)
    known = [encoder.encode(mavlink.MAVLink_attitude_message(i, 0, 0, 0, 0, 0, 0)) for i in range(3)]
    unknown = unknown_frame(sequence=2)
    assert framer.push(known[0] + known[1] + unknown) == [known[0], known[1], unknown]
    assert (framer.unknown, framer.bad_bytes, framer.lost((1, 1))) == (1, 0, 0)
    assert framer.push(unknown_frame(sequence=5) + known[2]) == [unknown_frame(sequence=5), known[2]]


def test_an_unknown_frame_must_not_swallow_a_good_one():
    framer = Framer()
    good = Encoder(1, 1).encode(mavlink.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0))
    assert framer.push(unknown_frame(payload=b"xx" + good)) == [good]
    assert framer.unknown == 0
    assert framer.bad_bytes == 10 + 2 + 2


def test_rubbish_behind_an_unknown_frame_makes_it_rubbish():
    framer = Framer()
    assert framer.push(unknown_frame(payload=b"abc") + b"rubbish") == []
    assert framer.unknown == 0
    assert framer.bad_bytes == 15 + 7


def test_a_crafted_datagram_costs_a_few_steps_a_byte(monkeypatch):
    calls = 0
    real = codec.frame_length

    def counted(buffer, at):
        nonlocal calls
        calls += 1
        return real(buffer, at)

    monkeypatch.setattr(framer_module, "frame_length", counted)
    # Many would-be frames of unknown messages, one over the other, each with a good frame inside it.
    crafted = (b"\xfd\xfd\x00" * 75 + HEARTBEAT) * 260
    framer = Framer()
    assert set(framer.push(crafted)) == {HEARTBEAT}
    assert len(crafted) > 60_000
    assert calls < 3 * len(crafted)


class ReferenceFramer(Framer):
    """Looks for a frame inside an unknown one the plain way."""

    def _is_unknown(self, frame, start, valid):
        end = start + len(frame)
        buffer = valid._buffer
        if codec.is_known(frame) or (end < len(buffer) and buffer[end] not in (0xFD, 0xFE)):
            return False
        if any(framer_module._frame_starts(buffer[inner:], 0) for inner in range(start + 1, end)):
            return False
        self.unknown += 1
        return True


PIECES = st.one_of(
    FRAMES, st.binary(max_size=8), st.just(b"\xfd\x03\x00"), st.builds(unknown_frame, payload=st.binary(max_size=60))
)


@given(st.lists(PIECES, max_size=12).map(b"".join))
def test_looking_once_finds_what_looking_everywhere_finds(stream):
    framer, reference = Framer(), ReferenceFramer()
    assert framer.push(stream) == reference.push(stream)
    assert (framer.unknown, framer.bad_bytes) == (reference.unknown, reference.bad_bytes)
