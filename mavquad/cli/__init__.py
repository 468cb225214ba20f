"""The command line: the only place where parts are chosen and wired. `mavquad fly | sim | replay`."""

from mavquad.cli.app import main

__all__ = ["main"]
