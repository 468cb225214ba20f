"""Fault files: what a good one gives, and what is said about a typo: the file, the entry, the key, what is allowed."""

import pytest

from mavquad.errors import ConfigError
from mavquad.schema import parse_section
from sitl_mock.config import MockConfig
from sitl_mock.config.faults import Drop, ModeChange, Refuse, load_faults, mode_names


@pytest.fixture
def load(tmp_path):
    def loaded(text, autopilot=None):
        path = tmp_path / "storm.toml"
        path.write_text(text)
        return load_faults(path, autopilot)

    return loaded


def entry(**keys):
    return "\n".join(["[[fault]]", *(f"{key} = {value!r}" for key, value in keys.items())]) + "\n"


def test_a_file_of_faults(load):
    faults = load(
        entry(kind="drop", message="ATTITUDE", probability=0.5, since="offboard", from_s=2, for_s=3.5)
        + entry(kind="refuse", command="MAV_CMD_NAV_TAKEOFF", result="TEMPORARILY_REJECTED", times=1)
        + entry(kind="refuse", command="component_arm_disarm", result=4)
        + entry(kind="mode_change", mode="LOITER", since="GUIDED", at_s=1.0),
        "ardupilot",
    )
    assert faults == (
        Drop(kind="drop", message="ATTITUDE", probability=0.5, since="offboard", from_s=2.0, for_s=3.5),
        Refuse(kind="refuse", command=22, result=1, times=1),
        Refuse(kind="refuse", command=400, result=4),
        ModeChange(kind="mode_change", mode="LOITER", since="GUIDED", at_s=1.0),
    )


GOOD = entry(kind="silent")


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        (GOOD + entry(kind="dorp"), "fault 2", "unknown kind 'dorp'; did you mean drop? allowed here: drop, delay,"),
        (entry(from_s=1.0), "fault 1", "no kind; allowed here: drop, delay,"),
        (GOOD + entry(kind="refuse", comand=22), "fault 2 (refuse): comand", "did you mean command? allowed here: com"),
        (entry(kind="refuse"), "fault 1 (refuse): command", "is required"),
        (entry(kind="refuse", command="NAV_TAKOFF"), "fault 1 (refuse): command", "did you mean MAV_CMD_NAV_TAKEOFF?"),
        (
            entry(kind="refuse", command=70000),
            "fault 1 (refuse): command",
            "less than or equal to 65535 (given: 70000)",
        ),
        (entry(kind="refuse", command=22, result="NO"), "fault 1 (refuse): result", "no MAV_RESULT has that name"),
        (entry(kind="drop", message="HARTBEAT"), "fault 1 (drop): message", "did you mean HEARTBEAT?"),
        (entry(kind="drop", direction="up"), "fault 1 (drop): direction", "'to_vehicle', 'from_vehicle' or 'both'"),
        (entry(kind="drop", probability=1.1), "fault 1 (drop): probability", "(given: 1.1)"),
        (entry(kind="silent", for_s=0), "fault 1 (silent): for_s", "greater than 0"),
        ("[[fault]]\nkind = 'silent'\nfor_s = nan", "fault 1 (silent): for_s", "finite"),
        (entry(kind="weak_rotor", rotor=5), "fault 1 (weak_rotor): rotor", "less than or equal to 4"),
        (entry(kind="estimator_reset", offset_ned_m=[1.0]), "fault 1 (estimator_reset): offset_ned_m.1", "required"),
        (entry(kind="stream_stops", message=""), "fault 1 (stream_stops): message", "at least 1"),
        (entry(kind="mode_change", mode="LOITRE"), "fault 1 (mode_change): mode", "did you mean LOITER?"),
        (entry(kind="silent", since="offbord"), "fault 1 (silent): since", "did you mean offboard?"),
        ("[[faults]]\nkind = 'silent'", "faults", "unknown key; did you mean fault?"),
        ("[fault]\nkind = 'silent'", "fault", "array"),
        ("", "fault", "required"),
        ("[[fault]", "", "not a TOML file"),
    ],
    ids=str,
)
def test_a_typo_is_named(load, tmp_path, text, key, words):
    with pytest.raises(ConfigError) as caught:
        load(text)
    assert (caught.value.path, caught.value.key) == (str(tmp_path / "storm.toml"), key)
    assert words in caught.value.reason


def test_no_such_file(tmp_path):
    with pytest.raises(ConfigError, match="no such file"):
        load_faults(tmp_path / "none.toml")


@pytest.mark.parametrize(("autopilot", "mode"), [("px4", "GUIDED"), ("ardupilot", "AUTO.LOITER")])
def test_another_autopilots_modes_are_refused(load, autopilot, mode):
    for text in (entry(kind="mode_change", mode=mode), entry(kind="deaf", since=mode)):
        assert load(text)
        with pytest.raises(ConfigError, match=f"no such mode of {autopilot}: '{mode}'"):
            load(text, autopilot)


@pytest.mark.parametrize(("autopilot", "mode"), [("px4", "GUIDED"), ("ardupilot", "AUTO.LOITER")])
def test_a_configuration_refuses_them_too(autopilot, mode):
    table = {"autopilot": autopilot, "faults": [{"kind": "die"}, {"kind": "mode_change", "mode": mode}]}
    with pytest.raises(ConfigError, match=f"faults.1.mode_change.mode: no such mode of {autopilot}: '{mode}'"):
        parse_section(MockConfig, table, "mock.toml", "mock")


def test_every_mode_of_an_autopilot_can_be_named():
    for autopilot in ("px4", "ardupilot"):
        faults = [{"kind": "mode_change", "mode": mode, "since": mode} for mode in mode_names(autopilot)]
        assert len(parse_section(MockConfig, {"autopilot": autopilot, "faults": faults}, "x").faults) == len(faults) > 5


@pytest.mark.parametrize(
    ("text", "words"),
    [("a = " + "[" * 5000 + "]" * 5000, "nested too deeply"), ("a = 1" + "0" * 5000, "4300 digits")],
    ids=["depth", "digits"],
)
def test_what_no_parser_bears_is_no_toml_file(load, text, words):
    with pytest.raises(ConfigError, match=f"not a TOML file: .*{words}"):
        load(text)
