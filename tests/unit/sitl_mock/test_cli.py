"""The command line without its sockets: options, files, help, messages. (With them: tests/live, and the interop tests.)"""

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from mavquad.errors import ConfigError, EndpointError, InputError
from mavquad.schema import parse_section
from sitl_mock import cli, command
from sitl_mock.config import MockConfig
from sitl_mock.config.vehicle import load_vehicle
from sitl_mock.options import load_config, three_numbers

NOTHING = (None, {}, None, ())
IDEAL_LINK = {"link": {"latency_ms": 0.0}}


@pytest.fixture
def sitl_mock(monkeypatch, capsys):
    """Runs `sitl-mock ARGUMENTS`, which must fail before it opens a socket; (exit code, what it says on stderr)."""

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["sitl-mock", *arguments])
        monkeypatch.setenv("COLUMNS", "200")
        monkeypatch.setattr(command.asyncio, "run", lambda _: pytest.fail("it started"))
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert out == ""
        return ended.value.code, err

    return run


@pytest.fixture
def file(tmp_path):
    """Writes a file; returns its path."""

    def write(text, name="mock.toml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


# ---------------------------------------------------------------------- the configuration


def test_no_options_is_the_default_mock_with_no_link_but_the_sockets():
    assert load_config(*NOTHING) == parse_section(MockConfig, IDEAL_LINK, "test")


@pytest.mark.parametrize("head", ["", "[mock]\n"])
def test_options_win_over_the_file(file, head):
    path = file(f"{head}ready_s = 2.0\nfirmware = '1.16'\n")
    options = {"--firmware": ("firmware", "1.15"), "--ready": ("ready_s", None), "--gusts": ("gusts_m_s", 1.5)}
    config = load_config(path, options, None, ())
    assert (config.ready_s, config.firmware, config.gusts_m_s) == (2.0, "1.15", 1.5)


def test_a_file_may_ask_for_a_link_with_delays(file):
    assert load_config(file("[mock.link]\nlatency_ms = 30.0\n"), {}, None, ()).link.latency_ms == 30.0


def test_a_vehicle_by_name_and_by_file_replaces_the_files(file):
    path = file("[mock.vehicle]\nmass_kg = 1.3\n")
    assert load_config(path, {}, None, ()).vehicle.mass_kg == 1.3
    assert load_config(path, {}, "arducopter", ()).vehicle == load_vehicle("arducopter")
    assert load_config(path, {}, str(file("mass_kg = 1.1\n", "v.toml")), ()).vehicle.mass_kg == 1.1


def test_ardupilot_flies_its_own_vehicle_unless_told_otherwise():
    options = {"--autopilot": ("autopilot", "ardupilot")}
    assert load_config(None, options, None, ()).vehicle.params() == load_vehicle("arducopter").params()
    assert load_config(None, options, "sih", ()).vehicle.params() == load_vehicle("sih").params()


def test_faults_of_all_files_come_on_top(file):
    config = file("[[mock.faults]]\nkind = 'die'\nat_s = 9\n")
    first = file("[[fault]]\nkind = 'silent'\nfrom_s = 1.0\nfor_s = 2.0\n", "a.toml")
    second = file("[[fault]]\nkind = 'die'\nat_s = 5\n", "b.toml")
    kinds = [fault.kind for fault in load_config(config, {}, None, (first, second)).faults]
    assert kinds == ["die", "silent", "die"]


@pytest.mark.parametrize(
    ("text", "key"), [("x = 1", "mock.x"), ("[vehicle]\nmass_kg = -1.0", "mock.vehicle.mass_kg"), ("x = [", "")]
)
def test_bad_files_name_the_key(file, text, key):
    with pytest.raises(ConfigError) as caught:
        load_config(file(text), {}, None, ())
    assert caught.value.key == key


@pytest.mark.parametrize("wind", ["1,2", "a,b,c", "1,2,3,4", ""])
def test_bad_wind(wind):
    with pytest.raises(InputError, match="not three numbers"):
        three_numbers("--wind", wind)


@pytest.mark.parametrize(("number", "text"), [(1.13, "1.13"), (1.15, "1.15"), (1.17, "1.17")])
def test_firmware_may_be_a_number(number, text):
    assert parse_section(MockConfig, {"firmware": number}, "mock.toml", "mock").firmware == text


@pytest.mark.parametrize("value", [1.12, 1, True, "1.130", [1.13]])
def test_no_other_firmware(value):
    with pytest.raises(ConfigError, match=r"'auto', '1\.13', '1\.14', '1\.15', '1\.16', '1\.17' or '4\.7'") as caught:
        parse_section(MockConfig, {"firmware": value}, "mock.toml", "mock")
    assert caught.value.key == "mock.firmware"


# ---------------------------------------------------------------------- the vehicles


@pytest.mark.parametrize(
    ("table", "option", "instance", "wanted"),
    [
        ({}, None, 0, 1),
        ({}, None, 4, 5),
        ({}, 9, 4, 9),
        ({"system_id": 7}, None, 4, 7),
        ({"autopilot": "ardupilot"}, None, 4, 1),
    ],
)
def test_the_first_system_id_is_as_the_real_ones_number_themselves(table, option, instance, wanted):
    assert command.first_system_id(parse_section(MockConfig, table, "test"), option, instance) == wanted


def test_vehicles_differ_in_id_seed_and_ports():
    fleet = command.fleet(MockConfig(), 3, instance=1, first_id=2, seed=10, endpoints=[])
    assert [spec.config.system_id for spec in fleet] == [2, 3, 4]
    assert [spec.seed for spec in fleet] == [10, 11, 12]
    assert [spec.links[0].speak_to.port for spec in fleet] == [14541, 14542, 14543]


def test_named_endpoints_replace_the_usual_ones():
    fleet = command.fleet(MockConfig(), 2, 0, 1, 1, ["udpin:127.0.0.1:7000", "tcpin:127.0.0.1:8000"])
    assert [[link.listen.port for link in spec.links] for spec in fleet] == [[7000, 8000], [7001, 8001]]


def test_system_ids_end_at_255():
    assert command.fleet(MockConfig(), 2, 0, 254, 1, [])[-1].config.system_id == 255
    with pytest.raises(InputError, match="from 254 to 256"):
        command.fleet(MockConfig(), 3, 0, 254, 1, [])


def test_an_endpoint_that_is_none():
    with pytest.raises(EndpointError):
        command.fleet(MockConfig(), 1, 0, 1, 1, ["udp:127.0.0.1:7000"])


# ---------------------------------------------------------------------- what a user sees


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--firmware", "1.12"], "error: --firmware: Input should be 'auto', '1.13', '1.14', '1.15', '1.16', '1.17'"),
        (["--firmware", "4.7"], "error: --firmware: firmware 4.7 is none of px4's"),
        (["--autopilot", "apm"], "error: --autopilot: Input should be 'px4' or 'ardupilot'"),
        (["--autopilot", "ardupilot", "--firmware", "1.16"], "error: --firmware: firmware 1.16 is none of ardupilot's"),
        (["--wind", "1,2"], "error: --wind: '1,2' is not three numbers"),
        (["--wind", "1,2,99"], "error: --wind: Input should be less than or equal to 50"),
        (["--gusts", "-1"], "error: --gusts: Input should be greater than or equal to 0"),
        (["--ready", "nan"], "error: --ready: Input should be a finite number"),
        (["--vehicle", "zeppelin"], "zeppelin: no such file, and no vehicle of that name (there are: "),
        (["--fault", "none.toml"], "error: none.toml: no such file"),
        (["--config", "none.toml"], "error: none.toml: no such file"),
        (["--config", "."], "cannot be read (is a directory)"),
        (["--endpoint", "14540"], "error: 14540: not an endpoint of the mock"),
        (["--endpoint", "udpin:127.0.0.1:99999"], "port 99999 is out of range"),
        (["--vehicles", "0"], "'--vehicles'"),
        (["--vehicles", "many"], "'--vehicles'"),
        (["--vehicles", "250", "--system-id", "9"], "system ids would run from 9 to 258"),
        (["--speed", "0"], "'--speed'"),
        (["--speed", "nan"], "'--speed'"),
        (["--instance", "-1"], "'--instance'"),
        (["--seed", "-1"], "'--seed'"),
        (["--nonsense"], "No such option: --nonsense"),
        (["nonsense"], "unexpected extra argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_a_wrong_option_is_a_message_and_exit_code_2(sitl_mock, arguments, words):
    code, said = sitl_mock(*arguments)
    assert code == 2
    assert words in said


def test_a_typo_in_a_fault_file_names_file_and_key(sitl_mock, file):
    path = file("[[fault]]\nkind = 'silent'\nfrom_s = 1.0\nfor_sec = 2.0\n")
    code, said = sitl_mock("--fault", str(path))
    assert code == 2
    assert str(path) in said
    assert "for_sec" in said


def test_help_has_every_option_the_ports_and_the_exit_codes():
    shown = CliRunner().invoke(command.app, ["--help"], env={"COLUMNS": "200"}).output
    words = ["14580+N", "18570+N", "5760+10N", "[[fault]]", "a file with a [mock] table", "2 bad input"]
    options = [f"--{name.replace('_', '-')}" for name in command.run.__annotations__ if name != "return"]
    assert len(options) == 16
    assert [word for word in [*words, *options] if word not in shown] == []


def test_an_error_of_the_mock_itself_is_told_as_such(monkeypatch, capsys):
    def broken(*_):
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(command, "load_config", broken)
    monkeypatch.setattr("sys.argv", ["sitl-mock"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 70
    assert "error in the mock autopilot itself: ZeroDivisionError: a fault of ours" in capsys.readouterr().err


def test_ctrl_c_while_it_starts_is_no_error(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_run", interrupted)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_a_closed_stderr_changes_nothing():
    command = f'"{sys.executable}" -m sitl_mock --announce --endpoint udpin:127.0.0.1:0 2>&-'
    ended = subprocess.run(["sh", "-c", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=60)
    assert ended.returncode == 0
    assert json.loads(ended.stdout)["url"].startswith("udpout:")
