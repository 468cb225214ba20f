"""`mavquad replay --play` as a user runs it: a process, a real socket, keys of a real terminal."""

import contextlib
import json
import os
import pty
import socket
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest

from mavquad.protocol.codec import Encoder, mavlink
from mavquad.tlog import pack_record

T0_US = 1_700_000_000_000_000
COUNT = 40
LIMIT_S = 60


def frames() -> list[bytes]:
    """Half a second apart; the recorder's own sequence numbers."""
    encoder = Encoder(1, 1)
    encoder.sequence = 250
    return [encoder.encode(mavlink.MAVLink_system_time_message(number, number)) for number in range(COUNT)]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Twenty seconds, and between them what the recorder sent itself."""
    own = Encoder(255, 190).encode(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    records = [
        pack_record(T0_US + number * 500_000, frame, outbound=False) + pack_record(T0_US + number * 500_000, own, True)
        for number, frame in enumerate(frames())
    ]
    path = tmp_path / "flight of somebody.tlog"
    path.write_bytes(b"".join(records))
    return path


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        opened.settimeout(LIMIT_S)
        yield opened


def player(log: Path, listener: socket.socket, *options: str, stdin: int = subprocess.PIPE) -> subprocess.Popen[bytes]:
    url = f"udpout:127.0.0.1:{listener.getsockname()[1]}"
    command = [sys.executable, "-m", "mavquad", "replay", str(log), "--play", url, "--json", *options]
    return subprocess.Popen(command, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=log.parent)


def ended(process: subprocess.Popen[bytes], typed: bytes | None = None) -> dict[str, object]:
    out, err = process.communicate(typed, timeout=LIMIT_S)
    assert process.returncode == 0, err
    return json.loads(out)


def received(listener: socket.socket) -> list[bytes]:
    """What has arrived."""
    listener.setblocking(False)
    datagrams = []
    with contextlib.suppress(BlockingIOError):
        while True:
            datagrams.append(listener.recv(2048))
    return datagrams


def test_the_vehicles_frames_arrive_as_recorded(log, listener):
    summary = ended(player(log, listener, "--speed", "200"))
    assert received(listener) == frames()
    assert (summary["frames"], summary["rounds"], summary["log_s"]) == (COUNT, 1, 19.5)
    assert summary["bytes"] == sum(map(len, frames()))


def test_lines_on_stdin(log, listener):
    process = player(log, listener, "--speed", "0.01")
    assert listener.recv(2048) == frames()[0]
    summary = ended(process, b"pause\nseek 10\nspeed 1000\nwhat\nplay")
    assert received(listener) == frames()[20:]
    assert summary["frames"] == COUNT - 20 + 1


def test_keys_of_a_terminal_and_the_loop(log, listener):
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    process = player(log, listener, "--speed", "1000", "--loop", stdin=slave)
    for _ in range(COUNT + 1):
        last = listener.recv(2048)
    assert last == frames()[0]  # again
    os.write(master, b" \x1b[A\x1b[C?q")
    assert ended(process)["rounds"] >= 1
    assert termios.tcgetattr(slave) == before
    os.close(master), os.close(slave)


def test_nobody_listens(log):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        process = player(log, taken, "--speed", "1000", stdin=subprocess.DEVNULL)
    assert ended(process)["frames"] == COUNT
