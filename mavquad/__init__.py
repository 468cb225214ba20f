"""Robust output-feedback flight of quadcopters over MAVLink."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mavquad.api import Mission as Mission
    from mavquad.api import Vehicle as Vehicle
    from mavquad.api import connect as connect

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """`connect`, `Mission` and `Vehicle`, imported when they are first asked for: the commands need not wait for them."""
    if name in ("connect", "Mission", "Vehicle"):
        from mavquad import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
