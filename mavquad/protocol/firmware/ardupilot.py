"""ArduCopter: its modes, and how GUIDED is flown from the ground.

custom_mode is the mode's number. GUIDED is the mode to arm in, to take off in (MAV_CMD_NAV_TAKEOFF with the height above
home) and to take SET_ATTITUDE_TARGET in, so that setpoints act from the first on. It is left for BRAKE, which stops and
stays without a pilot's sticks; LOITER would take a transmitter that is off for a stick pulled down (seen on 4.7).
"""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from mavquad.protocol.firmware.profile import Firmware, Mode, Version
from mavquad.types import Depth

_NAMES = {
    0: "STABILIZE",
    1: "ACRO",
    2: "ALT_HOLD",
    3: "AUTO",
    4: "GUIDED",
    5: "LOITER",
    6: "RTL",
    7: "CIRCLE",
    9: "LAND",
    11: "DRIFT",
    13: "SPORT",
    14: "FLIP",
    15: "AUTOTUNE",
    16: "POSHOLD",
    17: "BRAKE",
    18: "THROW",
    19: "AVOID_ADSB",
    20: "GUIDED_NOGPS",
    21: "SMART_RTL",
    22: "FLOWHOLD",
    23: "FOLLOW",
    24: "ZIGZAG",
    25: "SYSTEMID",
    26: "AUTOROTATE",
    27: "AUTO_RTL",
    28: "TURTLE",
}


def mode(number: int) -> Mode:
    """A mode by its number."""
    return Mode(_NAMES.get(number, f"mode {number}"), number, (float(number),))


GUIDED = mode(4)
LOITER = mode(5)
RTL = mode(6)
LAND = mode(9)
BRAKE = mode(17)


def depths(version: Version) -> tuple[Depth, ...]:
    """ArduCopter takes no torque, in no release (SET_ACTUATOR_CONTROL_TARGET is not in its source)."""
    return ("rate", "attitude")


ARDUCOPTER = Firmware(
    name="ArduCopter",
    autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
    mode=mode,
    offboard=GUIDED,
    takeoff=GUIDED,
    hover=GUIDED,
    hold=BRAKE,
    land=LAND,
    home=RTL,
    pilot=LOITER,
    arms_in=GUIDED,
    depths=depths,
    takeoff_parameter="",
    takeoff_m=2.5,
    hover_parameter="MOT_THST_HOVER",
    estimator=("EKF_STATUS_REPORT", mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT),
    high_share=0.85,  # no mode tells that the climb is over
    parameters=("GUID_OPTIONS", "GUID_TIMEOUT"),
)
