"""Other people's software against the mock, over loopback sockets: both are processes of their own.

The client is a script in `clients/`, written as its library's documentation writes it. It gets the address as its
argument and prints what it saw as one line of JSON, the last of its output.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

CLIENTS = Path(__file__).parent / "clients"
PATIENCE_S = 150
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_INSTANCES = sorted(range(1, 10), key=lambda number: (number - 1 - 3 * _WORKER) % 9)
"""PX4's further ones all speak to the same port. Each of several workers begins with one of its own."""


@contextlib.contextmanager
def ended_with(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """A process that is gone, with all that it started, when the block ends."""
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, **options,
    )  # fmt: skip
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


@pytest.fixture
def mock() -> Iterator[Callable[..., list[str]]]:
    """Starts `sitl-mock` with options; returns the URLs for clients. It ends with the test."""
    with contextlib.ExitStack() as stack:

        def start(*options: str) -> list[str]:
            command = [sys.executable, "-m", "sitl_mock", "--announce", *options]
            process = stack.enter_context(ended_with(command))
            assert process.stdout is not None and process.stderr is not None
            line = process.stdout.readline()
            assert line, process.stderr.read()
            return list(json.loads(line)["vehicles"][0]["urls"])

        yield start


@pytest.fixture
def instance() -> int:
    """The number of a simulator whose usual ports are free."""
    return next(number for number in _INSTANCES if _is_free(number))


def _is_free(number: int) -> bool:
    udp = [14540 + number, 14580 + number, 18570 + number]
    tcp = [5760 + 10 * number + offset for offset in (0, 2, 3)]
    kinds = [(port, socket.SOCK_DGRAM) for port in udp] + [(port, socket.SOCK_STREAM) for port in tcp]
    with contextlib.ExitStack() as stack:
        try:
            for port, kind in kinds:
                stack.enter_context(socket.socket(socket.AF_INET, kind)).bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


@pytest.fixture
def client() -> Callable[..., dict[str, Any]]:
    """Runs a script of `clients/` that needs a package, to its end; returns what it saw."""

    def run(script: str, package: str, *arguments: str) -> dict[str, Any]:
        needs(package)
        with ended_with([sys.executable, str(CLIENTS / script), *arguments]) as process:
            try:
                out, err = process.communicate(timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                out, err = process.communicate()
                pytest.fail(f"{script} did not end within {PATIENCE_S} s\n{out}\n{err}")
        assert process.returncode == 0, f"{script} failed\n{out}\n{err}"
        return dict(json.loads(out.splitlines()[-1]))

    return run


def needs(package: str) -> None:
    """Skip where a client's package is not installed."""
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"needs {package}: pip install '.[interop]'")
