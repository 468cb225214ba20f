"""What is in a log, and parts of it: --list, --system, --from, --to."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.cli.log_part import LogPart
from mavquad.errors import InputError
from mavquad.tlog import Selection, pack_record

T0_US = 1_777_630_830_000_000  # 2026-05-01T10:20:30Z


@pytest.fixture
def log(tmp_path):
    """Two copters for 20 s at 1 Hz; 1 is armed from 4 to 8 and 12 to 14 s, 2 from 6 to 9 s; some damage."""
    records = []
    for second in range(21):
        for system, spans in ((1, ((4, 8), (12, 14))), (2, ((6, 9),))):
            armed = any(begin <= second < end for begin, end in spans)
            mode = 4 if 5 <= second < 10 or second == 15 else 0
            records.append(record(second, dialect.MAVLink_heartbeat_message(2, 3, armed * 128, mode, 4, 3), system))
        records.append(record(second, dialect.MAVLink_attitude_message(second * 1000, 0, 0, 0, 0, 0, 0), 1))
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(records[:9]) + b"bad" + b"".join(records[9:]))
    return path


def record(second, message, system):
    frame = bytes(message.pack(dialect.MAVLink(None, srcSystem=system, srcComponent=1)))
    return pack_record(T0_US + second * 1_000_000, frame, False)


def test_json(cli, log):
    code, out, err = cli("replay", str(log), "--list", "--json")
    found = json.loads(out)
    assert (code, err) == (0, "")
    assert (found["frames"], found["bad_bytes"], len(found["bad_ranges"])) == (63, 3, 1)
    assert found["messages"] == {"HEARTBEAT": 42, "ATTITUDE": 21}
    assert [(span["flight"], span["system"], span["from_s"], span["to_s"]) for span in found["armed_spans"]] == [
        (1, 1, 4.0, 8.0),
        (2, 2, 6.0, 9.0),
        (3, 1, 12.0, 14.0),
    ]
    assert [sender["system"] for sender in found["senders"]] == [1, 2]
    assert found["senders"][0]["messages"]["ATTITUDE"] == {"count": 21, "rate_hz": 1.0}
    assert [mode["mode"] for mode in found["senders"][0]["modes"]] == ["STABILIZE", "GUIDED"] * 2 + ["STABILIZE"]


def test_words(cli, log):
    code, out, _ = cli("replay", str(log), "--list")
    assert code == 0
    for words in (
        "63 frames, 20.0 s from 2026-05-01 10:20:30.000+00:00, 3 bad bytes in 1 places",
        "1/1 (QUADROTOR, ARDUPILOTMEGA) 42 frames",
        "flight:3",
        "GUIDED",
        "bad bytes at",
    ):
        assert words in out


def test_a_log_of_many_flights_shows_the_first_ones(cli, tmp_path):
    beats = [record(i, dialect.MAVLink_heartbeat_message(2, 3, i % 2 * 128, 0, 4, 3), 1) for i in range(60)]
    (tmp_path / "a.tlog").write_bytes(b"".join(beats))
    _, out, _ = cli("replay", "a.tlog", "--list")
    assert "flight:20" in out
    assert "flight:21" not in out
    assert "and 10 more" in out


def test_a_log_without_stamps_is_listed(cli, tmp_path):
    frame = record(0, dialect.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 0), 1)[8:]
    (tmp_path / "a.raw").write_bytes(frame * 5)
    code, out, _ = cli("replay", "a.raw", "--list")
    assert code == 0
    assert "5 frames, without stamps, 0 bad bytes" in out


@pytest.mark.parametrize(
    ("part", "from_s", "to_s"),
    [
        (LogPart(), None, None),
        (LogPart(from_="2.5"), 2.5, None),
        (LogPart(to="-1"), None, -1),
        (LogPart(from_="2026-05-01T10:20:33Z", to="2026-05-01T12:20:34+02:00"), 3, 4),
        (LogPart(from_="2026-05-01 10:20:33.5"), 3.5, None),
        (LogPart(from_="flight:1", to="flight:1"), 4, 8),
        (LogPart(from_="flight:2", to="flight:3"), 6, 14),
        (LogPart(2, "flight:1", "flight:1"), 6, 9),
        (LogPart(from_="mode:guided", to="mode:GUIDED"), 5, 10),
        (LogPart(from_="mode:GUIDED:2"), 15, None),
    ],
)
def test_parts(log, part, from_s, to_s):
    from_us, to_us = (None if s is None else T0_US + round(s * 1e6) for s in (from_s, to_s))
    assert part.selection(log) == Selection(system=part.system, from_us=from_us, to_us=to_us)


def test_a_wall_time_is_utc_wherever_one_is(log, monkeypatch):
    monkeypatch.setenv("TZ", "XXX-9")
    time.tzset()
    try:
        assert LogPart(from_="2026-05-01T10:20:33").selection(log).from_us == T0_US + 3_000_000
    finally:
        monkeypatch.undo()
        time.tzset()


@pytest.mark.parametrize(
    ("part", "reason", "hint"),
    [
        (LogPart(from_="noon"), "--from: 'noon' is no time", "12.5 (s)"),
        (LogPart(to="nan"), "--to: 'nan' is no time", "12.5 (s)"),
        (LogPart(to="1e300"), "--to: '1e300' is no time", "12.5 (s)"),
        (LogPart(from_="flight:4"), "--from: there is no flight:4", "flight:1 to flight:3"),
        (LogPart(from_="flight:x"), "--from: there is no flight:x", "flight:1 to flight:3"),
        (LogPart(9, "flight:1"), "--from: there is no flight:1", "nobody was armed"),
        (LogPart(to="mode:LOITER"), "--to: there is no mode:LOITER", "STABILIZE, GUIDED"),
        (LogPart(to="mode:GUIDED:3"), "--to: there is no mode:GUIDED:3", "STABILIZE, GUIDED"),
        (LogPart(to="mode:GUIDED:0"), "--to: there is no mode:GUIDED:0", "STABILIZE, GUIDED"),
        (LogPart(from_="9", to="3"), "--from 9 is behind --to 3", ""),
        (LogPart(system=256), "--system: 256 is not between 0 and 255", ""),
    ],
)
def test_parts_that_there_are_not(log, part, reason, hint):
    with pytest.raises(InputError) as caught:
        part.selection(log)
    assert caught.value.message == reason
    assert hint in caught.value.hint


def test_a_part_is_listed_by_the_time_of_the_whole(cli, log):
    code, out, _ = cli(
        "replay", str(log), "--list", "--system", "1", "--from", "flight:2", "--to", "flight:2", "--json"
    )
    found = json.loads(out)
    assert (code, found["frames"], found["duration_s"]) == (0, 6, 20.0)
    assert found["messages"] == {"HEARTBEAT": 3, "ATTITUDE": 3}
    assert found["armed_spans"] == [{"flight": 1, "system": 1, "component": 1, "from_s": 12.0, "to_s": 14.0}]


def test_a_flight_of_ours_is_replayed_whole(cli, log, tmp_path):
    (tmp_path / "config.toml").touch()
    (tmp_path / "events.jsonl").touch()
    code, _, err = cli("replay", str(log), "--from", "3")
    assert code == 2
    assert "a flight of ours is replayed whole" in err
    assert cli("replay", str(log), "--from", "3", "--list")[0] == 0


def test_a_list_needs_neither_the_configuration_nor_figures(log):
    """What takes long to import is not imported: the list is wanted at once."""
    code = f"""
import sys
sys.argv = ["mavquad", "replay", {str(log)!r}, "--list"]
from mavquad.cli import main
try:
    main()
finally:
    print(sorted({{"scipy", "matplotlib", "mavquad.config", "mavquad.agent", "sitl_mock"}} & set(sys.modules)))
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.splitlines()[-1] == "[]"
