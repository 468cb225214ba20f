"""`mavquad tune` from the outside: tables, JSON, the map, the file of gains, and what is refused."""

import json
import tomllib

import pytest

from mavquad.cli.tune import limits_of
from mavquad.config import load
from mavquad.errors import InputError

MINE = '[link]\nurl = "udpin:127.0.0.1:14599"\n[law]\ndelay_s = 0.03\n'
QUICK = ("--depth", "attitude", "--set", "law.measurements=position_yaw")


@pytest.fixture
def cli(cli, tmp_path):
    """Runs `mavquad tune ARGUMENTS` in a folder that has mine.toml."""
    (tmp_path / "mine.toml").write_text(MINE)
    return lambda *arguments: cli("tune", *arguments)


def test_tables_fit_a_narrow_terminal(cli):
    code, out, err = cli("mine.toml", "--depth", "torque")
    assert (code, err) == (0, "")
    assert "delay 30 ms" in out
    assert "…" not in out
    lines = [line for line in out.splitlines() if line.startswith("torque")]
    assert [line.split()[1] for line in lines] == ["z", "x,", "yaw"] * 2 + ["z,", "yaw"]


def test_all_depths_unless_one_is_said(cli):
    code, out, _ = cli("mine.toml", "--json")
    assert code == 0
    assert [report["depth"] for report in json.loads(out)["depths"]] == ["torque", "rate", "attitude"]


def test_json_is_complete_and_strict(cli):
    code, out, _ = cli("mine.toml", *QUICK, "--set", "law.omega0_rad_s=45", "--set", "law.kappa_rad_s=400", "--json")
    assert code == 0

    def no_constant(name: str) -> None:
        raise AssertionError(name)

    (report,) = json.loads(out, parse_constant=no_constant)["depths"]
    channel = report["channels"]["horizontal"]
    assert (channel["stable"], channel["ms"], channel["noise"], channel["delay_margin_s"]) == (False, None, None, 0.0)
    assert report["channels"]["yaw"]["stable"]
    assert len(report["channels"]["yaw"]["eigenvalues"]) > 5
    assert report["limits"]["ms"] == 2.5


def test_written_gains_are_a_configuration_that_keeps_the_rest(cli, tmp_path):
    code, out, _ = cli("mine.toml", *QUICK, "--write", "fast.toml")
    assert code == 0
    assert "gains: fast.toml" in out
    law = tomllib.loads((tmp_path / "fast.toml").read_text())["law"]
    assert set(law) == {
        "depth", "delay_s", "measurements", "omega0_rad_s", "kappa_rad_s", "yaw_omega0_rad_s", "yaw_kappa_rad_s",
    }  # fmt: skip
    config = load(tmp_path / "fast.toml")
    assert (config.link.url, config.law.delay_s, config.law.depth) == ("udpin:127.0.0.1:14599", 0.03, "attitude")
    code, again, _ = cli("fast.toml", "--json")
    (report,) = json.loads(again)["depths"]
    for channel in report["channels"].values():
        assert channel["ms"] <= 2.5
        assert channel["delay_margin_s"] >= 0.02
    assert not list(tmp_path.glob(".*"))


def test_a_file_is_overwritten_only_by_force(cli, tmp_path):
    (tmp_path / "fast.toml").write_text("precious")
    code, _, err = cli("mine.toml", *QUICK, "--write", "fast.toml")
    assert code == 2
    assert "fast.toml exists" in err and "--force" in err
    assert (tmp_path / "fast.toml").read_text() == "precious"
    assert cli("mine.toml", *QUICK, "--write", "fast.toml", "--force")[0] == 0
    assert load(tmp_path / "fast.toml").law.omega0_rad_s


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.toml"], "missing.toml: no such file"),
        (["mine.toml", "--output", "map.pdf"], "does not end with .png"),
        (["mine.toml", "--write", "fast.toml"], "law.depth is auto"),
        (["mine.toml", *QUICK, "--ms", "1.01", "--write", "fast.toml"], "no gains keep these margins"),
        (["mine.toml", *QUICK, "--write", "no/such/folder.toml"], "cannot be written"),
        (["mine.toml", "--depth", "thrust"], "--depth"),
        (["mine.toml", "--ms", "0.9"], "--ms: 0.9 is not greater than 1"),
        (["mine.toml", "--phase-margin-deg", "100"], "--phase-margin-deg"),
        (["mine.toml", "--delay-margin-ms", "-1"], "--delay-margin-ms"),
    ],
)
def test_what_is_refused(cli, tmp_path, arguments, words):
    code, _, err = cli(*arguments)
    assert code == 2
    assert words in err.replace("\n", " ")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.toml"]


def test_not_a_number_is_no_margin():
    with pytest.raises(InputError):
        limits_of(float("nan"), None, None)
    with pytest.raises(InputError):
        limits_of(None, None, float("nan"))


def test_the_map_is_a_picture(cli, tmp_path, monkeypatch):
    monkeypatch.setattr("mavquad.analysis.margin_map._COLUMNS", 7)
    monkeypatch.setattr("mavquad.analysis.margin_map._ROWS", 6)
    code, out, _ = cli("mine.toml", *QUICK, "--output", "map.png")
    assert code == 0
    assert "map: map.png" in out
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "map.png").stat().st_size > 20_000
