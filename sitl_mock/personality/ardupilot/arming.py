"""Why ArduCopter may not be armed: its checks over the time since boot, in the order and words recorded."""

from __future__ import annotations

from sitl_mock.personality.ardupilot.boot import Moments
from sitl_mock.personality.ardupilot.modes import Mode


def complaints(at: Moments, mode: Mode, is_checking: bool, boot_us: int) -> list[str]:
    """The reasons, none when the vehicle may be armed; `is_checking` is ARMING_CHECK.

    Recorded are the four of 4.4 s after boot, and the position's. That the accelerometers are what is waited for until
    23.1 s is inferred: it is when STABILIZE can be armed.
    """
    reasons = []
    if is_checking and boot_us < at.yaw_us and not mode.has_manual_throttle:
        reasons.append("Need Alt Estimate")
    if is_checking and boot_us < at.settled_us:
        reasons.append("Accels inconsistent")
    if boot_us < at.yaw_us:
        reasons.append("EKF attitude is bad")
    if boot_us < at.origin_us and (is_checking or mode.needs_position):
        reasons.append("AHRS: waiting for home")
    if mode.needs_position and boot_us < at.armable_us and not reasons:
        reasons.append("Need Position Estimate")
    return reasons
