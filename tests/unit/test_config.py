"""The configuration: the file, the overrides, and the complete one out again."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from mavquad.config import Config, Override, default_path, dump, load, parse_override, with_overrides
from mavquad.control.defaults import CHAIN_LENGTHS, defaults
from mavquad.errors import ConfigError
from mavquad.flight.machine import Phase
from mavquad.schema import read_toml

POLES = "[[-1, 0], [-1, 0], [-1, 0], [-2, 0]]"


@pytest.fixture
def write(tmp_path):
    def write_text(text):
        path = tmp_path / "c.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write_text


def parsed(texts):
    return [parse_override(text) for text in texts]


def refused(path, *overrides):
    with pytest.raises(ConfigError) as caught:
        load(path, parsed(overrides))
    assert caught.value.exit_code == 2
    return caught.value


def test_the_bundled_one_loads():
    config = load(default_path())
    assert config.link.url == "mock"


def test_an_empty_file_is_all_defaults(write):
    assert load(write("")) == Config()


@pytest.mark.parametrize("overrides", [[], ["seed=9", "law.omega0_rad_s=1.25", "mission.name=hover"]])
def test_what_is_dumped_loads_as_the_same(write, overrides):
    config = load(default_path(), parsed(overrides))
    assert load(write(dump(config))) == config


def test_the_dump_is_complete():
    text = dump(Config())
    for section in ("link", "streams", "flight", "airframe", "guards", "law", "law.limits", "mission.reference"):
        assert f"[{section}]" in text


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("sed = 1", "sed", "unknown key"),
        ("[law]\nomega = 1.0", "law.omega", "unknown key"),
        ("[law.limits]\ntilt = 1.0", "law.limits.tilt", "unknown key"),
        ("[mission.reference]\nspeed = 1.0", "mission.reference.speed", "unknown key"),
        ("[guards]\ntilt_deg = 90.0", "guards.tilt_deg", "less than or equal to 85"),
        ("[guards]\ntilt_deg = nan", "guards.tilt_deg", "finite"),
        ('[guards]\ntilt_deg = "45"', "guards.tilt_deg", "valid number"),
        ("seed = 1.5", "seed", "valid integer"),
        ("[link]\nsystem_id = 256", "link.system_id", "less than or equal to 255"),
        ('[link]\nurl = "ftp:1.2.3.4:1"', "link.url", "not a connection string"),
        ('[mission]\nname = "loop"', "mission.name", "'waypoints' or 'file'"),
        ("[airframe]\ntorque_scale_frd_rad_s2 = [1.0, 2.0]", "airframe.torque_scale_frd_rad_s2.2", "required"),
        ("[law]\nomega0_rad_s = 9.0\nkappa_rad_s = 5.0", "law", "kappa_rad_s must be greater"),
        ("seed = 1979-05-27", "seed", "valid integer"),
    ],
)
def test_wrong_keys_and_values_are_named_in_full(write, text, key, words):
    path = write(text)
    error = refused(path)
    assert (error.path, error.key) == (str(path), key)
    assert words in error.reason


def test_no_such_file(tmp_path):
    assert "no such file" in refused(tmp_path / "none.toml").message


def test_a_folder_is_no_file(tmp_path):
    assert "cannot be read" in refused(tmp_path).message


@pytest.mark.parametrize("data", [b"seed = ", b"= 1", b"\xff\xfe\x00", b"[a]\n[a]\n"])
def test_not_toml(tmp_path, data):
    path = tmp_path / "c.toml"
    path.write_bytes(data)
    assert "not a TOML file" in refused(path).message


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("a.b=1", 1),
        ("a.b=1.5", 1.5),
        ("a.b = true", True),
        ("a.b=[1, 2.5]", [1, 2.5]),
        ('a.b="1"', "1"),
        ("a.b=hover", "hover"),
        ("a.b=udpin:127.0.0.1:14540", "udpin:127.0.0.1:14540"),
        ("a.b=x=y", "x=y"),
        ("a.b=", ""),
        (" a . b =3", 3),
    ],
)
def test_the_value_of_an_override(override, value):
    assert with_overrides({}, parsed([override])) == {"a": {"b": value}}


def test_overrides_lie_over_the_file_the_last_one_on_top():
    tables = {"a": {"b": 1, "c": 2}, "d": 3}
    assert with_overrides(tables, parsed(["a.b=5", "a.b=6", "e.f.g=7"])) == {
        "a": {"b": 6, "c": 2},
        "d": 3,
        "e": {"f": {"g": 7}},
    }
    assert tables == {"a": {"b": 1, "c": 2}, "d": 3}


@pytest.mark.parametrize("override", ["seed", "=1", "a..b=1", ".a=1", "a.=1", ""])
def test_an_override_that_is_none(override):
    with pytest.raises(ConfigError, match=r"key\.path=value"):
        parse_override(override)


def test_an_override_through_a_value():
    with pytest.raises(ConfigError, match="'seed' is a value, not a table"):
        with_overrides({"seed": 1}, parsed(["seed.x=1"]))


def test_a_wrong_override_is_named_in_full():
    assert refused(default_path(), "law.omega0_rad_s=fast").key == "law.omega0_rad_s"
    assert refused(default_path(), "law.omga0_rad_s=1").key == "law.omga0_rad_s"


def test_the_option_is_blamed_and_not_the_file():
    assert refused(default_path(), "law.omega0_rad_s=fast").path == "--set"
    with pytest.raises(ConfigError) as caught:
        load(default_path(), [Override("mission.duration_s", "-1", "--duration")])
    assert (caught.value.path, caught.value.key) == ("--duration", "")
    assert caught.value.message.startswith("--duration: ")


def test_the_file_is_blamed_for_its_own(write):
    path = write("[guards]\ntilt_deg = 90.0")
    assert refused(path, "seed=2").path == str(path)


def test_an_override_of_a_whole_table_by_a_value():
    assert refused(default_path(), "law=3").key == "law"


def test_read_toml(write):
    assert read_toml(write("[a]\nb = 1")) == {"a": {"b": 1}}


def test_time_limits_of_the_phases():
    flight = Config().flight
    assert [phase.name for phase in Phase if flight.limit_s(phase) == 0.0] == ["FLYING", "DONE"]
    assert flight.limit_s(Phase.ARMING) == flight.arm_s


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"guards.floor_m": "30"}, "guards.floor_m must be below guards.ceiling_m"),
        ({"mission.side_m": "100"}, "mission.side_m puts a corner 141.4 m away, beyond guards.radius_m"),
        ({"guards.tilt_deg": "20"}, "guards.tilt_deg must be greater than law.limits.tilt_max_deg"),
        ({"streams.position_hz": "10", "guards.late_position_s": "0.02"}, "guards.late_position_s is too short"),
        ({"flight.settle_s": "50"}, "flight.settle_s must be shorter than flight.takeoff_s"),
        ({"flight.engage_s": "1.6", "streams.position_hz": "50"}, "flight.engage_s must be more than 2.2 s"),
        (
            {"law.delay_s": "0.3", "streams.position_hz": "250"},
            "law.delay_s times streams.position_hz must be at most 50",
        ),
        ({"airframe.torque_scale_frd_rad_s2": "[0, 113, 13.3]"}, "greater than 0.1"),
        ({"law.polynomial": '"poles"', "law.poles": POLES}, "poles want a depth of their own"),
        ({"law.depth": "rate", "law.polynomial": '"poles"', "law.poles": POLES}, "wants 3 poles, not 4"),
        (
            {"law.depth": "torque", "law.polynomial": '"poles"', "law.poles": POLES.replace("-2", "-1e-9")},
            "-0.05 or less",
        ),
        ({"law.kappa_rad_s": "0.5"}, "omega0_rad_s ({omega0_rad_s:g} at depth torque)"),
        ({"law.depth": "attitude", "law.yaw_kappa_rad_s": "0.5"}, "({yaw_omega0_rad_s:g} at depth attitude)"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, dict) else None,
)
def test_settings_that_contradict_each_other_are_refused_and_the_option_is_named(overrides, words):
    given = [Override(key, text) for key, text in overrides.items()]
    known = defaults("px4", "attitude" if "attitude" in overrides.values() else "torque", "full")
    with pytest.raises(ConfigError) as refused:
        load(default_path(), given)
    assert words.format(**asdict(known)) in str(refused.value)
    assert str(refused.value).startswith("--set")


def test_poles_of_each_depths_own_number_are_taken():
    for depth, count in CHAIN_LENGTHS.items():
        given = {"law.depth": depth, "law.polynomial": "poles", "law.poles": str([[-1.0, 0.0]] * count)}
        law = load(default_path(), [Override(*item) for item in given.items()]).law
        assert len(law.poles) == count
