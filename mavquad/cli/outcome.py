"""Errors to one message and one exit code. No traceback reaches a user; what we broke ourselves goes into a file."""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

from rich.text import Text

from mavquad.cli.terminal import QuietConsole, flush_or_drop, shown
from mavquad.errors import EXIT_INTERNAL, EXIT_INTERRUPTED, InputError, InternalError, MavquadError

EXIT_CODES = """\
Exit codes:
0    the mission is complete, the replay is equal, the vehicle is ready, its parameters are restored
2    bad input: a file, an option, the configuration
3    the vehicle refused, or did not answer
4    a guard or the pilot ended the flight, the vehicle was lost, or left before the landing
5    the replay differs
70   an error of mavquad itself
130  interrupted, and landed"""


def show(error: MavquadError) -> None:
    """Print an error and its hint to stderr."""
    lines = [("error:", "bold red", f" {error.message}"), ("hint:", "dim", f"  {error.hint}")]
    console = QuietConsole(stderr=True, highlight=False, soft_wrap=True)
    for head, style, words in lines if error.hint else lines[:1]:
        line = Text.assemble((head, style), words)
        shown(lambda line=line: console.print(line))  # type: ignore[misc]


def run(command: Callable[[], object]) -> int:
    """Run the command line; the exit code of whatever comes of it, whether or not somebody still reads what is said."""
    code = _run(command)
    flush_or_drop()
    return code


def _run(command: Callable[[], object]) -> int:
    """The exit code of a command.

    A command returns its exit code (or None for 0), or raises a `MavquadError`. The parser's own errors carry an
    `exit_code` and a `format_message`.
    """
    try:
        code = command()
    except MavquadError as error:
        if isinstance(error, InternalError):
            return _internal(error)
        show(error)
        return error.exit_code
    except KeyboardInterrupt:
        shown(lambda: QuietConsole(stderr=True).print("interrupted"))
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # of the parser's help; what a flight shows does not raise
        return 0
    except Exception as error:  # noqa: BLE001 - the last net: everything ends as a message and a code
        if type(error).__name__ == "NoArgsIsHelpError":
            return 2
        if hasattr(error, "format_message"):
            show(InputError(error.format_message(), "see --help"))
            return 2
        if type(error).__name__ == "Exit":
            return int(getattr(error, "exit_code", 0))
        return _internal(error)
    return code if isinstance(code, int) else 0


def _internal(error: Exception) -> int:
    """An error of our own: a line for the user, the rest into a file."""
    details = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="mavquad-error-", suffix=".txt", delete=False) as stream:
            stream.write(details)
        where = f"details are in {Path(stream.name)}"
    except OSError:
        where = "details could not be written"
    show(InternalError(f"mavquad failed ({type(error).__name__}: {error}); {where}", "please report it"))
    return EXIT_INTERNAL
