"""Python's collector of cyclic garbage, off while something is flown."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collector() -> Iterator[None]:
    """Python's search for cyclic garbage is off: steps leave none (a test holds that), and
    looking for it costs 8 % in lockstep, and in a live flight a pause of up to 0.2 s on a busy computer."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
