"""A mock autopilot that speaks MAVLink and flies a rigid-body quadcopter; plain Python, no hardware.

For tests: `VirtualVehicle` in virtual time, `LiveVehicle` on the loopback interface.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sitl_mock.api.live import LiveVehicle
    from sitl_mock.api.virtual import VirtualVehicle

__all__ = ["LiveVehicle", "VirtualVehicle"]
_ROOMS = {"VirtualVehicle": "sitl_mock.api.virtual", "LiveVehicle": "sitl_mock.api.live"}


def __getattr__(name: str) -> Any:
    """Import a vehicle when it is first asked for: the command line and pytest need not know it."""
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_ROOMS[name]), name)
