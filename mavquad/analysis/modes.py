"""Flight modes by the names that their users know, from HEARTBEAT."""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware.px4 import mode_from_custom

_COPTERS = ("QUADROTOR", "COAXIAL", "HELICOPTER", "TRICOPTER", "HEXAROTOR", "OCTOROTOR", "DECAROTOR", "DODECAROTOR")
_PLANES = ("FIXED_WING", "VTOL_DUOROTOR", "VTOL_QUADROTOR", "VTOL_TILTROTOR")
_ARDUPILOT_MODES = {
    **dict.fromkeys((getattr(mavlink, f"MAV_TYPE_{name}") for name in _COPTERS), "COPTER_MODE"),
    **dict.fromkeys((getattr(mavlink, f"MAV_TYPE_{name}") for name in _PLANES), "PLANE_MODE"),
    mavlink.MAV_TYPE_GROUND_ROVER: "ROVER_MODE",
    mavlink.MAV_TYPE_SURFACE_BOAT: "ROVER_MODE",
    mavlink.MAV_TYPE_SUBMARINE: "SUB_MODE",
    mavlink.MAV_TYPE_ANTENNA_TRACKER: "TRACKER_MODE",
}
"""MAVLink's enum of the modes of each of ArduPilot's vehicles."""


def mode_name(autopilot: int, vehicle_type: int, custom_mode: int) -> str:
    """GUIDED, AUTO.LOITER; "mode N" of an autopilot whose modes are not known.

    Args:
        autopilot: MAV_AUTOPILOT of HEARTBEAT.
        vehicle_type: MAV_TYPE.
        custom_mode: as there.
    """
    if autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return mode_from_custom(custom_mode).name
    enum = _ARDUPILOT_MODES.get(vehicle_type) if autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA else None
    entry = mavlink.enums[enum].get(custom_mode) if enum else None
    return entry.name.removeprefix(f"{enum}_") if entry else f"mode {custom_mode}"
