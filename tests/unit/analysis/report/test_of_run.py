"""The report of a flight of ours, whole or broken off in the middle of whatever was being written."""

import csv
import json
import shutil

import numpy as np
import pytest

from mavquad.analysis.report.law import limit_lanes
from mavquad.analysis.report.of_run import MESSAGES, report_of_run
from mavquad.analysis.report.page import page
from mavquad.analysis.report.run_data import read_run
from mavquad.errors import RunFolderError

FILES = {
    "config.toml",
    "events.jsonl",
    "flight.png",
    "flight.tlog",
    "notes.jsonl",
    "report.html",
    "summary.json",
    "trace.csv",
}


@pytest.fixture
def run(flown_run, tmp_path):
    """A copy of it to spoil."""
    shutil.copytree(flown_run, tmp_path / "run")
    return tmp_path / "run"


def report_of(folder):
    return report_of_run(read_run(folder, MESSAGES))


def lines(report):
    return {(panel.key, line.name): line for panel in report.panels for line in panel.lines}


def test_every_flight_leaves_the_page(flown_run):
    assert {path.name for path in flown_run.iterdir()} >= FILES
    text = (flown_run / "report.html").read_text()
    assert text.startswith("<!doctype html>") and text.endswith("</html>\n")


def test_it_is_the_page_that_is_made_afterwards(flown_run):
    assert page(report_of(flown_run)) == (flown_run / "report.html").read_text()


def test_lines_are_the_traces(flown_run):
    with (flown_run / "trace.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    found = lines(report_of(flown_run))
    start_us = json.loads((flown_run / "notes.jsonl").read_text().splitlines()[0])["stamp_us"]
    error = found["error", "north"]
    assert len(error.values) == len(rows)
    for index in (0, 100, -1):
        row = {name: float(row) for name, row in rows[index].items() if name not in ("phase", "limits")}
        assert error.times_s[index] == pytest.approx((row["stamp_us"] - start_us) * 1e-6, abs=1e-9)
        assert error.values[index] == pytest.approx((row["measured_x_m"] - row["reference_x_m"]) * 100, abs=1e-9)
        assert found["velocity", "west"].values[index] == row["zeta_hat_y_m_s"]
        assert found["altitude", "reference"].values[index] == row["reference_z_m"]
        assert found["sigma", "up"].values[index] == row["sigma_z_m_s4"]
        assert found["thrust", "commanded"].values[index] == row["control_thrust_norm"]
        assert found["commands", "pitch"].values[index] == row["control_pitch_norm"]


def test_the_path_is_what_was_flown(flown_run):
    flown_track, reference = report_of(flown_run).tracks
    assert (flown_track.name, reference.name, reference.dashed) == ("flown", "reference", True)
    np.testing.assert_allclose(reference.points_m[-1] - reference.points_m[0], [0.6, 0.3, 0.4], atol=0.03)


def test_phases_and_modes_are_lanes(flown_run):
    lanes = {lane.name: lane for lane in report_of(flown_run).lanes}
    phases = [span.name for span in lanes["phase"].spans]
    assert phases[0] == "connecting" and "flying" in phases and phases[-1] == "done"
    assert "OFFBOARD" in [span.name for span in lanes["mode"].spans]
    assert [span.name for span in lanes["armed"].spans] == ["armed"]
    for lane in lanes.values():
        assert all(a.to_s <= b.from_s for a, b in zip(lane.spans, lane.spans[1:], strict=False))


def test_every_limit_that_was_active_has_a_lane(make_trace):
    rows = make_trace(20.0)
    times_s = np.array([row.stamp_us - rows[0].stamp_us for row in rows]) * 1e-6
    snap, tilt = limit_lanes(rows, times_s)
    assert (snap.name, tilt.name) == ("snap", "tilt")
    assert snap.alarming and tilt.alarming
    [(begun_s, ended_s)] = [(span.from_s, span.to_s) for span in tilt.spans]
    assert (begun_s, ended_s) == pytest.approx((12.01, 12.6), abs=0.011)
    assert [span.from_s for span in snap.spans] == pytest.approx([0.0, 12.01], abs=0.011)


def test_a_limit_that_is_active_to_the_end(make_trace):
    rows = make_trace(12.3)
    times_s = np.array([row.stamp_us - rows[0].stamp_us for row in rows]) * 1e-6
    assert limit_lanes(rows, times_s)[1].spans[-1].to_s == times_s[-1]


def test_texts_are_told_once_with_their_severity(flown_run):
    marks = report_of(flown_run).marks
    said = [mark for mark in marks if mark.kind == "vehicle"]
    assert len(said) == sum('"vehicle"' in line for line in (flown_run / "notes.jsonl").read_text().splitlines())
    assert all(mark.severity is not None for mark in said)


def test_a_crash_of_ours_leaves_a_report_all_the_same(run):
    for name in ("summary.json", "flight.png", "report.html"):
        (run / name).unlink()
    trace, notes, log = (run / name for name in ("trace.csv", "notes.jsonl", "flight.tlog"))
    rows = len(trace.read_text().splitlines()) - 1
    trace.write_bytes(trace.read_bytes()[:-37])
    kept = [line for line in notes.read_text().splitlines() if '"done"' not in line and '"landing"' not in line]
    notes.write_text("\n".join(kept)[:-10])
    log.write_bytes(log.read_bytes()[:-5])
    report = report_of(run)
    assert len(lines(report)["error", "north"].values) == rows - 1
    assert report.summary["completed"] is False
    assert "broke off while" in report.summary["outcome"] and "broke off" in report.title
    assert report.summary["position_rms_m"] > 0
    words = " ".join(report.remarks)
    assert "trace.csv: 1 damaged line" in words and "notes.jsonl: 1 damaged line" in words and "flight.tlog" in words
    assert page(report)


@pytest.mark.parametrize("name", sorted(FILES - {"flight.png", "report.html", "events.jsonl"}))
@pytest.mark.parametrize("spoilt", ["missing", "empty", "noise", "folder"])
def test_each_file_may_be_spoilt(run, name, spoilt):
    (run / name).unlink()
    if spoilt == "empty":
        (run / name).touch()
    elif spoilt == "noise":
        (run / name).write_bytes(bytes(range(256)) * 20)
    elif spoilt == "folder":
        (run / name).mkdir()
    report = report_of(run)
    assert page(report)
    if name in ("flight.tlog", "trace.csv"):
        assert any(name in remark for remark in report.remarks) or spoilt == "empty"
    if name != "trace.csv":
        assert ("error", "north") in lines(report)


def test_a_summary_with_nonsense_in_it(run):
    (run / "summary.json").write_text(
        '{"position_rms_m": "much", "vehicle": ["x"], "outcome": null, "settle_s": 1e999}'
    )
    facts = dict(report_of(run).facts)
    assert facts["position error, RMS"] == "–" and facts["within 5 cm and 3° after"] == "–"


def test_the_trace_alone(run):
    for path in run.iterdir():
        if path.name != "trace.csv":
            path.unlink()
    report = report_of(run)
    assert report.tracks and report.duration_s > 1


def test_the_log_alone(run):
    for path in run.iterdir():
        if path.name != "flight.tlog":
            path.unlink()
    report = report_of(run)
    assert ("altitude", "flown") in lines(report) and report.tracks


@pytest.mark.parametrize("names", [[], ["notes.txt"]])
def test_no_run_folder(tmp_path, names):
    for name in names:
        (tmp_path / name).touch()
    with pytest.raises(RunFolderError, match="is not a run folder"):
        read_run(tmp_path, MESSAGES)


def test_a_run_folder_with_nothing_in_its_files(tmp_path):
    for name in FILES:
        (tmp_path / name).touch()
    with pytest.raises(RunFolderError, match="nothing of a flight is in it"):
        read_run(tmp_path, MESSAGES)
