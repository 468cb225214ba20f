"""pymavlink's dialect, with every message of PX4 and ArduPilot. The only import of pymavlink in the project."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

__all__ = ["Message", "mavlink"]

Message = Any
"""A pymavlink message object, e.g. `mavlink.MAVLink_attitude_message`."""
