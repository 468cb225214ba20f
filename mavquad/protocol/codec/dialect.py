"""pymavlink's dialect, with every message of PX4 and ArduPilot. The only import of pymavlink in the project."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as pymavlink

__all__ = ["Message", "pymavlink"]

Message = Any
"""A message object: pymavlink's, or ours, which is of a subclass of it."""
