"""`sitl-mock`: mock vehicles on the ports of the real simulators. Here, how every error ends as a message and a code."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable

from mavquad.errors import EXIT_INTERNAL, EXIT_INTERRUPTED, MavquadError

__all__ = ["main", "tell"]


def main() -> None:
    """Entry point. Ctrl-C while the large parts are still being imported is no error either."""
    try:
        from sitl_mock.command import app

        sys.exit(_run(app))
    except KeyboardInterrupt:
        tell("interrupted")
        sys.exit(EXIT_INTERRUPTED)


def _run(app: Callable[[], object]) -> int:
    try:
        app()
    except MavquadError as error:
        tell(f"error: {error.message}", *([f"       {error.hint}"] if error.hint else []))
        return error.exit_code
    except Exception as error:  # noqa: BLE001 - no traceback reaches a user
        tell(f"error in the mock autopilot itself: {type(error).__name__}: {error}")
        return EXIT_INTERNAL
    return 0


def tell(*lines: str) -> None:
    """Print lines on stderr; one who no longer reads, or has closed it, changes nothing."""
    if sys.stderr is None:
        return
    with contextlib.suppress(OSError):
        print(*lines, sep="\n", file=sys.stderr, flush=True)  # noqa: T201 - for people


if __name__ == "__main__":
    main()
