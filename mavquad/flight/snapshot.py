"""A snapshot of the flight, for a display and for the summary."""

from __future__ import annotations

from mavquad.flight.airframe import HoverThrust
from mavquad.flight.bridge import Address, Bridge
from mavquad.flight.control import Control
from mavquad.flight.vehicle import Vehicle
from mavquad.flight_record import Status
from mavquad.protocol.firmware import Version
from mavquad.protocol.identify import UNKNOWN_VERSION


def status_of(bridge: Bridge, vehicle: Vehicle, version: Version, control: Control, hover: HoverThrust) -> Status:
    """The flight as it is now."""
    position = control.pose.position
    mission_s, mission_duration_s = control.law.progress_s(position.stamp_us if position else 0)
    known = version != UNKNOWN_VERSION
    return Status(
        phase=bridge.phase.value,
        mode=vehicle.mode_name,
        armed=vehicle.armed,
        vehicle=_words(vehicle, version, bridge.target) if known else "",
        version=version,
        height_m=position.position_nwu_m[2] - bridge.ground_m if position else None,
        row=control.last_row if control.on else None,
        mission_s=mission_s,
        mission_duration_s=mission_duration_s,
        depth=control.law.depth if known else "",
        position_hz=vehicle.streams["LOCAL_POSITION_NED"].rate_hz(bridge.now_us),
        hover_thrust_norm=hover.norm,
        setpoints_sent=control.sent,
        safe_setpoints=control.safe_sent,
        old_poses=control.pose.old,
    )


def _words(vehicle: Vehicle, version: Version, address: Address) -> str:
    return f"{vehicle.firmware.name} {'.'.join(map(str, version))} ({address[0]}/{address[1]})"
