"""The firmwares that mavquad flies."""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware.ardupilot import ARDUCOPTER
from mavquad.protocol.firmware.profile import Firmware, Mode, Version
from mavquad.protocol.firmware.px4 import PX4

__all__ = ["ARDUCOPTER", "PX4", "Firmware", "Mode", "Version", "firmware_of"]

_MULTICOPTERS = frozenset(
    (
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR,
        mavlink.MAV_TYPE_TRICOPTER,
        mavlink.MAV_TYPE_DODECAROTOR,
        mavlink.MAV_TYPE_DECAROTOR,
    )
)


def firmware_of(autopilot: int, vehicle_type: int) -> Firmware | None:
    """The firmware behind HEARTBEAT's MAV_AUTOPILOT and MAV_TYPE; None if mavquad does not fly it."""
    for firmware in (PX4, ARDUCOPTER):
        # ArduPilot is a family: its planes, rovers and boats number their modes differently.
        if autopilot == firmware.autopilot and vehicle_type in _MULTICOPTERS:
            return firmware
    return None
