"""`mavquad identify` from the outside: a flight of the bundled mock, whose rotors and link are known."""

import json
import tomllib
from pathlib import Path

import pytest

from mavquad.tlog import read_records


@pytest.fixture(scope="module")
def flight(tmp_path_factory) -> Path:
    """The log of a box at depth torque in lockstep: rotor lag 50 ms, link 10 ms each way, samples 5 ms old."""
    from mavquad.cli.sim import sim
    from mavquad.config import Override

    folder = tmp_path_factory.mktemp("flight") / "run"
    assert sim(None, [Override("law.depth", "torque")], folder, as_json=True) == 0
    return folder / "flight.tlog"


def test_it_finds_the_mocks_rotors_link_and_torque_scale(cli, flight) -> None:
    code, out, err = cli("identify", "--json", str(flight))
    assert (code, err) == (0, "")
    found = json.loads(out)
    [report] = found["depths"]
    settings = report["settings"]
    assert (report["depth"], found["clock"]) == ("torque", "timesync")
    assert found["round_trip_s"] == pytest.approx(0.020, abs=0.001)
    assert settings["law.delay_s"] == pytest.approx(0.025, abs=0.002)
    assert 0.0 <= settings["law.dead_time_s"] < 0.008  # the mock takes in a command once in 4 ms
    assert settings["law.lag_s"] == pytest.approx(0.05, rel=0.08)
    assert settings["airframe.torque_scale_frd_rad_s2"] == pytest.approx([113.1, 113.1, 13.3], rel=0.03)
    assert report["axes"]["roll"]["damping_1_s"]["value"] == pytest.approx(1.0, abs=0.2)


def test_the_table_fits_the_terminal_and_the_lines_are_a_configuration(cli, flight) -> None:
    code, out, err = cli("identify", str(flight), "-o", "fits.png")
    assert (code, err) == (0, "")
    rows = [line for line in out.splitlines() if line.split()[:1] in (["roll"], ["pitch"], ["yaw"])]
    assert len(rows) == 3
    assert all("…" not in row and "%" in row and len(row) <= 80 for row in rows)
    lines = out[out.index("# delay") : out.index("figure: fits.png")]
    assert set(tomllib.loads(lines)["law"]) == {"delay_s", "dead_time_s", "lag_s", "yaw_dead_time_s", "yaw_lag_s"}
    assert Path("fits.png").read_bytes().startswith(b"\x89PNG")


def test_only_the_figure_that_was_asked_for_is_written(cli, flight, tmp_path) -> None:
    code, out, _ = cli("identify", str(flight), "--json")
    assert code == 0
    assert json.loads(out)["figure"] is None
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.tlog"], "missing.tlog: no such file"),
        (["."], "is a folder, not a file"),
        (["missing.tlog", "-o", "x.pdf"], "'x.pdf' does not end with .png"),
        ([], "Missing argument 'log'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
@pytest.mark.parametrize("more", [[], ["--json"]])
def test_bad_input_is_exit_code_2(cli, tmp_path, arguments, words, more) -> None:
    code, out, err = cli("identify", *arguments, *more)
    assert (code, out) == (2, "")
    assert words in err
    assert not list(tmp_path.iterdir())


def cut(flight: Path, path: Path, least_s: float, most_s: float) -> None:
    """The part of a log between two times since it began."""
    contents = read_records(flight)
    begin_us = contents[0].stamp_us
    inside = [i for i in range(len(contents)) if least_s <= (contents[i].stamp_us - begin_us) * 1e-6 <= most_s]
    path.write_bytes(contents.data[contents.starts[inside[0]] - 8 : contents.ends[inside[-1]]])


@pytest.mark.parametrize(
    ("most_s", "words"),
    [
        (1.0, "no attitude, rate or torque setpoints in it"),
        (7.0, "nothing can be identified: too little data: 0 answers"),
        (10.5, "nothing can be identified: too little data"),
    ],
)
def test_a_log_that_says_nothing_says_why(cli, flight, tmp_path, most_s, words) -> None:
    cut(flight, tmp_path / "part.tlog", 0.0, most_s)
    code, out, err = cli("identify", "part.tlog", "--json")
    assert (code, out) == (2, "")
    assert "part.tlog: " in err
    assert words in err


def test_an_empty_log(cli) -> None:
    Path("empty.tlog").touch()
    code, out, err = cli("identify", "empty.tlog")
    assert (code, out) == (2, "")
    assert "empty.tlog: the file is empty" in err
