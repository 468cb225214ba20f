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
    def text(self) -> str:
        """As ArduCopter writes it in its texts."""
        return self.name.replace("_RTL", "RTL")

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

NOT_FLOWN: dict[int, tuple[str, ...]] = {
    11: ("DRIFT failed: not in this mock",),
    13: ("SPORT failed: not in this mock",),
    14: ("FLIP failed: init failed",),
    15: ("AUTOTUNE failed: init failed",),
    18: ("THROW failed: not in this mock",),
    19: ("AVOID_ADSB failed: not in this mock",),
    22: ("FLOWHOLD failed: init failed",),
    23: ("FOLLOW failed: init failed", "Set FOLL_ENABLE = 1"),
    24: ("ZIGZAG failed: not in this mock",),
    25: ("SYSTEMID failed: init failed", "No axis selected, SID_AXIS = 0"),
    27: ("AUTO RTL failed: No return path or landing sequence found", "Unable to start landing sequence"),
    28: ("TURTLE failed: init failed",),
}
"""ArduCopter's other modes, which the mock refuses: what follows "Mode change to", and what is said before it."""
