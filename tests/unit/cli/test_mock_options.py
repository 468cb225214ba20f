"""The options of `sim` and `fly` that choose the embedded mock: what they set, and where they make no sense."""

import pytest

from mavquad.cli.flight import load_config
from mavquad.cli.mock_options import fault_overrides, mock_options
from mavquad.config import Override
from sitl_mock.config.vehicle import load_vehicle


@pytest.fixture
def columns() -> str:
    """Messages are looked for in one piece."""
    return "200"


@pytest.fixture
def fault_file(tmp_path):
    """Writes a fault file of some kinds of faults at 3 s; returns its path."""

    def write(name, *kinds):
        path = tmp_path / name
        path.write_text("".join(f"[[fault]]\nkind = '{kind}'\nat_s = 3.0\n" for kind in kinds))
        return path

    return write


def mock_of(autopilot=None, firmware=None, vehicle=None, faults=(), path=None):
    options = mock_options(autopilot, firmware, vehicle)
    given = [
        Override(key, str(value), option)
        for option, keys in options.items()
        for key, value in keys.items()
        if value is not None
    ]
    config, mock = load_config(path, given + fault_overrides(faults))
    assert config.mock == mock.model_dump(mode="json"), "what is kept in the run folder is what flies"
    return mock


def test_without_options_it_is_the_configured_mock():
    mock = mock_of()
    assert (mock.autopilot, mock.firmware, mock.faults) == ("px4", "auto", ())
    assert mock.vehicle.params() == load_vehicle("sih").params()


def test_autopilot_and_firmware():
    mock = mock_of("ardupilot", "4.7")
    assert (mock.autopilot, mock.firmware) == ("ardupilot", "4.7")


def test_ardupilot_brings_its_own_vehicle_unless_another_is_named():
    assert mock_of("ardupilot").vehicle.params() == load_vehicle("arducopter").params()
    assert mock_of("ardupilot", vehicle="sih").vehicle.params() == load_vehicle("sih").params()
    assert mock_of("px4", vehicle="arducopter").vehicle.params() == load_vehicle("arducopter").params()


def test_a_vehicle_file_replaces_the_whole_table(tmp_path):
    (tmp_path / "heavy.toml").write_text("mass_kg = 1.2\n")
    (tmp_path / "config.toml").write_text("[mock.vehicle]\narm_m = 0.3\n")
    vehicle = mock_of(vehicle=str(tmp_path / "heavy.toml"), path=tmp_path / "config.toml").vehicle
    assert (vehicle.mass_kg, vehicle.arm_m) == (1.2, 0.2)


def test_faults_come_on_top_of_the_files(tmp_path, fault_file):
    (tmp_path / "config.toml").write_text("[[mock.faults]]\nkind = 'die'\nat_s = 90.0\n")
    files = [fault_file("a.toml", "reboot", "payload_drop"), fault_file("b.toml", "die")]
    faults = mock_of(faults=files, path=tmp_path / "config.toml").faults
    assert [(fault.kind, fault.at_s) for fault in faults] == [
        ("die", 90.0),
        ("reboot", 3.0),
        ("payload_drop", 3.0),
        ("die", 3.0),
    ]


@pytest.mark.parametrize("command", ["sim", "fly"])
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--autopilot", "apm"], "--autopilot: Input should be 'px4' or 'ardupilot'"),
        (["--firmware", "1.12"], "--firmware: Input should be 'auto', '1.13', '1.14', '1.15', '1.16', '1.17'"),
        (["--wind", "1,0,0", "--firmware", "4.7"], "--firmware mock.firmware: firmware 4.7 is none of px4's"),
        (["--vehicle", "zeppelin"], "zeppelin: no such file, and no vehicle of that name"),
        (["--fault", "none.toml"], "none.toml: no such file"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_wrong_ones_are_named(cli, tmp_path, command, arguments, words):
    code, out, err = cli(command, *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (["--wind", "3,0,0"], "--wind"),
        (["--seed", "2"], "--seed"),
        (["--autopilot", "px4"], "--autopilot"),
        (["--autopilot", "ardupilot"], "--autopilot"),
        (["--firmware", "1.16"], "--firmware"),
        (["--vehicle", "sih"], "--vehicle"),
        (["--set", "mock.ready_s=2"], "--set mock.ready_s"),
        (["--set", "seed=2"], "--set seed"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_with_a_vehicle_connected_they_are_refused(cli, tmp_path, arguments, option):
    code, out, err = cli("fly", "--connect", "udpout:127.0.0.1:9", *arguments)
    assert (code, out) == (2, "")
    assert f"{option}: this is for the mock, and udpout:127.0.0.1:9 is a vehicle that runs already" in err
    assert not list(tmp_path.iterdir())


def test_faults_too(cli, fault_file):
    code, _, err = cli("fly", "--connect", "udpout:127.0.0.1:9", "--fault", str(fault_file("a.toml", "die")))
    assert code == 2
    assert "--fault: this is for the mock" in err


def test_a_vehicle_of_the_configuration_is_one_too(cli, tmp_path):
    (tmp_path / "mine.toml").write_text("[link]\nurl = 'udpout:127.0.0.1:9'\n")
    code, _, err = cli("fly", "mine.toml", "--wind", "3,0,0")
    assert code == 2
    assert "--wind: this is for the mock" in err
