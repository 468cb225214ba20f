"""`mavquad restore` as a user needs it: the flight is killed, the vehicle keeps what it changed, and gets its own back."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

AUTOPILOTS = ("px4", "ardupilot")


def process(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip


def killed_and_restored(autopilot: str, run: Path) -> tuple[dict[str, object], ...]:
    """What the flight left behind, what restore told, and what is left then; the mock is not ready to arm for long."""
    mock = process(
        "sitl_mock", "--announce", "--answer-all", "--ready", "90", "--autopilot", autopilot,
        "--endpoint", "udpin:127.0.0.1:0",
    )  # fmt: skip
    try:
        assert mock.stdout is not None
        url = json.loads(mock.stdout.readline())["url"]
        flight = process("mavquad", "fly", "--connect", url, "--run-dir", str(run))
        assert flight.stderr is not None
        assert any(line.rstrip().endswith(" waiting") for line in flight.stderr)
        flight.kill()
        flight.communicate()
        left = json.loads((run / "parameters.json").read_text())
        restore = process("mavquad", "restore", str(run), "--json")
        told, complaints = restore.communicate(timeout=60)
        assert restore.returncode == 0, complaints
        return left, json.loads(told), json.loads((run / "parameters.json").read_text())
    finally:
        mock.kill()
        mock.communicate()


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """Both side by side."""
    runs = [tmp_path_factory.mktemp(autopilot) / "run" for autopilot in AUTOPILOTS]
    with ThreadPoolExecutor() as pool:
        return dict(zip(AUTOPILOTS, pool.map(killed_and_restored, AUTOPILOTS, runs), strict=True))


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_killed_flights_parameters_are_put_back(outcomes, autopilot):
    left, told, restored = outcomes[autopilot]
    names = {record["name"] for record in left["parameters"]}
    assert ("GUID_TIMEOUT" if autopilot == "ardupilot" else "COM_OF_LOSS_T") in names
    assert left["restored"] is False
    assert told["restored"] is True
    # The flight did change them, and did so after it had written down what they were.
    assert [each["found"] for each in told["parameters"]] == [each["changed"] for each in left["parameters"]]
    assert restored == {**left, "restored": True}
