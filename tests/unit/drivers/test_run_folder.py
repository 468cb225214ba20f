"""The run folder: refused where it would mix flights, kept while flying, whole at the end."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from mavquad.drivers.replay import OperatorEvent
from mavquad.drivers.run_folder import RunFolder, read_events, read_notes, to_json
from mavquad.errors import RunFolderError
from mavquad.flight_record import Note
from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import read_records

FRAME = Encoder(1, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))


def test_it_is_made_with_its_parents_and_keeps_the_configuration(tmp_path):
    folder = RunFolder(tmp_path / "a" / "b", "seed = 3\n")
    folder.close()
    assert (tmp_path / "a" / "b" / "config.toml").read_text() == "seed = 3\n"


def test_an_empty_folder_is_taken(tmp_path):
    RunFolder(tmp_path, "").close()
    assert (tmp_path / "flight.tlog").exists()


def test_a_folder_with_anything_in_it_is_refused_and_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(RunFolderError, match="not empty") as caught:
        RunFolder(tmp_path, "")
    assert caught.value.exit_code == 2
    assert "--run-dir" in caught.value.hint
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_folder_of_another_flight_is_refused(tmp_path):
    RunFolder(tmp_path / "run", "").close()
    with pytest.raises(RunFolderError, match="not empty"):
        RunFolder(tmp_path / "run", "")


@pytest.mark.parametrize("below", ["", "below"])
def test_a_file_in_the_way(tmp_path, below):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(RunFolderError, match="cannot be written"):
        RunFolder(tmp_path / "file" / below, "")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_that_may_not_be_written(tmp_path, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(RunFolderError, match=r"cannot be written \(permission denied\)"):
        RunFolder(tmp_path / "run", "")


def test_both_directions_are_in_the_log_at_their_stamps(tmp_path):
    folder = RunFolder(tmp_path, "")
    folder.frame(1_600_000_000_000_000, FRAME, outbound=False)
    folder.frame(1_600_000_000_000_004, FRAME, outbound=True)
    folder.close()
    records = list(read_records(tmp_path / "flight.tlog"))
    assert [(r.stamp_us % 1000, r.outbound, r.frame) for r in records] == [(0, False, FRAME), (4, True, FRAME)]


def test_events_are_on_the_disk_at_once(tmp_path):
    folder = RunFolder(tmp_path, "")
    folder.event(8, "start")
    folder.event(12, "stop")
    folder.event(16, "goto", (0.1, -2.0, 1e-17, 3))
    assert read_events(tmp_path) == [
        OperatorEvent(8, "start"),
        OperatorEvent(12, "stop"),
        OperatorEvent(16, "goto", (0.1, -2.0, 1e-17, 3)),
    ]
    lines = (tmp_path / "events.jsonl").read_text().splitlines()
    assert lines[1:] == [
        '{"stamp_us": 12, "name": "stop"}',
        '{"stamp_us": 16, "name": "goto", "args": [0.1, -2.0, 1e-17, 3]}',
    ]
    folder.close()


def test_what_streams_in_is_on_the_disk_about_once_a_second(tmp_path):
    folder = RunFolder(tmp_path, "")
    folder.frame(1_000_000, FRAME, outbound=False)
    folder.add([], [Note(8, "phase", "flying")])
    assert read_notes(tmp_path) == []
    assert (tmp_path / "flight.tlog").stat().st_size == 0
    folder.frame(1_000_004, FRAME, outbound=True)
    folder.add([], [])
    assert read_notes(tmp_path) == [Note(8, "phase", "flying")]
    assert len(read_records(tmp_path / "flight.tlog")) == 2
    folder.close()


def test_a_file_appears_whole(tmp_path):
    folder = RunFolder(tmp_path, "")
    folder.write_whole("summary.json", "one")
    folder.write_whole("summary.json", "two")
    folder.close()
    assert (tmp_path / "summary.json").read_text() == "two"
    assert not list(tmp_path.glob(".*"))


def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path, monkeypatch):
    folder = RunFolder(tmp_path, "")
    folder.write_whole("summary.json", "old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RunFolderError, match="no space left on device"):
        folder.write_whole("summary.json", "new text")
    folder.close()
    assert (tmp_path / "summary.json").read_text() == "old"
    assert not list(tmp_path.glob(".*"))


def test_a_full_disk_ends_the_recording_and_not_the_flight(tmp_path, monkeypatch):
    folder = RunFolder(tmp_path, "")
    folder.event(4, "start")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(folder._tlog, "write", full)
    folder.frame(8, b"frame", outbound=True)
    folder.add([], [])
    assert "no space left on device" in str(folder.failure)
    folder.event(12, "end")
    folder.close()
    assert [event.name for event in read_events(tmp_path)] == ["start"]


def test_no_events(tmp_path):
    with pytest.raises(RunFolderError, match="cannot be read"):
        read_events(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        '{"stamp_us": 4}',
        '{"stamp_us": 4, "name": "stop", "more": 1}',
        '{"stamp_us": "4", "name": "stop"}',
        '{"stamp_us": 4, "name": 5}',
        '{"stamp_us": 4, "name": "last_resort"}',
        '{"stamp_us": 4, "name": ["stop"]}',
        '{"stamp_us": 4, "name": "stop", "args": [1.0]}',
        '{"stamp_us": 4, "name": "goto", "args": [1.0, 2.0]}',
        '{"stamp_us": 4, "name": "goto", "args": [1.0, 2.0, NaN]}',
        '{"stamp_us": 4, "name": "goto", "args": [1.0, 2.0, "3"]}',
        '{"stamp_us": 4, "name": "goto", "args": 7}',
        "7",
    ],
)
def test_damaged_events(tmp_path, text):
    (tmp_path / "events.jsonl").write_text('{"stamp_us": 0, "name": "start"}\n' + text + "\n")
    with pytest.raises(RunFolderError, match="is damaged"):
        read_events(tmp_path)


def test_json_has_no_nan():
    assert json.loads(to_json({"a": 1.5})) == {"a": 1.5}
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_json({"a": float("nan")})


def test_what_is_discarded_is_ours_alone(tmp_path):
    RunFolder(tmp_path / "new", "").discard()
    assert not (tmp_path / "new").exists()
    folder = RunFolder(tmp_path, "")
    (tmp_path / "mine.txt").write_text("mine")
    folder.discard()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
