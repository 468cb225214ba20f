"""A name for a file that nobody named, and that nothing has yet."""

from __future__ import annotations

import itertools
from pathlib import Path


def new_file(stem: str, suffix: str) -> Path:
    """STEM.suffix in the working folder, or the first of STEM-2.suffix, ... that does not exist."""
    names = (Path(f"{stem}{more}{suffix}") for more in itertools.chain([""], (f"-{n}" for n in itertools.count(2))))
    return next(name for name in names if not name.exists())
