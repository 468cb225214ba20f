"""Names of the modes that HEARTBEAT.custom_mode stands for."""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware import px4

_BY_TYPE = {
    mavlink.MAV_TYPE_FIXED_WING: "PLANE_MODE",
    mavlink.MAV_TYPE_GROUND_ROVER: "ROVER_MODE",
    mavlink.MAV_TYPE_SURFACE_BOAT: "ROVER_MODE",
    mavlink.MAV_TYPE_SUBMARINE: "SUB_MODE",
}


def mode_name(autopilot: int, vehicle_type: int, custom_mode: int) -> str:
    """The name that the users of this autopilot (MAV_AUTOPILOT, MAV_TYPE) know, or "mode N"."""
    if autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return px4.mode_from_custom(custom_mode).name
    if autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        enum = _BY_TYPE.get(vehicle_type, "COPTER_MODE")
        entry = mavlink.enums[enum].get(custom_mode)
        if entry is not None:
            return str(entry.name).removeprefix(f"{enum}_")
    return f"mode {custom_mode}"
