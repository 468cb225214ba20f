"""`sitl-mock` as a user runs it: a process, its words and exit codes, its sockets."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from mavquad.protocol.codec import Encoder, Framer, frame_source, mavlink

LIMIT_S = 60
UDP = ["--endpoint", "udpin:127.0.0.1:0"]
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts `python -m sitl_mock` with options; it is gone when the test is over."""
    processes = []

    def run(*options: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "sitl_mock", *options]
        pipe = subprocess.PIPE
        processes.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True))
        return processes[-1]

    yield run
    for process in processes:
        process.kill()
        process.communicate()


def announced(process: subprocess.Popen[str]) -> dict[str, object]:
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line, process.communicate()
    return json.loads(line)


def heard_from(url: str) -> int:
    """The system id of what answers there."""
    transport, host, port = url.split(":")
    kind = {"udpout": socket.SOCK_DGRAM, "tcp": socket.SOCK_STREAM}[transport]
    with socket.socket(socket.AF_INET, kind) as client:
        client.settimeout(LIMIT_S)
        client.connect((host, int(port)))
        client.send(Encoder(255, 190).encode(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
        framer, frames = Framer(), []
        while not frames:
            frames = framer.push(client.recv(65535))
        return frame_source(frames[0])[0]


def test_it_announces_every_link_and_ends_with_its_input(start: Start) -> None:
    process = start("--announce", "--vehicles", "2", "--system-id", "7", *UDP, "--endpoint", "tcpin:127.0.0.1:0")
    said = announced(process)
    vehicles = said["vehicles"]
    assert isinstance(vehicles, list)
    assert [vehicle["system_id"] for vehicle in vehicles] == [7, 8]
    assert said["url"] == vehicles[0]["urls"][0]
    assert [heard_from(url) for vehicle in vehicles for url in vehicle["urls"]] == [7, 7, 8, 8]
    out, err = process.communicate(timeout=LIMIT_S)
    assert (process.returncode, out) == (0, "")
    words = err.splitlines()
    assert words[0] == "mock PX4 1.13, system 7"
    assert words[1].split() == [
        "udp",
        vehicles[0]["urls"][0].removeprefix("udpout:"),
        "listens",
        "companion",
        said["url"],
    ]
    assert words[3] == "mock PX4 1.13, system 8"
    assert words[6] == "Ctrl-C ends it"
    assert re.match(r"system 7: 0 flights; [12] frames in, \d+ out$", words[7])
    assert "simulated, late by" in words[9]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it(start: Start, number: signal.Signals) -> None:
    process = start("--autopilot", "ardupilot", "--speed", "2", "--endpoint", "tcpin:127.0.0.1:0:wait", "--announce")
    assert process.stderr is not None
    announced(process)
    words = [process.stderr.readline() for _ in range(3)]
    assert words[0] == "mock ArduCopter 4.7, system 1\n"
    assert "boots when a client comes" in words[1]
    assert words[2] == "2 times real time; Ctrl-C ends it\n"
    process.send_signal(number)
    _, err = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0
    assert "system 1: 0 flights; 0 frames in, 0 out" in err


def test_a_port_in_use_is_a_message_and_exit_code_2(start: Start) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        url = f"tcpin:127.0.0.1:{other.getsockname()[1]}"
        process = start("--endpoint", url)
        out, err = process.communicate(timeout=LIMIT_S)
    assert (process.returncode, out) == (2, "")
    assert err.splitlines() == [
        f"error: {url}: cannot be opened (address already in use)",
        "       another program has this port, maybe a simulator: stop it, or choose --instance or --endpoint",
    ]


def test_it_goes_on_when_nobody_reads_what_it_says(start: Start) -> None:
    reading, writing = os.pipe()
    command = [sys.executable, "-m", "sitl_mock", "--announce", *UDP]
    os.close(reading)
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=writing, text=True)
    os.close(writing)
    try:
        assert heard_from(str(announced(process)["url"])) == 1
        process.communicate(timeout=LIMIT_S)
        assert process.returncode == 0
    finally:
        process.kill()
        process.communicate()
