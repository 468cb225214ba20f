"""`mavquad fly` as a user runs it: real processes, real sockets, real time. The flights run side by side."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from mavquad.protocol.codec import Encoder, mavlink

PATIENT = [
    option
    for age in ("stale_attitude_s", "stale_attitude_at_torque_s", "stale_position_s")
    for option in ("--set", f"guards.{age}=0.8")
] + ["--set", "guards.link_loss.slower_s=0.8"]
"""These tests are not about a busy machine: a loop that stalls for half a second is no reason to fail."""
SHORT = ["--mission", "hover", "--duration", "3"]


@dataclass
class Flight:
    process: subprocess.Popen[str]
    run_dir: Path
    story: str = ""

    def until(self, words: str) -> bool:
        """Read the story on stderr until a line ends with these words."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.story += line
            if line.strip().endswith(words):
                return True
        return False

    def end(self) -> int:
        _, rest = self.process.communicate(timeout=100)
        self.story += rest
        return self.process.returncode

    def summary(self) -> dict[str, object]:
        return json.loads((self.run_dir / "summary.json").read_text())


def mavquad(*arguments: str, cwd: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "mavquad", *arguments],
        cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip


def replay(run_dir: Path) -> dict[str, object]:
    process = mavquad("replay", str(run_dir / "flight.tlog"), "--json", cwd=run_dir)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 0, stderr
    return json.loads(stdout)


@contextlib.contextmanager
def mock_vehicle(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-m", "sitl_mock", "--announce", *arguments]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process, json.loads(process.stdout.readline())["url"]
    finally:
        process.kill()
        process.communicate()


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


# ---------------------------------------------------------------------- the flights


def fly_with_its_own_mock(folder: Path) -> Flight:
    process = mavquad("fly", *PATIENT, *SHORT, "--json", "--run-dir", "run", cwd=folder)
    stdout, stderr = process.communicate(timeout=100)
    assert json.loads(stdout)["run_dir"] == "run"
    return Flight(process, folder / "run", stderr)


def at_depth_rate(folder: Path) -> Flight:
    """A firmware that takes no torque."""
    arguments = ["fly", *PATIENT, *SHORT, "--set", 'mock.firmware="1.16"', "--run-dir", "run"]
    flight = Flight(mavquad(*arguments, cwd=folder), folder / "run")
    flight.end()
    return flight


def under_the_law(folder: Path, *arguments: str) -> Flight:
    """A flight that has just come under the law."""
    flight = Flight(mavquad("fly", *PATIENT, "--run-dir", "run", *arguments, cwd=folder), folder / "run")
    assert flight.until("flying")
    return flight


def interrupted(folder: Path) -> Flight:
    flight = under_the_law(folder)
    flight.process.send_signal(signal.SIGINT)
    flight.end()
    return flight


def interrupted_twice(folder: Path) -> Flight:
    flight = under_the_law(folder)
    flight.process.send_signal(signal.SIGINT)
    assert flight.until("handing back")
    flight.process.send_signal(signal.SIGINT)
    flight.end()
    return flight


def hung_up(folder: Path) -> Flight:
    """The terminal closes: SIGHUP of the kernel, then that of the shell; a Ctrl-Z before."""
    flight = under_the_law(folder)
    flight.process.send_signal(signal.SIGTSTP)
    flight.process.send_signal(signal.SIGHUP)
    assert flight.until("handing back")
    flight.process.send_signal(signal.SIGHUP)
    flight.end()
    return flight


def mock_killed(folder: Path) -> Flight:
    with mock_vehicle("--endpoint", "udpin:127.0.0.1:0") as (mock, url):
        flight = under_the_law(folder, "--connect", url)
        mock.kill()
        flight.end()
    return flight


def under_fire(folder: Path) -> Flight:
    """Listening like a companion computer, while somebody else sends rubbish and forged frames to the same port."""
    port = free_port()
    arguments = ["fly", *PATIENT, *SHORT, "--connect", f"udpin:127.0.0.1:{port}", "--run-dir", "run"]
    flight = Flight(mavquad(*arguments, cwd=folder), folder / "run")
    with mock_vehicle("--endpoint", f"udpout:127.0.0.1:{port}"):
        assert flight.until("identifying")
        forger = Encoder(1, 1)
        standby = mavlink.MAVLink_heartbeat_message(2, 12, 81, 3 << 16, 3, 3)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for rubbish in (b"", b"\xfd", b"\xfd\x09\x00", os.urandom(300), forger.encode(standby), b"\x00" * 1400):
                stranger.sendto(rubbish, ("127.0.0.1", port))
        flight.end()
    return flight


def reader_leaves(folder: Path) -> Flight:
    """As `mavquad fly 2>&1 | head -11`: the reader of the story leaves in flight."""
    command = '"$0" -m mavquad fly --mission hover --duration 3 --run-dir run 2>&1 | head -11; exit ${PIPESTATUS[0]}'
    process = subprocess.Popen(["bash", "-c", command, sys.executable], cwd=folder, stdout=subprocess.PIPE, text=True)
    stdout, _ = process.communicate(timeout=100)
    return Flight(process, folder / "run", stdout)


SCENARIOS: dict[str, Callable[[Path], Flight]] = {
    scenario.__name__: scenario
    for scenario in (
        fly_with_its_own_mock,
        at_depth_rate,
        interrupted,
        interrupted_twice,
        hung_up,
        mock_killed,
        under_fire,
        reader_leaves,
    )
}


@pytest.fixture(scope="module")
def hang_up_matters() -> Iterator[None]:
    """Under nohup SIGHUP is ignored, also by whatever is started: these flights are to hear it."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory, hang_up_matters: None) -> dict[str, Flight]:
    # Three at a time: more would starve each other on two cores.
    with ThreadPoolExecutor(max_workers=3) as pool:
        flown = {name: pool.submit(fly, tmp_path_factory.mktemp(name)) for name, fly in SCENARIOS.items()}
    return {name: future.result() for name, future in flown.items()}


# ---------------------------------------------------------------------- what came of them


def test_a_flight_completes_and_leaves_its_folder(flights: dict[str, Flight]) -> None:
    flight = flights["fly_with_its_own_mock"]
    assert flight.process.returncode == 0, flight.story
    assert flight.story == ""
    files = {path.name for path in flight.run_dir.iterdir()}
    wanted = {"flight.tlog", "config.toml", "summary.json", "trace.csv", "flight.png", "events.jsonl", "notes.jsonl"}
    wanted |= {"parameters.json", "report.html"}
    assert files == wanted
    summary = flight.summary()
    assert summary["completed"] is True
    assert summary["outcome"] == "mission complete"
    assert isinstance(summary["setpoints_sent"], int)
    assert summary["setpoints_sent"] > 300


def test_a_live_flight_replays_bit_for_bit(flights: dict[str, Flight]) -> None:
    result = replay(flights["fly_with_its_own_mock"].run_dir)
    outbound = result["outbound"]
    assert isinstance(outbound, dict)
    assert outbound["matched"] == outbound["recorded"] > 300
    assert outbound["first_mismatch"] is None


def test_a_later_px4_is_flown_by_body_rates(flights: dict[str, Flight]) -> None:
    flight = flights["at_depth_rate"]
    assert flight.process.returncode == 0, flight.story
    assert (flight.summary()["outcome"], flight.summary()["depth"]) == ("mission complete", "rate")
    assert "depth rate, measurements full" in flight.story
    assert replay(flight.run_dir)["outbound"]["first_mismatch"] is None  # type: ignore[index]


def test_ctrl_c_lands_and_replays(flights: dict[str, Flight]) -> None:
    flight = flights["interrupted"]
    assert flight.process.returncode == 130, flight.story
    assert "Disarmed by landing" in flight.story
    assert flight.summary()["outcome"] == "interrupted by the operator and landed"
    assert replay(flight.run_dir)["outbound"]["first_mismatch"] is None  # type: ignore[index]


def test_a_second_ctrl_c_leaves_at_once_and_says_so(flights: dict[str, Flight]) -> None:
    flight = flights["interrupted_twice"]
    assert flight.process.returncode == flight.summary()["exit_code"] == 4, flight.story
    assert "is on its own now" in flight.story
    assert "Disarmed" not in flight.story
    assert flight.summary()["outcome"] == "left before the landing"
    assert replay(flight.run_dir)["outbound"]["first_mismatch"] is None  # type: ignore[index]


def test_a_closed_terminal_lands(flights: dict[str, Flight]) -> None:
    flight = flights["hung_up"]
    assert flight.process.returncode == 130, flight.story
    assert "Disarmed by landing" in flight.story
    assert flight.summary()["outcome"] == "interrupted by the operator and landed"


def test_a_vehicle_that_dies_in_flight(flights: dict[str, Flight]) -> None:
    flight = flights["mock_killed"]
    assert flight.process.returncode == 4, flight.story
    assert "Traceback" not in flight.story
    assert flight.summary()["completed"] is False
    assert replay(flight.run_dir)["outbound"]["first_mismatch"] is None  # type: ignore[index]


def test_strangers_on_the_port_are_ignored(flights: dict[str, Flight]) -> None:
    flight = flights["under_fire"]
    assert flight.process.returncode == 0, flight.story


def test_a_reader_that_leaves_does_not_end_a_flight(flights: dict[str, Flight]) -> None:
    flight = flights["reader_leaves"]
    assert flight.story.count("\n") == 11
    assert flight.process.returncode == 0, flight.story
    assert flight.summary()["outcome"] == "mission complete"
    assert "Disarmed by landing" in (flight.run_dir / "notes.jsonl").read_text()


@pytest.mark.parametrize("where", ["| true", "2>&1 | true", "--json | true", "> /dev/full 2>&1", "2>&-", ">&- 2>&-"])
def test_a_flight_that_nobody_sees_keeps_its_exit_code(tmp_path: Path, where: str) -> None:
    command = f'"$0" -m mavquad sim --set guards.ceiling_m=2 {where}; exit ${{PIPESTATUS[0]}}'
    process = subprocess.run(["bash", "-c", command, sys.executable], cwd=tmp_path, timeout=60)
    assert process.returncode == 4


def test_nobody_there(tmp_path: Path) -> None:
    url = f"udpout:127.0.0.1:{free_port()}"
    process = mavquad("fly", "--connect", url, "--set", "flight.connect_s=1", cwd=tmp_path)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 3
    assert "no answer: HEARTBEAT of an autopilot" in stderr
    assert "hint:" in stderr


def test_port_in_use(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"udpin:127.0.0.1:{taken.getsockname()[1]}"
        process = mavquad("fly", "--connect", url, cwd=tmp_path)
        _, stderr = process.communicate(timeout=30)
    assert process.returncode == 2
    assert "address already in use" in stderr
    assert "another program has this port" in stderr
    assert not list(tmp_path.glob("runs/*"))
