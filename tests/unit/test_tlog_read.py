"""Columns of a log: pymavlink's values to the last bit, by message and sender; parts of it; any file."""

from __future__ import annotations

import gzip
import random
import struct
import tracemalloc

import numpy as np
import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad import tlog
from mavquad.errors import InputError, LogError
from mavquad.tlog import pack_record
from tests.tlog_mutations import known_frame, log, mutated

T0_US = 1_700_000_000_000_000
KINDS = list(dialect.mavlink_map.values())


def frame(kind, payload, version=2, sender=(1, 1)):
    """Any payload of any length as a frame with the right CRC."""
    number = kind.id
    if version == 1:
        head = bytes((len(payload), 0, *sender, number))
    else:
        head = bytes((len(payload), 0, 0, 0, *sender)) + number.to_bytes(3, "little")
    body = head + payload
    start = b"\xfe" if version == 1 else b"\xfd"
    return start + body + mcrf4xx(body + bytes((kind.crc_extra,))).to_bytes(2, "little")


def written(path, frames, step_us=4000):
    path.write_bytes(b"".join(pack_record(T0_US + step_us * i, frame, False) for i, frame in enumerate(frames)))
    return path


def heartbeat(system, component=1):
    return frame(dialect.MAVLink_heartbeat_message, bytes((4, 0, 0, 0, 2, 12, 128, 4, 3)), sender=(system, component))


def attitude(time_boot_ms, system=1):
    return frame(dialect.MAVLink_attitude_message, struct.pack("<I6f", time_boot_ms, *range(6)), sender=(system, 1))


def assert_same(ours, theirs):
    """Bit for bit; an array is a list of pymavlink's."""
    if isinstance(theirs, list):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)
    elif isinstance(theirs, float):
        assert struct.pack("<d", ours) == struct.pack("<d", theirs)
    else:
        assert ours == theirs
        assert isinstance(theirs, str) == isinstance(ours, str)


def assert_as_pymavlink(path, frames):
    found, parser, rows = tlog.read(path), dialect.MAVLink(None), {}
    for each in frames:
        message = parser.decode(bytearray(each))
        key = message.get_type(), (message.get_srcSystem(), message.get_srcComponent())
        rows[key] = rows.get(key, -1) + 1
        for name in message.get_fieldnames():
            assert_same(found.tables[key][name][rows[key]], getattr(message, name))
    assert {key: row + 1 for key, row in rows.items()} == {key: len(table) for key, table in found.tables.items()}


@pytest.mark.parametrize("version", [1, 2])
def test_every_message_at_full_length_cut_and_random(tmp_path, version):
    draw = random.Random(version)
    frames = []
    for kind in KINDS:
        if version == 2 or kind.id < 256:
            size = kind.unpacker.size
            payloads = [
                draw.randbytes(size),
                bytes(size),
                draw.randbytes(draw.randrange(1, size + 1)),
                draw.randbytes(255),
            ]
            frames += [frame(kind, payload, version) for payload in payloads]
    assert_as_pymavlink(written(tmp_path / "all.tlog", frames), frames)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(KINDS), st.binary(min_size=1, max_size=255), st.integers(1, 3)), max_size=8))
def test_any_payload(tmp_path_factory, drawn):
    frames = [heartbeat(9)] + [frame(kind, payload, 2, (system, 1)) for kind, payload, system in drawn]
    assert_as_pymavlink(written(tmp_path_factory.mktemp("log") / "any.tlog", frames), frames)


def test_texts_end_at_their_first_zero_and_show_what_is_no_ascii(tmp_path):
    texts = [b"", b"plain", b"a\0b", b"\xfd\xfe\xff", b"x" * 50]
    frames = [frame(dialect.MAVLink_statustext_message, b"\6" + text) for text in texts]
    table = tlog.read(written(tmp_path / "texts.tlog", frames))["STATUSTEXT"][1, 1]
    assert table["text"].tolist() == ["", "plain", "a", "\ufffd" * 3, "x" * 50]


def test_names_say_the_unit_once():
    names = {
        ("roll", "rad"): "roll_rad",
        ("time_boot_ms", "ms"): "time_boot_ms",
        ("time_usec", "us"): "time_us",
        ("lat", "degE7"): "lat_degE7",
        ("vx", "cm/s"): "vx_cm_s",
        ("xacc", "m/s/s"): "xacc_m_s2",
        ("throttle", "%"): "throttle_percent",
        ("fix_type", ""): "fix_type",
        ("horiz_accuracy", "cm^2"): "horiz_accuracy_cm2",
    }
    assert {key: tlog.column_name(*key) for key in names} == names


def test_no_two_columns_of_a_message_have_one_name_and_all_are_identifiers():
    for kind in KINDS:
        names = {field: tlog.column_name(field, kind.fieldunits_by_name.get(field, "")) for field in kind.fieldnames}
        assert len(set(names.values())) == len(names)
        assert all(name.isidentifier() for name in names.values())
        assert all(name == field or name not in names for field, name in names.items())


def test_a_table(tmp_path):
    frames = [attitude(10), heartbeat(1), attitude(20), attitude(30, system=2)]
    path = written(tmp_path / "a.tlog", frames)
    found = tlog.read(path)
    assert found.types == ("HEARTBEAT", "ATTITUDE")
    assert list(found["ATTITUDE"]) == [(1, 1), (2, 1)]
    assert found["GPS_RAW_INT"] == {}
    table = found["ATTITUDE"][1, 1]
    assert (len(table), table.name, table.sender) == (2, "ATTITUDE", (1, 1))
    assert table.fields == ("time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
    assert table.names[-1] == "yawspeed_rad_s"
    assert table["yawspeed_rad_s"] is table["yawspeed"]
    assert table.columns()["time_boot_ms"].tolist() == [10, 20]
    assert table.stamps_us.tolist() == [T0_US, T0_US + 8000]
    assert table.links.tolist() == [0, 0]
    assert table.offsets.tolist() == [8, 8 + len(frames[0]) + 8 + len(frames[1]) + 8]
    assert table["roll"].dtype == np.float32
    with pytest.raises(KeyError, match="ATTITUDE has no 'height', but time_boot_ms, roll_rad"):
        table["height"]


def test_parts_of_a_log(tmp_path):
    path = written(
        tmp_path / "a.tlog", [attitude(i, system=1 + i % 3) for i in range(9)] + [heartbeat(2, 7)], 1_000_000
    )
    assert len(tlog.read(path, "ATTITUDE").tables) == 3
    assert [*tlog.read(path, system=2).tables] == [("HEARTBEAT", (2, 7)), ("ATTITUDE", (2, 1))]
    assert [*tlog.read(path, component=7).tables] == [("HEARTBEAT", (2, 7))]
    part = tlog.read(path, ("ATTITUDE",), from_us=T0_US + 2_000_000, to_us=T0_US + 4_000_000)
    assert [table["time_boot_ms"].tolist() for table in part.tables.values()] == [[3], [4], [2]]
    assert (part.frames, part.first_us, part.last_us) == (10, T0_US, T0_US + 9_000_000)
    contents = tlog.read_records(path)
    chosen = tlog.Selection.of(("ATTITUDE",), system=3)
    assert [record.frame for record in contents.only(chosen)] == [attitude(i, system=3) for i in (2, 5, 8)]


def test_a_message_that_there_is_not(tmp_path):
    path = written(tmp_path / "a.tlog", [heartbeat(1)])
    with pytest.raises(InputError, match="no message is called 'ATITUDE'") as caught:
        tlog.read(path, ("ATITUDE",))
    assert caught.value.hint == "did you mean ATTITUDE?"


def test_records_and_messages_come_in_order(tmp_path):
    draw = random.Random(2)
    path = tmp_path / "a.tlog"
    path.write_bytes(mutated(draw, log(draw, 300)))
    contents = tlog.read_records(path)
    assert list(tlog.records(path)) == list(contents)
    kinds = [message.get_type() for _, message in tlog.messages(path, types=("ATTITUDE", "PING"))]
    assert set(kinds) == {"ATTITUDE", "PING"}
    assert len(kinds) == sum(map(len, tlog.read(path, ("ATTITUDE", "PING")).tables.values()))


def test_many_pieces_are_one_log(tmp_path, monkeypatch):
    draw = random.Random(4)
    path = tmp_path / "a.tlog"
    path.write_bytes(mutated(draw, log(draw, 200)))
    whole = tlog.read(path)
    monkeypatch.setattr("mavquad.tlog.source.PIECE", 333)
    pieces = tlog.read(path)
    assert (pieces.frames, pieces.bad_ranges, pieces.size) == (whole.frames, whole.bad_ranges, whole.size)
    for key, table in whole.tables.items():
        assert pieces.tables[key].offsets.tolist() == table.offsets.tolist()
        assert pieces.tables[key]._records.tobytes() == table._records.tobytes()


def test_gzip_is_unpacked_whatever_its_name(tmp_path):
    path = written(tmp_path / "a.tlog", [attitude(i) for i in range(500)])
    packed = tmp_path / "b.tlog"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    assert tlog.read(packed)["ATTITUDE"][1, 1]["time_boot_ms"].tolist() == list(range(500))
    assert len(tlog.read_records(packed)) == 500
    packed.write_bytes(packed.read_bytes()[:-300])
    assert 0 < tlog.read(packed).frames < 500


@pytest.mark.parametrize("size", [2, 5, 19])
def test_a_gzip_of_nothing(tmp_path, size):
    path = tmp_path / "a.tlog.gz"
    path.write_bytes(gzip.compress(b"")[:size])
    with pytest.raises(LogError, match="nothing in it can be unpacked"):
        tlog.read(path)


def test_without_stamps(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(b"stray" + b"".join(attitude(i) for i in range(50)))
    found = tlog.read(path)
    assert found["ATTITUDE"][1, 1].stamps_us.tolist() == [0] * 50
    assert (found.bad_ranges, found.first_us, found.last_us, found.repaired_stamps) == (((0, 5),), 0, 0, 50)


def test_stamps_that_begin_late(tmp_path, monkeypatch):
    path = tmp_path / "a.tlog"
    monkeypatch.setattr("mavquad.tlog.source.PIECE", 50)
    path.write_bytes(b"".join(attitude(i) for i in range(5)) + pack_record(T0_US, attitude(5), True))
    assert [(record.stamp_us, record.outbound) for record in tlog.records(path)] == [(T0_US, False)] * 5 + [
        (T0_US, True)
    ]
    path.write_bytes(b"".join(attitude(i) for i in range(20)) + pack_record(T0_US, attitude(5), True))
    assert [record.stamp_us for record in tlog.records(path)] == [0] * 20 + [T0_US]


def test_254_systems(tmp_path):
    path = written(tmp_path / "a.tlog", [attitude(i, system=1 + i % 254) for i in range(1000)])
    found = tlog.read(path)
    assert [sender[0] for sender in found["ATTITUDE"]] == list(range(1, 255))
    assert found["ATTITUDE"][254, 1]["time_boot_ms"].tolist() == [253, 507, 761]


def test_a_file_that_grows_while_it_is_read_ends_where_it_ended(tmp_path):
    records = [pack_record(T0_US + 4 * i, attitude(i), False) for i in range(30)]
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(records[:10]) + records[10][:20])
    reading = tlog.records(path)
    first = next(reading)
    with path.open("ab") as stream:
        stream.write(records[10][20:] + b"".join(records[11:]))
    assert len([first, *reading]) == 10
    assert tlog.read(path).frames == 30


def test_a_tail_that_is_cut_is_reported_and_read_when_it_is_there(tmp_path):
    path = written(tmp_path / "a.tlog", [attitude(i) for i in range(10)])
    data = path.read_bytes()
    path.write_bytes(data[:-5])
    found = tlog.read(path)
    assert (found.frames, found.bad_ranges) == (9, ((len(data) // 10 * 9, len(data) // 10 - 5),))


def test_zeros_are_no_log_and_take_no_memory(tmp_path):
    path = tmp_path / "zeros"
    with path.open("wb") as stream:
        stream.truncate(30_000_000)
    tracemalloc.start()
    with pytest.raises(LogError, match="not a telemetry log: no MAVLink frames in 30000000 bytes"):
        tlog.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 15_000_000


@pytest.mark.parametrize(
    ("head", "what"),
    [
        (b"PK\x03\x04", "a zip archive"),
        (b"ULog\x01\x12\x35", "a PX4 .ulg log"),
        (b"\xa3\x95\x80", "an ArduPilot .bin log"),
    ],
)
def test_other_kinds_of_files_are_named(tmp_path, head, what):
    path = tmp_path / "other"
    path.write_bytes(head + random.Random(1).randbytes(5000))
    with pytest.raises(LogError, match=f"not a telemetry log but {what}"):
        tlog.read(path)


def test_stamps_that_jump_are_kept(tmp_path):
    year_us = 365 * 86_400_000_000
    stamps_us = [T0_US, T0_US + year_us, T0_US - 8, T0_US + 4]
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(pack_record(stamp_us, known_frame(random.Random(1)), False) for stamp_us in stamps_us))
    found = tlog.read(path)
    assert next(iter(found.tables.values())).stamps_us.tolist() == stamps_us
    assert (found.first_us, found.last_us) == (T0_US - 8, T0_US + year_us)
