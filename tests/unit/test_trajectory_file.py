"""Trajectory files: what they hold becomes part of the configuration; what is wrong is told with its line."""

from __future__ import annotations

import math
import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.config import default_path, dump, load, parse_override
from mavquad.control.reference import ReferenceParams
from mavquad.errors import ConfigError
from mavquad.trajectory_file import read_rows

GOOD = "t_s,north_m,east_m,down_m\n0,0,0,0\n1,1,0,0\n2,2,0,-0.5\n"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "path.csv"


def rows_of(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_rows(path, ReferenceParams())


def test_rows_are_read(path):
    assert rows_of(path, GOOD) == [[0, 0, 0, 0], [1, 1, 0, 0], [2, 2, 0, -0.5]]


@pytest.mark.parametrize(
    "content",
    [
        "\ufeff" + GOOD,
        GOOD.replace("\n", "\r\n"),
        GOOD.rstrip("\n"),
        "# my path\n\n" + GOOD.replace("\n1,", "\n\n  # half way\n1,"),
        GOOD.replace(",", " , "),
        GOOD.replace("0,0,0,0", '"0","0",0,0'),
        "down_m,east_m,t_s,north_m\n0,0,0,0\n0,0,1,1\n-0.5,0,2,2\n",
    ],
)
def test_ways_to_write_the_same(path, content):
    assert rows_of(path, content) == [[0, 0, 0, 0], [1, 1, 0, 0], [2, 2, 0, -0.5]]


def test_a_fifth_column_is_the_yaw(path):
    content = "yaw_deg,t_s,north_m,east_m,down_m\n10,0,0,0,0\n20,1,1,0,0\n"
    assert rows_of(path, content) == [[0, 0, 0, 0, 10], [1, 1, 0, 0, 20]]


@pytest.mark.parametrize(
    ("content", "key", "words"),
    [
        (b"", "", "is empty"),
        ("\n  \n# nothing\n", "", "is empty"),
        ("t_s,north_m,east_m,down_m\n", "", "has 0 rows below its header"),
        ("t_s,north_m,east_m,down_m\n0,0,0,0\n", "", "has 1 rows below its header"),
        ("0,0,0,0\n1,1,0,0\n", "line 1", "there is no column t_s"),
        (GOOD.replace("down_m", "up_m"), "line 1", "there is no column down_m"),
        (GOOD.replace("down_m", "down_m,speed"), "line 1", "unknown column 'speed'"),
        (GOOD.replace("down_m", "down_m,t_s"), "line 1", "column t_s is there 2 times"),
        (GOOD.replace("\n1,1,0,0", "\n\n1,1,0"), "line 4", "3 values for 4 columns"),
        (GOOD.replace("1,1,0,0", "1,1,0,0,0"), "line 3", "5 values for 4 columns"),
        (GOOD.replace("1,1,0,0", "1,one,0,0"), "line 3", "north_m is 'one', not a number"),
        (GOOD.replace("1,1,0,0", "1,,0,0"), "line 3", "north_m is '', not a number"),
        (GOOD.replace("1,1,0,0", "1,nan,0,0"), "line 3", "north_m is nan, not a finite number"),
        (GOOD.replace("1,1,0,0", "1,1,0,-inf"), "line 3", "down_m is -inf, not a finite number"),
        (GOOD.replace("1,1,0,0", "1,1,0,1e999"), "line 3", "down_m is inf, not a finite number"),
        (GOOD.replace("2,2,0", "1,2,0"), "line 4", "time must grow from row to row"),
        (
            GOOD.replace("1,1,0,0", "# a remark\n1,8,0,0"),
            "line 4",
            "8.00 m/s, 6.50 m/s above mission.reference.speed_max",
        ),
        (GOOD.encode() + b"3,\xff,0,0\n", "line 5", "is not UTF-8 text"),
        (b"\x00" * 1000, "line 1", "there is no column t_s"),
        (b"PK\x03\x04\x00\xfe" * 50, "line 1", "is not UTF-8 text"),
        (GOOD.replace("\n2", '\n"2'), "line 4", "1 values for 4 columns"),
        ("t_s;north_m;east_m;down_m\n0;0;0;0\n", "line 1", "there is no column t_s"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(path, content, key, words):
    with pytest.raises(ConfigError) as caught:
        rows_of(path, content)
    assert (caught.value.path, caught.value.key) == (str(path), key)
    assert words in caught.value.reason
    assert caught.value.exit_code == 2


def test_too_much_of_it(path):
    with pytest.raises(ConfigError, match="more than 20000 rows"):
        rows_of(path, GOOD + "".join(f"{3 + k},2,0,0\n" for k in range(20_000)))
    with pytest.raises(ConfigError, match="larger than 10 MB"):
        rows_of(path, b"#" * 10_000_001)


def test_no_such_file_and_no_file(tmp_path):
    for name, words in (("none.csv", "no such file"), (".", "cannot be read"), ("a\0b", "cannot be read")):
        with pytest.raises(ConfigError, match=words):
            read_rows(tmp_path / name, ReferenceParams())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_no_permission(path):
    path.write_text(GOOD)
    path.chmod(0)
    with pytest.raises(ConfigError, match="permission denied"):
        read_rows(path, ReferenceParams())


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200) | st.text(alphabet="t_snorthmeaswdy,0123456789.-\n\"'#e", max_size=200).map(str.encode))
def test_whatever_it_holds_is_read_or_refused(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    for start in (b"", b"t_s,north_m,east_m,down_m\n"):
        path.write_bytes(start + content)
        try:
            assert len(read_rows(path, ReferenceParams())) >= 2
        except ConfigError as error:
            assert error.path == str(path)


# ------------------------------------------------------------------ as part of a configuration


def slow_path():
    rows = (f"{0.5 * k},{math.sin(0.1 * k):.4f},{0.05 * k:.3f},0" for k in range(40))
    return "t_s,north_m,east_m,down_m\n" + "\n".join(rows) + "\n"


def test_the_option_is_enough_and_is_relative_to_the_current_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "path.csv").write_text(slow_path())
    mission = load(default_path(), [parse_override("mission.file=path.csv")]).mission
    assert (mission.name, mission.file, len(mission.points)) == ("file", "", 40)
    assert mission.points[2] == (1.0, 0.1987, 0.1, 0.0)


def test_in_a_toml_file_it_is_relative_to_that(tmp_path, monkeypatch):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "path.csv").write_text(slow_path())
    (tmp_path / "there" / "mine.toml").write_text('[mission]\nfile = "path.csv"\n')
    monkeypatch.chdir(tmp_path)
    mission = load(tmp_path / "there" / "mine.toml").mission
    assert (mission.name, len(mission.points)) == ("file", 40)


def test_the_dump_holds_the_rows_and_needs_no_file(tmp_path):
    (tmp_path / "path.csv").write_text(slow_path())
    config = load(default_path(), [parse_override(f"mission.file={tmp_path / 'path.csv'}")])
    (tmp_path / "path.csv").unlink()
    (tmp_path / "config.toml").write_text(dump(config))
    assert load(tmp_path / "config.toml") == config


def test_another_file_replaces_the_rows(tmp_path):
    (tmp_path / "path.csv").write_text(slow_path())
    config = load(default_path(), [parse_override(f"mission.file={tmp_path / 'path.csv'}")])
    (tmp_path / "config.toml").write_text(dump(config))
    (tmp_path / "path.csv").write_text(GOOD.replace("2,2,0,-0.5", "5,2,0,-0.5"))
    again = load(tmp_path / "config.toml", [parse_override(f"mission.file={tmp_path / 'path.csv'}")])
    assert len(again.mission.points) == 3


def test_another_mission_beside_it_wins_and_the_file_is_not_read(tmp_path):
    given = ["mission.name=hover", "mission.file=none.csv"]
    assert load(default_path(), [parse_override(text) for text in given]).mission.name == "hover"
    (tmp_path / "mine.toml").write_text('[mission]\nname = "hover"\nfile = "none.csv"\n')
    assert load(tmp_path / "mine.toml").mission.name == "hover"


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["mission.name=file"], '--set mission.name: name = "file" needs a file'),
        (["mission.file=none.csv"], "none.csv: no such file"),
        (["mission.file=5"], "--set: mission.file: Input should be a valid string"),
        (["mission.file=path.csv", "mission.reference.speed_max_m_s=0"], "--set: mission.reference.speed_max_m_s: "),
        (["mission.file=path.csv", "mission.reference=3"], "--set: mission.reference: "),
        (["mission.file=path.csv", "mission.reference.speed_max_m_s=0.05"], "path.csv: line 3: a jump of 0.11 m"),
        (
            ["mission.file=path.csv", "guards.radius_m=1.5"],
            "--set mission.file=path.csv: mission.file puts the path 2.1 m",
        ),
        (
            ["mission.file=path.csv", "mission.reference.speed_max_m_s=0.21"],
            "the path of mission.file asks for 0.2",
        ),
        (["mission.points=[[0.0, 0.0]]", "mission.name=file"], "points, row 1: 1 rows"),
        (["mission.points=[[0, 0, 0, 0], [1, 9, 0, 0]]", "mission.name=file"], "points, row 2: a jump of 9.00 m"),
        (["mission.points=[[0, 0, 0, 0], [1, nan, 0, 0]]", "mission.name=file"], "finite number"),
    ],
)
def test_errors_name_the_file_or_the_option(tmp_path, monkeypatch, overrides, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "path.csv").write_text(slow_path())
    with pytest.raises(ConfigError) as caught:
        load(default_path(), [parse_override(text) for text in overrides])
    assert words in caught.value.message
