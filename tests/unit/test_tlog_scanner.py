"""The fast scanner finds what the rules say, however the bytes come; tests/bench/tlog_fuzz.py goes on for hours."""

from __future__ import annotations

import random

from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.protocol.codec import is_valid
from mavquad.tlog import Scanner, pack_record
from tests.tlog_mutations import T0_US, known_frame, log, mutated, pieces_of, tunnel
from tests.tlog_oracle import Oracle


def scanned(pieces):
    scanner = Scanner()
    parts = [scanner.push(piece) for piece in pieces]
    parts.append(scanner.finish())
    columns = ((part.stamps.tolist(), part.starts.tolist(), part.ends.tolist()) for part in parts)
    return scanner, [row for column in columns for row in zip(*column, strict=True)]


def compare(data, pieces):
    """The scanner with the oracle."""
    oracle = Oracle(data)
    scanner, found = scanned(pieces)
    assert found == oracle.found
    assert scanner.bad_ranges == oracle.bad_ranges
    assert (scanner.unknown_frames, scanner.repaired_stamps) == (oracle.unknown_frames, oracle.repaired_stamps)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_damaged_logs_in_pieces(seed):
    draw = random.Random(seed)
    data = mutated(draw, log(draw, draw.randrange(10)))
    compare(data, pieces_of(draw, data))


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=600))
def test_any_bytes(data):
    compare(data, [data])


def test_byte_by_byte():
    draw = random.Random(5)
    data = mutated(draw, log(draw, 12))
    compare(data, [data[at : at + 1] for at in range(len(data))])


def test_a_frame_inside_a_frame_is_not_another():
    draw = random.Random(3)
    inner = known_frame(draw)
    outer = tunnel(inner)
    data = b"".join(pack_record(T0_US, frame, False) for frame in (known_frame(draw), outer, known_frame(draw)))
    compare(data, [data])
    assert len(scanned([data])[1]) == 3


def test_the_frame_behind_a_stamp_goes_before_one_that_begins_in_the_stamp():
    """A frame of version 1 from the last two bytes of the stamp (marker, length 8) on, into the true frame's payload,
    where its CRC happens to stand."""
    stamp = (T0_US >> 16 << 16 | 0xFE08).to_bytes(8, "big")
    head = (stamp + ping(0))[:20]
    crc = mcrf4xx(head[7:] + bytes([dialect.MAVLink_heartbeat_message.crc_extra]))
    data = stamp + ping(crc << 16)
    assert [is_valid(data[6:22]), is_valid(data[8:])] == [True, True]
    compare(data, [data])
    assert [row[1] for row in scanned([data])[1]] == [8]


def ping(time_usec):
    message = dialect.MAVLink_ping_message(time_usec, 1, 0, 1)
    return bytes(message.pack(dialect.MAVLink(None, srcSystem=1, srcComponent=1)))


def test_what_is_kept_of_long_damage_is_little():
    scanner = Scanner()
    for _ in range(50):
        scanner.push(bytes(10_000))
        assert len(scanner._buffer) < 1000
    record = pack_record(T0_US, known_frame(random.Random(1)), False)
    found = [*scanner.push(record).starts, *scanner.finish().starts]
    assert found == [500_008]
    assert scanner.bad_ranges == [(0, 500_000)]


def test_a_log_that_grows_gives_its_frames_as_they_are_decided():
    records = [pack_record(T0_US + 4000 * i, known_frame(random.Random(i)), False) for i in range(60)]
    scanner, counts = Scanner(), []
    for record in records:
        counts.append(len(scanner.push(record)))
    assert sum(counts[:30]) >= 20
    assert sum(counts) + len(scanner.finish()) == 60
    assert scanner.bad_ranges == []


def test_a_frame_with_flags_that_nobody_knows_is_damage():
    body = bytearray(ping(1)[1:-2])
    body[1] = 2
    crc = mcrf4xx(bytes(body) + bytes([dialect.MAVLink_ping_message.crc_extra]))
    data = pack_record(T0_US, b"\xfd" + bytes(body) + crc.to_bytes(2, "little"), False)
    compare(data, [data])
    assert scanned([data])[1] == []


def test_a_good_frame_inside_an_unknown_one_is_found_however_the_bytes_come():
    draw = random.Random(11)
    good = [pack_record(T0_US, known_frame(draw), False) for _ in range(14)]
    payload = b"ab" + good[0]
    swallowing = bytes((0xFD, len(payload), 0, 0, 9, 1, 1, 0xEF, 0xCD, 0xAB)) + payload + b"\x11\x22"
    data = good[1] + pack_record(T0_US, swallowing, False) + b"".join(good[2:])
    compare(data, [data[at : at + 1] for at in range(len(data))])
    assert len(scanned([data])[1]) == 14
