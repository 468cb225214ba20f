"""`mavquad restore` as a user runs it: real processes, real sockets, real time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

RECORDS = {
    "px4": ("PX4", {"name": "COM_RCL_EXCEPT", "type": "INT32", "original": 5, "changed": 4}),
    "ardupilot": ("ARDUPILOTMEGA", {"name": "GUID_TIMEOUT", "type": "REAL32", "original": 2.5, "changed": 0.3}),
}


def mavquad(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mavquad", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("autopilot", RECORDS)
def test_a_killed_flights_parameters_are_put_back(autopilot, tmp_path):
    name, record = RECORDS[autopilot]
    table = {"system_id": 1, "component_id": 1, "autopilot": name, "parameters": [record], "restored": False}
    (tmp_path / "config.toml").write_text('[link]\nurl = "mock"\n')
    (tmp_path / "parameters.json").write_text(json.dumps(table))
    command = [sys.executable, "-m", "sitl_mock", "--announce", "--endpoint", "udpin:127.0.0.1:0", "--autopilot"]
    mock = subprocess.Popen([*command, autopilot], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert mock.stdout is not None
        url = json.loads(mock.stdout.readline())["url"]
        _is_restored(tmp_path, url, record)
    finally:
        mock.kill()
        mock.communicate()


def _is_restored(run: Path, url: str, record: dict[str, object]) -> None:
    first = mavquad("restore", str(run), "--connect", url, "--json")
    assert first.returncode == 0, first.stderr
    told = json.loads(first.stdout)
    assert told["restored"] is True
    assert told["parameters"][0]["found"] not in (None, record["original"])
    assert json.loads((run / "parameters.json").read_text())["restored"] is True
    again = mavquad("restore", str(run))
    assert (again.returncode, again.stdout) == (0, "nothing to restore: it is restored already\n")
