"""`mavquad check` as a user runs it, over TCP, a serial port and UDP, side by side."""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from mavquad.protocol.signing import key_of_passphrase

SHORT = ["--duration", "1.0"]


def check(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "mavquad", "check", *SHORT, *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip


@contextlib.contextmanager
def mock_vehicle(*arguments: str) -> Iterator[str]:
    command = [sys.executable, "-m", "sitl_mock", "--announce", *arguments]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["url"]
    finally:
        process.kill()
        process.communicate()


@contextlib.contextmanager
def serial_bridge(url: str) -> Iterator[str]:
    """A pseudo-terminal behind which the vehicle of a udpout: connection string is."""
    host, port = url.removeprefix("udpout:").split(":")
    master, slave = os.openpty()
    tty.setraw(master)
    os.set_blocking(master, False)
    ended = threading.Event()

    def carry() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
            wire.connect((host, int(port)))
            while not ended.is_set():
                ready, _, _ = select.select([master, wire], [], [], 0.1)
                with contextlib.suppress(BlockingIOError):  # nobody reads it now
                    if master in ready:
                        wire.send(os.read(master, 280))
                    if wire in ready:
                        os.write(master, wire.recv(2000))

    thread = threading.Thread(target=carry)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        ended.set()
        thread.join()
        os.close(slave)
        os.close(master)


@pytest.fixture(scope="module")
def key(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("keys") / "signing.key"
    path.touch(mode=0o600)
    path.write_text(key_of_passphrase("a secret").hex())
    return path


@pytest.fixture(scope="module")
def results(key: Path) -> Iterator[dict[str, tuple[int, str, str]]]:
    pytest.importorskip("serialx", reason="serial ports need the extra 'serial'")
    udp = ["--endpoint", "udpin:127.0.0.1:0"]
    with (
        mock_vehicle("--autopilot", "ardupilot", "--endpoint", "tcpin:127.0.0.1:0") as tcp,
        mock_vehicle(*udp) as behind_a_bridge,
        serial_bridge(behind_a_bridge) as device,
        mock_vehicle(*udp) as other,
        mock_vehicle(*udp) as unsigned,
    ):
        processes = {
            "tcp": check(tcp, "--json"),
            "serial": check(f"serial://{device}:921600"),
            "other system": check(other, "--system", "7"),
            "unsigned": check(unsigned, "--key", str(key)),
        }
        told = {name: (*process.communicate(timeout=100), process.returncode) for name, process in processes.items()}
    return {name: (code, stdout, stderr) for name, (stdout, stderr, code) in told.items()}


def test_an_arducopter_over_tcp(results) -> None:
    code, stdout, stderr = results["tcp"]
    assert stderr == ""
    summary = json.loads(stdout)
    assert summary["autopilot"] == "ARDUPILOTMEGA"
    assert summary["streams"]["ATTITUDE"]["count"] > 50
    assert summary["clock"]["round_trips"]["count"] > 5
    assert summary["not_restored"] == []
    assert [(p["system_id"], p["component"]) for p in summary["participants"]] == [(1, "AUTOPILOT1")]
    assert code == (0 if summary["ready"] else 3)


def test_a_px4_over_a_serial_port_as_a_table_for_people(results) -> None:
    code, stdout, _ = results["serial"]
    for words in (
        "AUTOPILOT1",
        "hover thrust",
        "depth torque",
        "round trip",
        "drifts",
        "LOCAL_POSITION_NED",
        "ready to arm",
    ):
        assert words in stdout
    assert code in (0, 3)


def test_another_system_than_the_wanted_one_is_named(results) -> None:
    code, stdout, stderr = results["other system"]
    assert (code, stdout) == (3, "")
    assert "no answer: the HEARTBEAT of an autopilot" in stderr
    assert "heard were 1/1 QUADROTOR" in stderr


def test_a_vehicle_that_does_not_sign_is_not_taken_with_a_key(results) -> None:
    code, _, stderr = results["unsigned"]
    assert code == 3
    assert "not rightly signed" in stderr
