"""Consoles that may lose their reader: whoever watched a flight has left, and the flight goes on."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable
from typing import TextIO

from rich.console import Console


class QuietConsole(Console):
    """A console whose broken pipe is an `OSError`; rich's own one would end the process, in flight if need be."""

    def on_broken_pipe(self) -> None:
        """Called while the error is handled: hand it on."""
        raise BrokenPipeError


def shown(show: Callable[[], None]) -> bool:
    """Show something; False if it cannot be shown (nobody reads, the terminal is gone, a character it does not have)."""
    try:
        show()
    except (OSError, ValueError, SystemExit):
        return False
    return True


def say(text: str) -> None:
    """Print on stdout, where a program may read it; one that has left changes nothing."""
    shown(lambda: print(text, end="", flush=True))  # noqa: T201 - the one thing on stdout


def flush_or_drop() -> None:
    """Flush both streams; what a reader that has left did not take is dropped, or Python would end with code 120."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not shown(stream.flush):
            _drop(stream)


def _drop(stream: TextIO) -> None:
    with contextlib.suppress(OSError, ValueError), open(os.devnull, "wb") as nowhere:  # noqa: PTH123 - not a path of ours
        os.dup2(nowhere.fileno(), stream.fileno())
