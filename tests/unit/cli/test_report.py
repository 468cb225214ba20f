"""`mavquad report` from the outside: what it writes and where, what it says, and what it refuses."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.unit.analysis.report.logs import LogFile, circling

RECORDINGS = Path(__file__).parents[2] / "conformance" / "recordings"


@pytest.fixture
def columns() -> str:
    """Messages are looked for in one piece."""
    return "200"


@pytest.fixture
def run(flown_run, tmp_path) -> Path:
    shutil.copytree(flown_run, tmp_path / "run")
    return tmp_path / "run"


@pytest.fixture
def quick(monkeypatch) -> None:
    """Without the figure, which takes longest."""
    monkeypatch.setattr("mavquad.cli.report._draw_log", lambda data, part: part.touch())


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_run_folder_gets_what_it_lacks(cli, run):
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    code, out, err = cli("report", "run")
    assert (code, err) == (0, "")
    assert "page: run/report.html" in out
    assert names(run) == set(before) | {"columns", "columns.npz"}
    assert {name: (run / name).read_bytes() for name in before} == before
    assert (run / "columns" / "trace.csv").read_text().splitlines()[0] == (run / "trace.csv").read_text().splitlines()[
        0
    ]
    with np.load(run / "columns.npz") as arrays:
        assert len(arrays["trace/measured_x_m"]) == len((run / "trace.csv").read_text().splitlines()) - 1
        assert "ATTITUDE_1_1/roll_rad" in arrays.files


def test_again_is_the_same(cli, run):
    assert cli("report", "run")[0] == 0
    first = {path.name: path.read_bytes() for path in run.iterdir() if path.is_file()}
    assert cli("report", "run/flight.tlog")[0] == 0
    assert {path.name: path.read_bytes() for path in run.iterdir() if path.is_file()} == first


def test_a_run_that_broke_off_gets_summary_and_figure_too(cli, run):
    for name in ("summary.json", "flight.png", "report.html"):
        (run / name).unlink()
    (run / "trace.csv").write_bytes((run / "trace.csv").read_bytes()[:-20])
    code, out, _ = cli("report", "run")
    assert code == 0
    assert "broke off" in out and "1 damaged line left out" in out
    assert json.loads((run / "summary.json").read_text())["completed"] is False
    assert {"flight.png", "report.html", "columns.npz"} <= names(run)


def test_elsewhere_leaves_the_run_alone(cli, run, tmp_path):
    before = names(run)
    code, out, _ = cli("report", "run", "--output", "there", "--json")
    assert code == 0
    found = json.loads(out)
    assert set(found["files"]) == names(tmp_path / "there")
    assert names(tmp_path / "there") == {"columns", "columns.npz", "flight.png", "report.html", "summary.json"}
    assert json.loads((tmp_path / "there" / "summary.json").read_text()) == json.loads(
        (run / "summary.json").read_text()
    )
    assert found["points"]["error"] > 300 and found["page"] == "there/report.html"
    assert names(run) == before


def test_a_log_of_others_gets_a_folder_of_its_name(cli, quick, tmp_path):
    circling().write(tmp_path / "some.tlog")
    assert cli("report", "some.tlog")[0] == 0
    assert names(tmp_path / "some-report") == {"columns", "columns.npz", "replay.png", "report.html", "summary.json"}
    assert cli("report", "some.tlog")[0] == 0
    assert (tmp_path / "some-report-2").is_dir()
    before = (tmp_path / "some-report" / "report.html").read_bytes()
    assert cli("report", "some.tlog", "-o", "some-report")[0] == 0
    assert (tmp_path / "some-report" / "report.html").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "rates", "thrust"), [("arducopter-4.7-c2.tlog.gz", 1359, 409), ("px4-v1.16.2-b.tlog.gz", 4860, 1581)]
)
def test_recordings_of_real_autopilots(cli, tmp_path, name, rates, thrust):
    code, out, _ = cli("report", str(RECORDINGS / name), "--json")
    assert code == 0
    found = json.loads(out)
    assert (found["points"]["rates"], found["points"]["thrust"]) == (rates, thrust)
    assert (tmp_path / found["page"]).stat().st_size < 5_000_000


def test_mcap_is_written_if_asked(cli, quick, tmp_path):
    pytest.importorskip("mcap", reason="the extra mcap is not installed")
    circling(2.0).write(tmp_path / "some.tlog")
    code, out, _ = cli("report", "some.tlog", "--export", "mcap")
    assert code == 0 and "report.mcap" in out
    assert (tmp_path / "some-report" / "report.mcap").read_bytes()[:5] == b"\x89MCAP"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.tlog"], "missing.tlog: no such file"),
        (["empty"], "empty: is not a run folder"),
        (["empty.tlog"], "the file is empty"),
        (["text.tlog"], "not a telemetry log"),
        (["good.tlog", "--export", "pdf"], "--export: 'pdf' is not a format that can be written"),
        (["good.tlog", "--output", "text.tlog"], "text.tlog: cannot be used (not a directory)"),
        (
            ["good.tlog", "--output", "text.tlog/below"],
            "text.tlog/below: the report cannot be written (not a directory)",
        ),
        (["good.tlog", "--output", "full"], "full: is not empty, and has no report in it"),
        (["good.raw", "--export", "mcap"], "the log has no stamps"),
    ],
)
def test_bad_input_leaves_nothing(cli, tmp_path, arguments, words):
    (tmp_path / "empty").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    (tmp_path / "empty.tlog").touch()
    (tmp_path / "text.tlog").write_text("a text that is no log\n" * 100)
    circling(1.0).write(tmp_path / "good.tlog")
    raw = LogFile(with_stamps=False)
    for second in range(3):
        raw.at(second).attitude(0, 0, 0)
    raw.write(tmp_path / "good.raw")
    before = {str(path): path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    code, out, err = cli("report", *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert {str(path): path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


@pytest.mark.parametrize("target", ["run", "new"])
def test_a_full_disk_changes_nothing(run, tmp_path, target):
    """A limit of 200 kB on the size of a file stands for the disk."""
    if target == "run":
        (run / "report.html").write_text("the page of before")
    before = {str(path): path.stat().st_size for path in tmp_path.rglob("*")}
    command = f'ulimit -f 200; exec "$0" -m mavquad report run --output {target}'
    done = subprocess.run(
        ["bash", "-c", command, sys.executable], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert f"{target}: the report cannot be written (file too large)" in done.stderr
    assert "Traceback" not in done.stderr
    assert {str(path): path.stat().st_size for path in tmp_path.rglob("*")} == before


def test_a_log_with_hostile_texts(cli, quick, tmp_path):
    log = circling(2.0)
    log.text("</script><script>evil()</script>")
    log.write(tmp_path / "some.tlog")
    assert cli("report", "some.tlog")[0] == 0
    assert "<script>evil" not in (tmp_path / "some-report" / "report.html").read_text()
