"""Parameters put back on the mock in lockstep: both personalities, over links that lose, delay, repeat and reorder."""

from __future__ import annotations

import struct

import pytest

from mavquad.drivers.lockstep import START_US, Lockstep
from mavquad.protocol.link import LinkParams
from mavquad.protocol.param_record import ChangedParameters
from mavquad.protocol.restore import Restorer
from mavquad.protocol.signing import key_of_passphrase
from mavquad.schema import parse_section
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink
from tests.support import Recording

BAD = {"latency_ms": 20, "jitter_ms": 50, "loss": 0.2}
MIXED_UP = [{"kind": "duplicate", "probability": 0.2}, {"kind": "reorder", "probability": 0.2}]
RECORDS = {
    "px4": [("COM_RCL_EXCEPT", "INT32", -3, 4), ("COM_OF_LOSS_T", "REAL32", 0.7, 0.3), ("NAV_RCL_ACT", "INT32", 2, 3)],
    "ardupilot": [
        ("GUID_OPTIONS", "INT32", 64, 8),
        ("GUID_TIMEOUT", "REAL32", 2.5, 0.3),
        ("ATC_ANGLE_BOOST", "INT8", 0, 1),
        ("FS_GCS_ENABLE", "INT8", 0, 1),
    ],
}
NAMES = {"px4": "PX4", "ardupilot": "ARDUPILOTMEGA"}


def record(autopilot, **changes):
    """A record of what a run changed; the originals are what some owner had set, not the mock's own values."""
    rows = [dict(zip(("name", "type", "original", "changed"), row, strict=True)) for row in RECORDS[autopilot]]
    table = {"system_id": 1, "component_id": 1, "autopilot": NAMES[autopilot], "parameters": rows, **changes}
    return parse_section(ChangedParameters, table, "test")


def restored(
    autopilot, firmware="auto", link=None, faults=(), seed=1, changed=None, key=None, recorder=None, **mock_keys
):
    """Run a restorer against a mock until it is done; (restorer, the mock's parameters, seconds)."""
    table = {"autopilot": autopilot, "firmware": firmware, "link": link or {}, "faults": list(faults)}
    config = parse_section(MockConfig, {**table, **mock_keys}, "test", "mock")
    mock = MockAutopilot(config, seed, START_US)
    params = LinkParams(url="udpin:127.0.0.1:14540")
    restorer = Restorer(changed or record(autopilot), params, START_US, key)
    lockstep = Lockstep(restorer, ImpairedLink(mock, config.link, seed), recorder)
    lockstep.run(lambda: restorer.done, 60.0)
    assert restorer.done
    return restorer, mock._personality.stored_parameters, (lockstep.now_us - START_US) * 1e-6


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


@pytest.mark.parametrize(
    ("autopilot", "firmware"), [("px4", "1.13"), ("px4", "1.15"), ("px4", "1.16"), ("ardupilot", "4.7")]
)
def test_every_personality_gets_its_values_back(autopilot, firmware):
    restorer, stored, _ = restored(autopilot, firmware)
    assert restorer.error is None
    for name, _, original, _ in RECORDS[autopilot]:
        assert stored[name] == single(original)
    assert not restorer.armed


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("seed", range(10))
def test_over_a_bad_link(autopilot, seed):
    restorer, stored, _ = restored(autopilot, link=BAD, faults=MIXED_UP, seed=seed)
    assert restorer.error is None
    assert [stored[name] for name, _, _, _ in RECORDS[autopilot]] == [single(row[2]) for row in RECORDS[autopilot]]


def test_the_same_bytes_each_time():
    def sent():
        recording = Recording()
        restored("ardupilot", link=BAD, faults=MIXED_UP, recorder=recording)
        return recording.records

    assert sent() == sent() != []


def test_another_system_is_left_alone():
    restorer, stored, seconds = restored("px4", system_id=7)
    assert restorer.error.message == "the run was flown on PX4 1/1, and what is heard there is PX4 7/1"
    assert restorer.error.exit_code == 2
    assert stored["COM_OF_LOSS_T"] == 1.0
    assert seconds == pytest.approx(10.0, abs=0.01)


def test_another_autopilot_of_the_same_id_is_left_alone():
    restorer, stored, _ = restored("ardupilot", changed=record("px4"))
    assert "flown on PX4 1/1, and what is heard there is ARDUPILOTMEGA 1/1" in restorer.error.message
    assert stored["GUID_TIMEOUT"] == 3.0


def test_nobody_there():
    restorer, _, _ = restored("px4", link={"loss": 1.0})
    assert restorer.error.message.startswith("no answer: HEARTBEAT of system 1 (waited 10.0 s)")
    assert restorer.error.exit_code == 3


def test_what_the_vehicle_no_longer_knows_is_told_and_the_rest_is_put_back():
    rows = [
        {"name": "COM_OLD_NAME", "type": "INT32", "original": 1, "changed": 2},
        {"name": "COM_OF_LOSS_T", "type": "REAL32", "original": 0.5, "changed": 2.0},
    ]
    restorer, stored, _ = restored("px4", changed=record("px4", parameters=rows))
    assert restorer.error.message.startswith("not restored: COM_OLD_NAME: not answered in 6 s")
    assert restorer.error.exit_code == 3
    assert stored["COM_OF_LOSS_T"] == 0.5


def test_a_value_that_is_no_longer_accepted():
    rows = [{"name": "ATC_ANGLE_BOOST", "type": "INT16", "original": 300, "changed": 0}]
    restorer, stored, _ = restored("ardupilot", changed=record("ardupilot", parameters=rows))
    assert restorer.error.message == "not restored: ATC_ANGLE_BOOST: 300 does not fit into INT8"
    assert stored["ATC_ANGLE_BOOST"] == 1


SIGNED = {"mode": "require", "passphrase": "a flight of ours"}


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_over_a_signed_link(autopilot):
    restorer, stored, _ = restored(autopilot, signing=SIGNED, key=key_of_passphrase("a flight of ours"))
    assert restorer.error is None
    name, _, original, _ = RECORDS[autopilot][1]
    assert stored[name] == single(original)


def test_with_the_wrong_key_nothing_is_believed():
    restorer, stored, _ = restored("px4", signing=SIGNED, key=key_of_passphrase("of somebody else"))
    assert "frames came that are not rightly signed" in restorer.error.message
    assert restorer.error.hint == "is the key the vehicle's?"
    assert stored["COM_OF_LOSS_T"] == 1.0
