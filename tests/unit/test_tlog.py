"""The log's writer and reader: nothing lost, whatever is wrong with the file; and the counts of real logs."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.errors import InternalError, LogError
from mavquad.tlog import Record, TlogWriter, pack_record, read_records, scan
from tests.tlog_reference import FRAMES_OF, LOGS

T0_US = 1_700_000_000_000_000


def frame_of(value, kind="v2"):
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    if kind == "signed":
        sender.signing.secret_key = bytes(32)
        sender.signing.sign_outgoing = True
        sender.signing.timestamp = 77
    message = dialect.MAVLink_local_position_ned_message(value, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    return bytes(message.pack(sender, force_mavlink1=kind == "v1"))


def unknown_frame(payload=b"12345"):
    """MAVLink 2 with message id 0xABCDEF, which no dialect has."""
    return bytes((0xFD, len(payload), 0, 0, 9, 1, 1, 0xEF, 0xCD, 0xAB)) + payload + b"\x11\x22"


KINDS = ("v1", "v2", "signed")
FRAMES = st.builds(frame_of, st.integers(0, 2**32 - 1), st.sampled_from(KINDS))
STAMPS = st.integers(0, 3_600_000_000 // 4).map(lambda ticks: T0_US + 4 * ticks)
RECORDS = st.builds(Record, STAMPS, st.sampled_from([0, 3]), FRAMES)
SHORT_LOG = [Record(T0_US + 4000 * i, 3 * (i % 2), frame_of(i, KINDS[i % 3])) for i in range(6)]


def as_bytes(record):
    return pack_record(record.stamp_us, record.frame, record.outbound)


def log_of(records):
    return b"".join(map(as_bytes, records))


@given(st.lists(RECORDS, max_size=8))
def test_what_is_written_is_read_back(records):
    stream = io.BytesIO()
    writer = TlogWriter(stream)
    for record in records:
        writer.write(record.stamp_us, record.frame, record.outbound)
    contents = scan(stream.getvalue())
    assert list(contents) == records
    assert contents.bad_ranges == []


@given(st.lists(st.tuples(st.binary(max_size=40), RECORDS), min_size=1, max_size=6), st.binary(max_size=40))
def test_garbage_in_between_costs_nothing(pairs, tail):
    contents = scan(b"".join(garbage + as_bytes(record) for garbage, record in pairs) + tail)
    assert list(contents) == [record for _, record in pairs]
    assert contents.bad_bytes == sum(len(garbage) for garbage, _ in pairs) + len(tail)


def test_truncation_at_every_byte_keeps_every_whole_record():
    data = log_of(SHORT_LOG)
    ends = [len(log_of(SHORT_LOG[: i + 1])) for i in range(len(SHORT_LOG))]
    for cut in range(len(data)):
        contents = scan(data[:cut])
        whole = sum(end <= cut for end in ends)
        assert list(contents) == SHORT_LOG[:whole]
        rest = cut - (ends[whole - 1] if whole else 0)
        assert contents.bad_ranges == ([(cut - rest, rest)] if rest else [])


def test_a_missing_head_costs_only_the_first_record():
    data = log_of(SHORT_LOG)
    for cut in range(9, len(as_bytes(SHORT_LOG[0]))):
        assert list(scan(data[cut:])) == SHORT_LOG[1:]


def test_one_damaged_byte_costs_no_other_frame():
    data = log_of(SHORT_LOG)
    for position in range(len(data)):
        for mask in (0x01, 0x80, 0xFF):
            damaged = bytearray(data)
            damaged[position] ^= mask
            found = [record.frame for record in scan(bytes(damaged))]
            hit = next(i for i in range(6) if position < len(log_of(SHORT_LOG[: i + 1])))
            assert [f for i, f in enumerate(r.frame for r in SHORT_LOG) if i != hit] == [
                f for f in found if f != SHORT_LOG[hit].frame and f[:-13] != SHORT_LOG[hit].frame[:-13]
            ]


def test_two_writers_torn_into_each_other():
    first, second, third = map(as_bytes, SHORT_LOG[:3])
    contents = scan(first[:20] + second + first[20:] + third)
    assert list(contents) == SHORT_LOG[1:3]
    assert contents.bad_ranges == [(0, 20), (20 + len(second), len(first) - 20)]


def test_a_frame_of_an_unknown_message_is_passed_over_and_is_not_damage():
    known = SHORT_LOG[:2]
    data = as_bytes(known[0]) + pack_record(T0_US, unknown_frame(), False) + as_bytes(known[1])
    contents = scan(data + pack_record(T0_US, unknown_frame(), False))
    assert list(contents) == known
    assert (contents.unknown_frames, contents.bad_bytes) == (2, 0)


def test_an_unknown_message_that_swallows_a_good_frame_is_damage():
    hidden = as_bytes(SHORT_LOG[1])
    data = as_bytes(SHORT_LOG[0]) + pack_record(T0_US, unknown_frame(b"ab" + hidden), False) + as_bytes(SHORT_LOG[2])
    contents = scan(data)
    assert list(contents) == SHORT_LOG[:3]
    assert contents.unknown_frames == 0
    assert contents.bad_bytes == 8 + 10 + 2 + 2


def test_an_unknown_message_with_torn_surroundings_is_damage():
    data = as_bytes(SHORT_LOG[0]) + pack_record(T0_US, unknown_frame(), False) + b"torn" + as_bytes(SHORT_LOG[1])
    contents = scan(data)
    assert list(contents) == SHORT_LOG[:2]
    assert (contents.unknown_frames, contents.bad_bytes) == (0, 8 + len(unknown_frame()) + 4)


def test_backward_stamps_and_jumps_of_a_year_are_kept_where_the_records_are_intact():
    stamps_us = [T0_US, T0_US - 77_000_000, T0_US + 365 * 86_400_000_000, T0_US]
    data = b"".join(pack_record(stamp_us, frame_of(1), False) for stamp_us in stamps_us)
    assert [record.stamp_us for record in scan(data)] == stamps_us


def test_a_stamp_lost_with_the_bytes_before_it_is_the_previous_ones():
    data = as_bytes(SHORT_LOG[1]) + b"\xaa\xbb" + SHORT_LOG[2].frame + as_bytes(SHORT_LOG[3])
    contents = scan(data)
    assert [record.stamp_us for record in contents] == [SHORT_LOG[i].stamp_us for i in (1, 1, 3)]
    assert [record.link for record in contents] == [3, 0, 3]
    assert (contents.repaired_stamps, contents.bad_bytes) == (1, 2)


def test_an_implausible_stamp_behind_damage_is_the_previous_ones():
    year_off = pack_record(T0_US + 365 * 86_400_000_000, frame_of(9), False)
    contents = scan(as_bytes(SHORT_LOG[0]) + b"x" + year_off)
    assert [record.stamp_us for record in contents] == [T0_US, T0_US]


def test_leading_frames_without_a_stamp_get_the_first_that_there_is():
    contents = scan(frame_of(1) + frame_of(2) + as_bytes(SHORT_LOG[1]))
    assert [record.stamp_us for record in contents] == [SHORT_LOG[1].stamp_us] * 3
    assert [record.outbound for record in contents] == [False, False, True]


def test_a_stream_without_stamps_is_read_with_stamp_zero():
    contents = scan(frame_of(1) + frame_of(2, "v1") + frame_of(3, "signed"))
    assert [record.stamp_us for record in contents] == [0, 0, 0]
    assert contents.bad_ranges == []


def test_the_end_of_a_frame_is_not_taken_for_the_stamp_of_the_next():
    looks_like_a_stamp = frame_of(1, "signed")[:-8] + (T0_US + 400).to_bytes(8, "big")
    contents = scan(pack_record(T0_US, looks_like_a_stamp, False) + frame_of(2))
    assert [record.stamp_us for record in contents] == [T0_US, T0_US]


def test_a_stamp_that_no_clock_shows_is_the_previous_ones():
    data = as_bytes(SHORT_LOG[0]) + b"\x7f" + bytes(7) + frame_of(5) + as_bytes(SHORT_LOG[1])
    contents = scan(data)
    assert [record.stamp_us for record in contents] == [SHORT_LOG[i].stamp_us for i in (0, 0, 1)]
    assert contents.bad_bytes == 0


def test_a_known_message_with_a_wrong_crc_is_damage_also_between_intact_records():
    damaged = bytearray(as_bytes(SHORT_LOG[1]))
    damaged[25] ^= 0xFF
    contents = scan(as_bytes(SHORT_LOG[0]) + damaged + as_bytes(SHORT_LOG[2]))
    assert list(contents) == [SHORT_LOG[0], SHORT_LOG[2]]
    assert (contents.unknown_frames, contents.bad_bytes) == (0, len(damaged))


def test_the_low_bits_are_the_link():
    data = b"".join((T0_US + link).to_bytes(8, "big") + frame_of(link) for link in range(4))
    assert [(r.stamp_us, r.link, r.outbound) for r in scan(data)] == [(T0_US, i, i == 3) for i in range(4)]


def test_a_stamp_off_the_grid_is_a_fault_of_ours():
    with pytest.raises(InternalError, match="multiples of 4 us"):
        pack_record(T0_US + 2, frame_of(1), False)


def test_pymavlink_reads_what_we_write(tmp_path):
    path = tmp_path / "flight.tlog"
    path.write_bytes(log_of(SHORT_LOG))
    log = mavutil.mavlink_connection(str(path))
    messages = []
    while (message := log.recv_match()) is not None:
        messages.append(message)
    log.close()
    stamps_us = [round(message._timestamp * 1e6) for message in messages]
    assert stamps_us == [record.stamp_us + record.link for record in SHORT_LOG]
    assert [bytes(message.get_msgbuf()) for message in messages] == [record.frame for record in SHORT_LOG]
    assert [message.time_boot_ms for message in messages] == list(range(6))


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("empty", b"", "is empty"),
        ("one_byte", b"\xfd", "not a telemetry log"),
        ("text", b"a text of no interest\n" * 400, "not a telemetry log"),
        ("zip", b"PK\x03\x04" + bytes(range(256)) * 20, "not a telemetry log"),
        ("one_frame_by_chance", bytes(60_000) + frame_of(1), "not a telemetry log"),
    ],
)
def test_what_is_not_a_log_is_refused(tmp_path, name, data, reason):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(LogError, match=reason) as caught:
        read_records(path)
    assert str(path) in caught.value.message
    assert caught.value.hint


def test_missing_and_folder(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        read_records(tmp_path / "none.tlog")
    with pytest.raises(LogError, match="is a folder") as caught:
        read_records(tmp_path)
    assert caught.value.hint == "name a .tlog file"
    (tmp_path / "flight.tlog").touch()
    with pytest.raises(LogError) as caught:
        read_records(tmp_path)
    assert str(tmp_path / "flight.tlog") in caught.value.hint


def test_no_permission(tmp_path, monkeypatch):
    def refuse(path, mode):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError, match="no permission"):
        read_records(tmp_path / "flight.tlog")


def test_a_truncated_file_is_not_an_error(tmp_path):
    path = tmp_path / "cut.tlog"
    path.write_bytes(log_of(SHORT_LOG)[:-3])
    contents = read_records(path)
    assert len(contents) == 5
    assert contents.bad_bytes == len(as_bytes(SHORT_LOG[5])) - 3


@pytest.mark.parametrize("name", FRAMES_OF)
def test_counts_of_real_logs(name):
    path = LOGS / name
    if not path.exists():
        pytest.skip(f"{path} is not there; MAVQUAD_TLOGS names the folder with the reference logs")
    contents = read_records(path)
    assert (len(contents), contents.unknown_frames) == FRAMES_OF[name]
