"""The command line without its socket: options, files, addresses, messages. (Sockets: the interop tests.)"""

import pytest
from typer.testing import CliRunner

from mavquad.errors import ConfigError, InputError
from mavquad.schema import parse_section
from sitl_mock import cli
from sitl_mock.config import MockConfig
from sitl_mock.options import load_config, three_numbers


def test_no_options_is_the_default_mock():
    assert load_config(None, {}) == MockConfig()


@pytest.mark.parametrize("text", ["ready_s = 2.0\nfirmware = '1.16'\n", "[mock]\nready_s = 2.0\nfirmware = '1.16'\n"])
def test_file_and_options(tmp_path, text):
    path = tmp_path / "mock.toml"
    path.write_text(text)
    config = load_config(path, {"wind_ned_m_s": three_numbers("--wind", "3,-2,0.5"), "firmware": "1.13"})
    assert (config.ready_s, config.firmware, config.wind_ned_m_s) == (2.0, "1.13", (3.0, -2.0, 0.5))


@pytest.mark.parametrize(
    ("text", "key"), [("x = 1", "mock.x"), ("[vehicle]\nmass_kg = -1.0", "mock.vehicle.mass_kg"), ("x = [", "")]
)
def test_bad_files_name_the_key(tmp_path, text, key):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_config(path, {})
    assert caught.value.key == key


def test_missing_file(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        load_config(tmp_path / "none.toml", {})


@pytest.mark.parametrize("wind", ["1,2", "a,b,c", "1,2,3,4"])
def test_bad_wind(wind):
    with pytest.raises(InputError, match="not three numbers"):
        three_numbers("--wind", wind)


def test_errors_are_one_message_and_an_exit_code(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["sitl-mock", "--firmware", "1.14"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "mock.firmware" in said
    assert "Traceback" not in said


def test_help_shows_the_name_of_the_table():
    shown = CliRunner().invoke(cli.app, ["--help"]).output
    assert "a file with a [mock] table" in " ".join(shown.split())


@pytest.mark.parametrize(("number", "text"), [(1.13, "1.13"), (1.15, "1.15"), (1.16, "1.16")])
def test_firmware_may_be_a_number(number, text):
    assert parse_section(MockConfig, {"firmware": number}, "mock.toml", "mock").firmware == text


@pytest.mark.parametrize("value", [1.14, 1, True, "1.130", [1.13]])
def test_no_other_firmware(value):
    with pytest.raises(ConfigError, match=r"'auto', '1\.13', '1\.15', '1\.16' or '4\.7'") as caught:
        parse_section(MockConfig, {"firmware": value}, "mock.toml", "mock")
    assert caught.value.key == "mock.firmware"


def test_help_names_the_options():
    shown = CliRunner().invoke(cli.app, ["--help"], env={"COLUMNS": "200"}).output
    assert all(option in shown for option in ("--endpoint", "--seed", "--wind", "--firmware", "--announce"))
