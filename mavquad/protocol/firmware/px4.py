"""PX4: its custom modes, and what its releases take.

custom_mode carries the main mode in bits 16..23 and, for AUTO, the sub mode in bits 24..31 (PX4, px4_custom_mode.h).
"""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware.profile import Firmware, Mode, Version
from mavquad.types import Depth

MAIN_POSCTL = 3
MAIN_AUTO = 4
MAIN_OFFBOARD = 6
SUB_TAKEOFF = 2
SUB_LOITER = 3
SUB_RTL = 5
SUB_LAND = 6

_MAIN_NAMES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_AUTO_NAMES = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}


def mode(main: int, sub: int = 0) -> Mode:
    """A mode by its main and its sub mode (0 where there is none)."""
    name = f"AUTO.{_AUTO_NAMES.get(sub, sub)}" if main == MAIN_AUTO else _MAIN_NAMES.get(main, f"mode {main}")
    return Mode(name, main << 16 | sub << 24, (float(main), float(sub)))


OFFBOARD = mode(MAIN_OFFBOARD)
TAKEOFF = mode(MAIN_AUTO, SUB_TAKEOFF)
LOITER = mode(MAIN_AUTO, SUB_LOITER)
RTL = mode(MAIN_AUTO, SUB_RTL)
LAND = mode(MAIN_AUTO, SUB_LAND)
POSCTL = mode(MAIN_POSCTL)


def mode_from_custom(custom_mode: int) -> Mode:
    """The mode that HEARTBEAT.custom_mode shows."""
    return mode(custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)


LAST_TORQUE_VERSION = (1, 13)
"""SET_ACTUATOR_CONTROL_TARGET is handled up to PX4 1.13; later releases ignore it silently."""


def depths(version: Version) -> tuple[Depth, ...]:
    """What this release takes over MAVLink, the deepest first."""
    return ("torque", "rate", "attitude") if version[:2] <= LAST_TORQUE_VERSION else ("rate", "attitude")


PX4 = Firmware(
    name="PX4",
    autopilot=mavlink.MAV_AUTOPILOT_PX4,
    mode=mode_from_custom,
    offboard=OFFBOARD,
    takeoff=TAKEOFF,
    hover=LOITER,
    hold=LOITER,
    land=LAND,
    home=RTL,
    pilot=POSCTL,
    arms_in=None,
    depths=depths,
    takeoff_parameter="MIS_TAKEOFF_ALT",
    takeoff_m=0.0,
    hover_parameter="MPC_THR_HOVER",
    estimator=("ESTIMATOR_STATUS", mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS),
    high_share=0.5,  # the mode tells that the climb is over, and a real estimate drifts by a metre
    parameters=("COM_RCL_EXCEPT",),
)
