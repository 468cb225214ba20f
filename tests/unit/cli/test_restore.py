"""`mavquad restore` from the outside: what it refuses, what it has nothing to do for, whom it takes for the vehicle."""

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from mavquad.drivers.parameters_file import NAME, mark_restored, read_parameters, write_parameters
from mavquad.errors import RunFolderError
from mavquad.protocol.codec import Encoder, decode, mavlink
from mavquad.protocol.link import LinkParams
from mavquad.protocol.param_record import ChangedParameters, ParamRecord
from mavquad.protocol.restore import Restorer

TIMEOUT = ParamRecord(name="GUID_TIMEOUT", type="REAL32", original=3.0, changed=0.25)
CHANGED = ChangedParameters(system_id=1, component_id=1, autopilot="ARDUPILOTMEGA", parameters=(TIMEOUT,))
START_US = 1_600_000_000_000_000


@pytest.fixture
def columns() -> str:
    """Messages are looked for in one piece."""
    return "200"


@dataclass
class Folder:
    """What a flight writes into."""

    path: Path

    def write_whole(self, name: str, text: str) -> None:
        (self.path / name).write_text(text)


def keep(path: Path, records: tuple[ParamRecord, ...] = (TIMEOUT,)) -> None:
    changed = ChangedParameters(system_id=1, component_id=1, autopilot="ARDUPILOTMEGA", parameters=records)
    write_parameters(Folder(path), changed)


@pytest.fixture
def run(tmp_path) -> Path:
    """A run folder as a flight that was killed leaves it."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "config.toml").write_text('[link]\nurl = "udpin:127.0.0.1:0"\n')
    keep(folder)
    return folder


# ---------------------------------------------------------------------- the file


def test_what_is_written_is_read_again(run):
    assert read_parameters(run) == CHANGED
    table = json.loads((run / NAME).read_text())
    assert table["parameters"] == [{"name": "GUID_TIMEOUT", "type": "REAL32", "original": 3.0, "changed": 0.25}]
    assert table["restored"] is False


def test_integers_stay_integers(run):
    record = ParamRecord(name="GUID_OPTIONS", type="INT32", original=2**24 - 1, changed=8)
    keep(run, (record,))
    kept = read_parameters(run).parameters[0]
    assert (kept.original, type(kept.original)) == (16777215, int)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is damaged (it is no JSON)"),
        ("[" * 100_000, "is damaged (it is no JSON)"),
        ("[1]", "is damaged"),
        ("{}", "is damaged (system_id: is required)"),
        ('{"system_id": 1, "component_id": 1, "autopilot": "PX4", "parameters": [{"name": "X"}]}', "is required)"),
        ('{"system_id": 0, "component_id": 1, "autopilot": "PX4", "parameters": []}', "system_id: Input should be"),
    ],
)
def test_a_damaged_file_is_told(cli, run, text, words):
    (run / NAME).write_text(text)
    code, out, err = cli("restore", str(run))
    assert (code, out) == (2, "")
    assert words in err
    assert "set the parameters with a ground station" in err


def test_cut_at_any_place_it_is_damaged_and_never_half_read(run):
    text = (run / NAME).read_text()
    for length in range(len(text.rstrip())):
        (run / NAME).write_text(text[:length])
        with pytest.raises(RunFolderError, match="is damaged"):
            read_parameters(run)


def test_a_name_twice_is_damage(run):
    table = CHANGED.model_dump(mode="json")
    (run / NAME).write_text(json.dumps({**table, "parameters": table["parameters"] * 2}))
    with pytest.raises(RunFolderError, match="a parameter is listed twice"):
        read_parameters(run)


def test_no_number_is_no_value(run):
    (run / NAME).write_text(CHANGED.model_dump_json().replace("3.0", "NaN"))
    with pytest.raises(RunFolderError, match="is damaged"):
        read_parameters(run)


# ---------------------------------------------------------------------- the command


def test_a_folder_that_is_no_run(cli, tmp_path):
    code, _, err = cli("restore", str(tmp_path))
    assert code == 2
    assert "is no run folder" in err
    assert cli("restore", "missing")[0] == 2


@pytest.mark.parametrize("kept", ["nothing", "empty", "restored"])
def test_nothing_to_restore(cli, run, kept):
    if kept == "nothing":
        (run / NAME).unlink()
    elif kept == "empty":
        keep(run, ())
    else:
        mark_restored(run, CHANGED)
    code, out, err = cli("restore", str(run))
    assert (code, err) == (0, "")
    assert out.startswith("nothing to restore: ")
    assert ("restored already" in out) is (kept == "restored")
    assert json.loads(cli("restore", str(run), "--json")[1]) == {"restored": True, "parameters": []}


def test_a_wrong_connection_is_told_by_its_option(cli, run):
    code, _, err = cli("restore", str(run), "--connect", "udpin:nowhere")
    assert code == 2
    assert "udpin:nowhere: " in err


def test_a_run_in_simulation_has_no_vehicle_to_go_back_to(cli, run):
    (run / "config.toml").write_text('[link]\nurl = "mock"\n')
    code, _, err = cli("restore", str(run))
    assert code == 2
    assert "its vehicle was a mock of its own" in err


# ---------------------------------------------------------------------- whom it takes for the vehicle


def heartbeat(armed: bool = False, component: int = 1, sequence: int = 0) -> bytes:
    mode = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
    message = mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, 4, 4, 3)
    encoder = Encoder(1, component)
    encoder.sequence = sequence
    return encoder.encode(message)


def restorer(**options: bool) -> Restorer:
    return Restorer(CHANGED, LinkParams(url="udpin:127.0.0.1:14550"), START_US, **options)


def sent(endpoint: Restorer) -> list[str]:
    return [decode(data).get_type() for data in endpoint.datagrams_to_send()]


def test_an_armed_vehicle_is_left_alone():
    endpoint = restorer()
    endpoint.receive(heartbeat(armed=True), START_US + 4)
    assert endpoint.error is not None
    assert endpoint.error.exit_code == 3
    assert "armed" in endpoint.error.message
    assert "--force" in endpoint.error.hint
    assert sent(endpoint) == ["HEARTBEAT"]


def test_an_armed_vehicle_is_not_spared_where_one_insists():
    endpoint = restorer(armed_too=True)
    endpoint.receive(heartbeat(armed=True), START_US + 4)
    assert endpoint.error is None
    assert endpoint.armed
    assert sent(endpoint) == ["HEARTBEAT", "PARAM_REQUEST_READ"]


def test_another_component_of_the_same_system_is_left_alone():
    endpoint = restorer()
    endpoint.receive(heartbeat(component=2), START_US + 4)
    assert endpoint.error is not None
    assert endpoint.error.message == (
        "the run was flown on ARDUPILOTMEGA 1/1, and what is heard there is ARDUPILOTMEGA 1/2"
    )


def test_one_that_is_armed_meanwhile_is_left_alone_from_then_on():
    endpoint = restorer()
    endpoint.receive(heartbeat(), START_US + 4)
    assert endpoint.error is None
    endpoint.receive(heartbeat(armed=True, sequence=1), START_US + 8)
    assert endpoint.done
    assert endpoint.error is not None


def test_a_listener_is_silent_until_it_hears_somebody_and_a_caller_speaks_first():
    assert restorer().next_deadline_us() == START_US + 10_000_000
    caller = Restorer(CHANGED, LinkParams(url="udpout:127.0.0.1:14580"), START_US)
    assert caller.next_deadline_us() == START_US
    caller.on_deadline(START_US)
    assert sent(caller) == ["HEARTBEAT"]
