"""The command line from the outside: messages, exit codes, what is on stdout, what is left on the disk."""

import json
import re
from pathlib import Path

import pytest

from mavquad.errors import RunFolderError
from mavquad.tlog import pack_record, read_records

SHORT = ["--mission", "hover", "--duration", "1"]
LEANING = ["--wind", "5,0,0", "--set", "guards.tilt_deg=20", "--set", "law.limits.tilt_max_deg=15"]
"""The wind leans the hovering vehicle by 27 degrees."""


@pytest.fixture
def columns() -> str:
    """Messages are looked for in one piece."""
    return "200"


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory) -> Path:
    """A short lockstep flight with loss."""
    from mavquad.cli.sim import sim
    from mavquad.config import Override

    folder = tmp_path_factory.mktemp("flight") / "run"
    overrides = [
        Override("mission.name", "hover"),
        Override("mission.duration_s", "2"),
        Override("mock.link.loss", "0.05"),
    ]
    assert sim(None, overrides, folder, as_json=True) == 0
    return folder


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fly", "missing.toml"], "missing.toml: no such file"),
        (["fly", "."], "cannot be read"),
        (["sim", "--set", "law.omega0=2"], "--set: law.omega0: unknown key; did you mean omega0_rad_s?"),
        (["sim", "--set", "law.omega0_rad_s=-2"], "--set: law.omega0_rad_s: Input should be greater than 0.05"),
        (["sim", "--set", "law.kappa_rad_s=0.5"], "kappa_rad_s must be greater than omega0_rad_s"),
        (["sim", "--set", "mock.link.loss=nan"], "--set: mock.link.loss: Input should be a finite number"),
        (["sim", "--set", "law"], "write it as key.path=value"),
        (["sim", "--set", "seed.x=1"], "'seed' is a value, not a table"),
        (["sim", "--wind", "1,2"], "--wind: '1,2' is not three numbers N,E,D"),
        (["sim", "--loss", "2"], "--loss: Input should be less than or equal to 1"),
        (["sim", "--depth", "thrust"], "--depth: Input should be 'auto', 'torque', 'rate' or 'attitude'"),
        (["sim", "--mission", "loop"], "--mission: Input should be 'box', 'hover', 'goto'"),
        (["sim", "--duration", "-1"], "--duration: Input should be greater than or equal to 0"),
        (["sim", "--nonsense"], "No such option: --nonsense"),
        (["fly", "--connect", "tcpp:localhost:5760"], "--connect: not a connection string that can be used here"),
        (["replay", "missing.tlog"], "missing.tlog: no such file"),
        (["replay", "."], "is a folder, not a file"),
        (["replay", "missing.tlog", "--output", "x.foo"], "does not end with .png"),
        (["replay", "missing.tlog", "--play", "udpout:127.0.0.1:9"], "missing.tlog: no such file"),
        (["replay", "x.tlog", "--play", "tcp:127.0.0.1:9"], "a log is played to a UDP endpoint"),
        (["replay", "x.tlog", "--play", "udpin:127.0.0.1:9"], "a log is played to a UDP endpoint"),
        (["replay", "x.tlog", "--play", "udpout:127.0.0.1:9", "--speed", "0"], "--speed: 0 is not between"),
        (["replay", "x.tlog", "--play", "udpout:127.0.0.1:9", "--speed", "nan"], "--speed: nan is not between"),
        (["replay", "x.tlog", "--play", "udpout:127.0.0.1:9", "--direction", "up"], "'up' is none of in, out, both"),
        (["nonsense"], "No such command 'nonsense'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_bad_input_is_two_lines_and_exit_code_2(cli, tmp_path, arguments, words):
    code, out, err = cli(*arguments)
    assert code == 2
    assert words in err
    assert out == ""
    assert not list(tmp_path.iterdir())


def test_no_command_shows_the_help(cli):
    code, out, _ = cli()
    assert code == 2
    assert "replay" in out


def test_the_help_has_the_exit_codes(cli):
    code, out, _ = cli("--help")
    assert code == 0
    assert re.search(r"130\s+interrupted, and landed", out)


@pytest.mark.parametrize("content", [b"", b"x", b"no log at all\n" * 1000, b"\x00" * 5000, b"PK\x03\x04" + b"z" * 500])
def test_what_is_no_log_is_refused(cli, tmp_path, content):
    (tmp_path / "log.tlog").write_bytes(content)
    code, out, err = cli("replay", "log.tlog")
    assert code == 2
    assert "log.tlog" in err
    assert out == ""


def test_a_log_without_times_has_no_pace(cli, run_dir, tmp_path):
    records = list(read_records(run_dir / "flight.tlog"))
    (tmp_path / "log.raw").write_bytes(b"".join(record.frame for record in records))
    code, out, err = cli("replay", "log.raw", "--play", "udpout:127.0.0.1:9")
    assert (code, out) == (2, "")
    assert "its frames have no times" in err


def test_sim_prints_json_alone(cli, tmp_path):
    code, out, err = cli("sim", *SHORT, "--json", "--run-dir", "run", "--seed", "7")
    assert code == 0
    assert err == ""
    summary = json.loads(out)
    assert summary == json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["seed"] == 7
    wanted = {
        "completed", "outcome", "position_rms_m", "position_max_m", "yaw_rms_rad", "settle_s", "setpoints_sent",
        "flight_s", "wall_s", "real_time_factor", "lateness_us", "link",
    }  # fmt: skip
    assert wanted <= summary.keys()
    assert {"lost", "bad"} <= summary["link"].keys()
    assert summary["lateness_us"].keys() == {"p50", "p99", "max"}


def test_a_run_folder_that_is_in_use_is_left_alone(cli, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine.txt").write_text("mine")
    code, _, err = cli("sim", *SHORT, "--run-dir", "run")
    assert code == 2
    assert "the run folder is not empty" in err
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["mine.txt"]


def test_a_run_folder_that_cannot_be_made(cli, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = cli("sim", *SHORT, "--run-dir", "file/run")
    assert code == 2
    assert "cannot be written" in err


def test_a_replay_is_equal(cli, run_dir):
    code, out, _ = cli("replay", str(run_dir / "flight.tlog"), "--json")
    assert code == 0
    result = json.loads(out)
    assert result["frames"] > 1000
    assert result["bad_bytes"] == 0
    assert result["outbound"]["matched"] == result["outbound"]["recorded"] > 200
    assert result["outbound"]["first_mismatch"] is None


def test_another_gain_is_seen_in_the_replay(cli, run_dir, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("flight.tlog", "events.jsonl"):
        (copy / name).write_bytes((run_dir / name).read_bytes())
    text = (run_dir / "config.toml").read_text()
    (copy / "config.toml").write_text(re.sub(r"(?m)^omega0_rad_s = .*$", "omega0_rad_s = 2.5", text))
    code, out, err = cli("replay", str(copy / "flight.tlog"))
    assert code == 5
    assert "the replay differs" in err
    assert "first difference, outbound frame" in out
    assert "SET_ACTUATOR_CONTROL_TARGET" in out


def test_another_law_beside_a_flight_is_no_difference_of_its_replay(cli, run_dir, tmp_path):
    code, out, _ = cli("replay", str(run_dir / "flight.tlog"), "--set", "law.omega0_rad_s=2.5", "--json")
    assert code == 0
    result = json.loads(out)
    assert result["outbound"]["first_mismatch"] is None
    assert result["beside"]["difference_rms"]["roll"] > 0.01
    assert (tmp_path / result["figure"]).name == "run-beside.png"
    (tmp_path / "other.toml").write_text('[law]\ndepth = "attitude"\n')
    code, out, _ = cli("replay", str(run_dir / "flight.tlog"), "--config", "other.toml", "--output", "o.png")
    assert code == 0
    assert "other law: depth attitude" in out
    assert (tmp_path / "o.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--config", "none.toml"], "none.toml: no such file"),
        (["--set", "law.omega0=2"], "--set: law.omega0: unknown key"),
    ],
)
def test_another_law_that_is_none(cli, run_dir, options, words):
    code, out, err = cli("replay", str(run_dir / "flight.tlog"), *options)
    assert (code, out) == (2, "")
    assert words in err


def test_another_law_beside_a_flight_without_one(cli, tmp_path):
    code, *_ = cli("sim", "--set", 'mock.firmware="1.16"', "--depth", "torque", "--json", "--run-dir", "refused")
    assert code == 3
    code, out, err = cli("replay", "refused/flight.tlog", "--depth", "rate")
    assert (code, out) == (2, "")
    assert "the law was never asked in this flight" in err


def test_a_flight_that_a_guard_ended_replays(cli):
    assert cli("sim", *LEANING, "--json", "--run-dir", "guarded")[0] == 4
    assert cli("replay", "guarded/flight.tlog", "--json")[0] == 0


def test_a_changed_stamp_is_seen_in_the_replay(cli, run_dir, tmp_path):
    records = list(read_records(run_dir / "flight.tlog"))
    outbound = [index for index, record in enumerate(records) if record.outbound]
    changed = records[outbound[-1]]
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("config.toml", "events.jsonl"):
        (copy / name).write_bytes((run_dir / name).read_bytes())
    log = b"".join(
        pack_record(record.stamp_us + (4 if record is changed else 0), record.frame, record.outbound)
        for record in records
    )
    (copy / "flight.tlog").write_bytes(log)
    code, out, _ = cli("replay", str(copy / "flight.tlog"), "--json")
    assert code == 5
    mismatch = json.loads(out)["outbound"]["first_mismatch"]
    assert mismatch["index"] == len(outbound) - 1
    assert mismatch["recorded"]["stamp_us"] == mismatch["replayed"]["stamp_us"] + 4


def test_a_truncated_flight_says_what_is_missing(cli, run_dir, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("config.toml", "events.jsonl"):
        (copy / name).write_bytes((run_dir / name).read_bytes())
    (copy / "flight.tlog").write_bytes((run_dir / "flight.tlog").read_bytes()[:-3001])
    code, out, _ = cli("replay", str(copy / "flight.tlog"), "--json")
    assert code == 5
    assert json.loads(out)["bad_bytes"] > 0


def test_a_log_of_others_is_surveyed(cli, run_dir, tmp_path):
    (tmp_path / "other.tlog").write_bytes((run_dir / "flight.tlog").read_bytes())
    code, out, _ = cli("replay", "other.tlog", "--json", "--output", "survey.png")
    assert code == 0
    result = json.loads(out)
    assert {(s["system"], s["component"]) for s in result["senders"]} == {(1, 1), (245, 190)}
    assert result["observer"]["source"] == "LOCAL_POSITION_NED"
    assert (tmp_path / "survey.png").stat().st_size > 10_000


def test_our_law_in_the_shadow_of_a_log_of_others(cli, run_dir, tmp_path):
    (tmp_path / "other.tlog").write_bytes((run_dir / "flight.tlog").read_bytes())
    code, out, _ = cli("replay", "other.tlog", "--json", "--output", "survey.png")
    assert code == 0
    result = json.loads(out)
    modes = [phase["mode"] for phase in result["law"]["phases"]]
    assert modes[:3] == ["AUTO.TAKEOFF", "AUTO.LOITER", "OFFBOARD"]
    offboard = result["law"]["phases"][2]
    assert offboard["verdicts"]["torque"]["would_do"] is True
    assert max(offboard["velocity_rms_nwu_m_s"]) < 0.2
    assert result["law_figure"] == "survey-shadow.png"
    assert (tmp_path / "survey-shadow.png").stat().st_size > 10_000
    code, out, _ = cli("replay", "other.tlog", "--from", "mode:OFFBOARD", "--to", "mode:OFFBOARD", "--depth", "rate")
    assert code == 0
    assert "would these poses have done for the law?" in out
    assert re.search(r"OFFBOARD 0-\d+ s, reference: ", out)
    assert "roll rate" in out
    assert (tmp_path / "other-shadow.png").exists()


def test_a_law_that_is_none_beside_a_log_of_others(cli, run_dir, tmp_path):
    (tmp_path / "other.tlog").write_bytes((run_dir / "flight.tlog").read_bytes())
    code, out, err = cli("replay", "other.tlog", "--set", "law.omega0=2")
    assert (code, out) == (2, "")
    assert "--set: law.omega0: unknown key" in err


def test_a_second_survey_does_not_overwrite_the_figure_of_the_first(cli, run_dir, tmp_path):
    (tmp_path / "other.tlog").write_bytes((run_dir / "flight.tlog").read_bytes())
    (tmp_path / "other.png").write_text("mine")
    code, out, _ = cli("replay", "other.tlog")
    assert code == 0
    assert "figure: other-2.png" in out
    assert (tmp_path / "other.png").read_text() == "mine"


def test_a_folder_name_is_no_markup(cli, tmp_path):
    code, out, _ = cli("sim", *SHORT, "--run-dir", "a[/b]")
    assert code == 0
    assert "a[/b]" in out


def test_an_error_of_our_own_is_one_message_and_a_file(cli, monkeypatch):
    def broken(*_: object) -> None:
        raise ZeroDivisionError("planted")

    monkeypatch.setattr("mavquad.control.controller.demand", broken)
    code, out, err = cli("sim", *SHORT, "--json")
    assert code == 70
    assert out == ""
    assert "mavquad failed (ZeroDivisionError: planted)" in err
    details = Path(re.search(r"details are in (\S+)", err)[1].rstrip(";"))
    assert "planted" in details.read_text()
    details.unlink()


def test_a_guard_ends_a_flight_with_exit_code_4(cli):
    code, out, err = cli("sim", *LEANING, "--json")
    assert code == 4
    assert "guard 'tilt'" in err
    assert json.loads(out)["completed"] is False


def test_a_refusal_ends_with_exit_code_3(cli):
    code, _, err = cli("sim", "--set", 'mock.firmware="1.16"', "--depth", "torque", "--json")
    assert code == 3
    assert "PX4 1.16" in err
    assert "--depth rate" in err


@pytest.mark.parametrize(
    ("options", "depth", "control"),
    [
        ([], "torque", "control_roll_norm"),
        (["--set", 'mock.firmware="1.16"'], "rate", "control_roll_rate_rad_s"),
        (["--depth", "attitude"], "attitude", "control_roll_rad"),
    ],
)
def test_a_flight_of_each_depth_leaves_its_trace_and_replays(cli, tmp_path, options, depth, control):
    code, out, _ = cli("sim", *SHORT, *options, "--json", "--run-dir", "run")
    assert code == 0
    assert json.loads(out)["depth"] == depth
    header, *rows = (tmp_path / "run" / "trace.csv").read_text().splitlines()
    assert control in header.split(",")
    assert len(rows) == json.loads(out)["setpoints_sent"]
    assert f"depth {depth}, measurements full" in (tmp_path / "run" / "notes.jsonl").read_text()
    code, out, _ = cli("replay", "run/flight.tlog", "--json")
    assert code == 0
    assert json.loads(out)["outbound"]["first_mismatch"] is None


@pytest.mark.parametrize(("options", "wanted"), [(LEANING, 4), (SHORT, 2)])
def test_a_figure_that_cannot_be_written_does_not_hide_how_the_flight_ended(cli, monkeypatch, options, wanted):
    def full(*_: object) -> None:
        raise RunFolderError("flight.png", "disk full")

    monkeypatch.setattr("mavquad.analysis.figures.flight_figure", full)
    code, out, err = cli("sim", *options, "--json")
    assert code == wanted
    assert json.loads(out)["setpoints_sent"] > 0
    assert err.endswith("flight.png: disk full\n")
