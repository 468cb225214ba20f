"""The command line: the only place where parts are chosen and wired. `mavquad fly | sim | replay`."""

import sys

__all__ = ["main"]


def main() -> None:
    """Entry point of the `mavquad` command. Ctrl-C while the parts are still being imported is no error either."""
    try:
        from mavquad.cli.app import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)
