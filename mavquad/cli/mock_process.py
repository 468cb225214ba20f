"""The bundled mock autopilot as a child process on a free loopback port."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import tomli_w

from mavquad.config import Config
from mavquad.errors import InternalError


@contextlib.contextmanager
def start_mock(config: Config) -> Iterator[str]:
    """Start the mock with the configuration's [mock] table; yields the connection string to reach it.

    It ends with the block, and by itself when this process dies (its standard input closes).

    Raises:
        InternalError: it did not start; the message holds what it said.
    """
    with tempfile.TemporaryDirectory(prefix="mavquad-mock-") as folder:
        table = Path(folder) / "mock.toml"
        table.write_text(tomli_w.dumps(config.mock), encoding="utf-8")
        command = [sys.executable, "-P", "-m", "sitl_mock", "--endpoint", "udpin:127.0.0.1:0", "--announce"]
        process = subprocess.Popen(
            [*command, "--config", str(table), "--seed", str(config.seed)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # Ctrl-C is for the agent, which lands the vehicle; the mock must live on until then.
            start_new_session=True,
        )
        try:
            yield _announced_url(process)
        finally:
            process.terminate()
            process.communicate()


def _announced_url(process: subprocess.Popen[bytes]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    try:
        return str(json.loads(line)["url"])
    except (ValueError, KeyError):
        if line:
            process.kill()  # it runs, and says something else
        said = process.communicate()[1].decode(errors="replace").strip()
        raise InternalError(f"the mock autopilot did not start: {said or line!r}") from None
