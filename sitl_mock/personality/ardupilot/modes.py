"""ArduCopter's flight modes, by its own names and numbers (HEARTBEAT.custom_mode)."""

from __future__ import annotations

from enum import IntEnum


class Mode(IntEnum):
    """The modes that the mock flies; `name` is ArduCopter's, the value its number."""

    STABILIZE = 0
    ACRO = 1
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    CIRCLE = 7
    LAND = 9
    POSHOLD = 16
    BRAKE = 17
    GUIDED_NOGPS = 20
    SMART_RTL = 21

    @property
    def needs_position(self) -> bool:
        """Whether it wants a position estimate to be armed or entered in the air."""
        return self not in _WITHOUT_POSITION

    @property
    def holds_position(self) -> bool:
        """Whether its position control is at work from its first moment, and on the ground."""
        return self.needs_position or self is Mode.LAND

    @property
    def has_manual_throttle(self) -> bool:
        """Whether the pilot's stick is the thrust."""
        return self in (Mode.STABILIZE, Mode.ACRO)

    @property
    def can_be_armed(self) -> bool:
        """Whether the vehicle may be armed in it."""
        return self not in _NOT_ARMABLE

    @property
    def takes_off_by_command(self) -> bool:
        """Whether it obeys MAV_CMD_NAV_TAKEOFF."""
        return self in (Mode.GUIDED, Mode.LOITER, Mode.ALT_HOLD, Mode.POSHOLD)

    @property
    def is_guided(self) -> bool:
        """Whether it takes setpoints over MAVLink."""
        return self in (Mode.GUIDED, Mode.GUIDED_NOGPS)


_WITHOUT_POSITION = (Mode.STABILIZE, Mode.ACRO, Mode.ALT_HOLD, Mode.LAND, Mode.GUIDED_NOGPS)
_NOT_ARMABLE = (Mode.AUTO, Mode.RTL, Mode.CIRCLE, Mode.LAND, Mode.BRAKE, Mode.SMART_RTL)

NOT_FLOWN = {
    11: "DRIFT",
    13: "SPORT",
    14: "FLIP",
    15: "AUTOTUNE",
    18: "THROW",
    19: "AVOID_ADSB",
    22: "FLOWHOLD",
    23: "FOLLOW",
    24: "ZIGZAG",
    25: "SYSTEMID",
    26: "AUTOROTATE",
    27: "AUTO_RTL",
    28: "TURTLE",
}
"""ArduCopter's other modes, which the mock refuses."""
