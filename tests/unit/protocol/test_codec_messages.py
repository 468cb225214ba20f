"""Every message of the dialect, packed and unpacked as pymavlink does it: the same bytes, the same values."""

from __future__ import annotations

import copy
import inspect
import struct

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import example, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.errors import InternalError
from mavquad.protocol.codec import Encoder, decode, frame_version, is_signed, is_valid, mavlink
from mavquad.protocol.codec.layout import BY_KIND, BY_NUMBER

KINDS = list(dialect.mavlink_map.values())
BYTES = st.one_of(st.integers(0, 255), st.sampled_from([0, 0xFF, 0x7F, 0xC0]))
"""Zeros for texts and ends of payloads, the others for NaN and infinity."""
HEADERS = st.tuples(*[st.integers(0, 255)] * 3)
"""Sequence, system, component."""


@st.composite
def payloads(draw, longer=0):
    """A kind of message, and a payload: any bytes, as long as the fields are, shorter, or longer."""
    kind = draw(st.sampled_from(KINDS))
    size = kind.unpacker.size
    length = draw(st.one_of(st.just(size), st.integers(1, min(size + longer, 255))))
    filled = draw(st.integers(0, length))
    return kind, bytes(draw(st.lists(BYTES, min_size=filled, max_size=filled))).ljust(length, b"\0")


def framed(kind, payload, header, version):
    """A frame as anybody may send it: "v1", "v2" or "signed"."""
    sequence, system_id, component_id = header
    if version == "v1":
        body = bytes((len(payload), sequence, system_id, component_id, kind.id))
        start, signature = b"\xfe", b""
    else:
        signature = bytes(range(13)) if version == "signed" else b""
        body = bytes((len(payload), bool(signature), 0, sequence, system_id, component_id)) + kind.id.to_bytes(
            3, "little"
        )
        start = b"\xfd"
    body += payload
    return start + body + mcrf4xx(body + bytes((kind.crc_extra,))).to_bytes(2, "little") + signature


def shown(message):
    """All that a message tells of itself; NaN equals NaN, and 0.0 is not -0.0."""
    header = message.get_header()
    return {
        "dict": repr(message.to_dict()),
        "text": str(message),
        "raw": {name: value for name, value in vars(message).items() if name.endswith("_raw")},
        "fields": message.get_fieldnames(),
        "types": [type(getattr(message, name)) for name in message.get_fieldnames()],
        "id": message.get_msgId(),
        "sender": (message.get_srcSystem(), message.get_srcComponent(), message.get_seq()),
        "header": vars(header),
        "bytes": (message.get_msgbuf(), message.get_payload(), message.get_crc()),
        "signature": (message.get_signed(), message.get_link_id()),
        "instance": (message._instance_field, message._instance_offset, message._instances),
    }


@given(payloads(longer=9), HEADERS, st.sampled_from(["v1", "v2", "signed"]))
@example((dialect.MAVLink_statustext_message, b"\x03" + b"x" * 50 + bytes(3)), (1, 2, 3), "v2")
@example((dialect.MAVLink_statustext_message, b"\x03ab\0cd"), (1, 2, 3), "v2")
@example(
    (dialect.MAVLink_attitude_message, bytes.fromhex("01000000 0000c07f 0000807f 000080ff 0100a07f")), (0, 0, 0), "v2"
)
def test_decoded_as_pymavlink_decodes(kind_and_payload, header, version):
    kind, payload = kind_and_payload
    if version == "v1" and kind.id > 255:
        version = "v2"
    frame = framed(kind, payload, header, version)
    assert is_valid(frame)
    [theirs] = dialect.MAVLink(None).parse_buffer(frame)
    ours = decode(frame)
    assert isinstance(ours, kind)
    assert shown(ours) == shown(theirs)


def built(kind, payload, constructor=None):
    """The message with these fields, made by a constructor, pymavlink's or another; texts keep zeros inside and at the end."""
    values = list(struct.unpack(kind.unpacker.format, payload.ljust(kind.unpacker.size, b"\0")[: kind.unpacker.size]))
    fields = {}
    for name, length in zip(kind.ordered_fieldnames, kind.lengths, strict=True):
        fields[name] = values.pop(0) if length == 1 else [values.pop(0) for _ in range(length)]
    return (constructor or kind)(*(fields[name] for name in kind.fieldnames))


@given(payloads(), HEADERS)
def test_encoded_as_pymavlink_packs(kind_and_payload, header):
    sequence, system_id, component_id = header
    message = built(*kind_and_payload)
    theirs = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
    theirs.seq = sequence
    ours = Encoder(system_id, component_id)
    ours.sequence = sequence
    expected = bytes(message.pack(theirs))
    assert ours.encode(message) == expected
    # A message that was received is packed again all the same, by either.
    received = decode(expected)
    ours.sequence = sequence
    assert ours.encode(received) == expected
    assert bytes(received.pack(theirs)) == expected


@given(payloads())
def test_our_constructors_are_pymavlinks(kind_and_payload):
    kind, payload = kind_and_payload
    own = getattr(mavlink, kind.__name__)
    theirs, ours = built(kind, payload), built(kind, payload, own)
    assert type(ours) is own
    assert isinstance(ours, kind)
    assert shown(ours) == shown(theirs)
    assert Encoder(1, 2).encode(ours) == Encoder(1, 2).encode(theirs)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.msgname)
def test_our_constructors_take_what_pymavlinks_take(kind):
    def parameters(cls):
        return [(p.name, p.default) for p in inspect.signature(cls).parameters.values()]

    assert parameters(getattr(mavlink, kind.__name__)) == parameters(kind)


@given(payloads(), HEADERS)
def test_version_1_is_pymavlinks_without_extension_fields(kind_and_payload, header):
    kind, payload = kind_and_payload
    sequence, system_id, component_id = header
    message = built(kind, payload)
    encoder = Encoder(system_id, component_id, version=1)
    encoder.sequence = sequence
    if kind.id > 255:
        assert not encoder.can_say(message)
        with pytest.raises(InternalError, match=f"MAVLink 1 has no message {kind.id}"):
            encoder.encode(message)
        return
    assert encoder.can_say(message)
    frame = encoder.encode(message)
    theirs = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
    theirs.seq = sequence
    packed = bytes(message.pack(theirs, force_mavlink1=True))
    size = BY_KIND[kind].base_size
    assert frame[6:-2] == packed[6 : 6 + size]
    assert (frame[0], frame[1], frame[2:6]) == (0xFE, size, packed[2:6])
    assert is_valid(frame)
    assert frame_version(frame) == 1


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.msgname)
def test_crc_extra_covers_the_base_fields(kind):
    """CRC_EXTRA is a checksum over name and base fields (MAVLink's serialization guide): no extension is among them."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    text, size = f"{kind.msgname} ".encode(), 0
    tokens = kind.unpacker.format[1:]
    layout = BY_NUMBER[kind.id]
    for name, _, text_length in zip(kind.ordered_fieldnames, kind.lengths, kind.array_lengths, strict=True):
        if size == layout.base_size:
            break
        text += f"{types[name]} {name} ".encode()
        text += bytes((text_length,)) if text_length else b""
        digits = len(tokens) - len(tokens.lstrip("0123456789"))
        size += struct.calcsize("<" + tokens[: digits + 1])
        tokens = tokens[digits + 1 :]
    crc = mcrf4xx(text)
    assert size == layout.base_size
    assert (crc & 0xFF) ^ (crc >> 8) == kind.crc_extra


def test_the_bit_that_announces_a_signature():
    message = dialect.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)
    plain, signed = Encoder(1, 1).encode(message), Encoder(1, 1).encode(message, signed=True)
    assert not is_signed(plain)
    assert is_signed(signed)
    assert is_valid(signed)


def test_arrays_are_packed_from_any_sequence_and_no_longer_than_they_are():
    frames = [
        Encoder(1, 1).encode(dialect.MAVLink_attitude_target_message(1, 0, q, 0.0, 0.0, 0.0, 0.5))
        for q in ([1.0, 0.0, 0.5, 0.0], (1.0, 0.0, 0.5, 0.0), [1.0, 0.0, 0.5, 0.0, 9.0])
    ]
    assert len(set(frames)) == 1


@pytest.mark.parametrize("changes", [{"time_boot_ms": -1}, {"time_boot_ms": 1.5}, {"roll": None}])
def test_a_value_that_does_not_fit_is_an_error_as_with_pymavlink(changes):
    message = dialect.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(struct.error):
        message.pack(dialect.MAVLink(None))
    with pytest.raises(struct.error):
        Encoder(1, 1).encode(message)


def test_a_decoded_message_can_be_copied():
    message = decode(Encoder(3, 4).encode(dialect.MAVLink_param_value_message(b"NAME", 1.5, 9, 3, 1)))
    assert shown(copy.deepcopy(message)) == shown(message)
    assert copy.copy(message) == message
