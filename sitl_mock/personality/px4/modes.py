"""PX4's flight modes: their numbers in HEARTBEAT.custom_mode (main << 16 | sub << 24), and what they ask for."""

from __future__ import annotations

from enum import Enum

from sitl_mock.config import Px4Release

_CUSTOM_ENABLED = 1
_AUTO_FLAGS = 0x1C  # stabilize, guided, auto
_MANUAL_FLAGS = 0x50  # manual input, stabilize
_ARMED = 0x80
_POSCTL, _AUTO = 3, 4


class Mode(Enum):
    """The modes that the mock can be in, by PX4's names."""

    MANUAL = "MANUAL"
    ALTCTL = "ALTCTL"
    POSCTL = "POSCTL"
    POSITION_SLOW = "POSCTL.SLOW"
    ORBIT = "POSCTL.ORBIT"
    ACRO = "ACRO"
    OFFBOARD = "OFFBOARD"
    STABILIZED = "STABILIZED"
    TAKEOFF = "AUTO.TAKEOFF"
    LOITER = "AUTO.LOITER"
    MISSION = "AUTO.MISSION"
    RTL = "AUTO.RTL"
    LAND = "AUTO.LAND"
    FOLLOW = "AUTO.FOLLOW_TARGET"
    PRECLAND = "AUTO.PRECLAND"
    VTOL_TAKEOFF = "AUTO.VTOL_TAKEOFF"

    __hash__ = object.__hash__  # as members are compared; that of Enum is a call of Python

    @property
    def custom_mode(self) -> int:
        """The number in HEARTBEAT.custom_mode."""
        main, sub = _NUMBERS[self]
        return main << 16 | sub << 24

    @property
    def spoken(self) -> str:
        """What PX4 1.14 and later call it in their texts."""
        return _SPOKEN[self]

    @property
    def needs_sticks(self) -> bool:
        """Whether a pilot must fly it."""
        return self in _NEED_STICKS

    @property
    def prevents_arming(self) -> bool:
        """Whether PX4 1.14 and later do not arm in it; nor are such modes gone back to after a flight."""
        return self in _PREVENT_ARMING

    def base_mode(self, armed: bool) -> int:
        """HEARTBEAT.base_mode, as recorded from PX4 1.13 and 1.16."""
        return _CUSTOM_ENABLED | _FLAGS.get(self, _AUTO_FLAGS) | (_ARMED if armed else 0)


_NEED_STICKS = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.POSITION_SLOW, Mode.ACRO, Mode.STABILIZED})
_PREVENT_ARMING = frozenset({Mode.RTL, Mode.LAND, Mode.PRECLAND, Mode.FOLLOW, Mode.ORBIT})
_FLAGS = {
    **dict.fromkeys(_NEED_STICKS, _MANUAL_FLAGS),
    Mode.ACRO: 0x40,
    Mode.ORBIT: 0x10,
    Mode.OFFBOARD: 0,
}
_NUMBERS: dict[Mode, tuple[int, int]] = {
    Mode.MANUAL: (1, 0),
    Mode.ALTCTL: (2, 0),
    Mode.POSCTL: (_POSCTL, 0),
    Mode.ORBIT: (_POSCTL, 1),
    Mode.POSITION_SLOW: (_POSCTL, 2),
    Mode.ACRO: (5, 0),
    Mode.OFFBOARD: (6, 0),
    Mode.STABILIZED: (7, 0),
    Mode.TAKEOFF: (_AUTO, 2),
    Mode.LOITER: (_AUTO, 3),
    Mode.MISSION: (_AUTO, 4),
    Mode.RTL: (_AUTO, 5),
    Mode.LAND: (_AUTO, 6),
    Mode.FOLLOW: (_AUTO, 8),
    Mode.PRECLAND: (_AUTO, 9),
    Mode.VTOL_TAKEOFF: (_AUTO, 10),
}
_SPOKEN: dict[Mode, str] = {
    Mode.MANUAL: "Manual",
    Mode.ALTCTL: "Altitude",
    Mode.POSCTL: "Position",
    Mode.POSITION_SLOW: "Position Slow",
    Mode.ORBIT: "Orbit",
    Mode.ACRO: "Acro",
    Mode.OFFBOARD: "Offboard",
    Mode.STABILIZED: "Stabilized",
    Mode.TAKEOFF: "Takeoff",
    Mode.LOITER: "Hold",
    Mode.MISSION: "Mission",
    Mode.RTL: "Return",
    Mode.LAND: "Land",
    Mode.FOLLOW: "Follow Target",
    Mode.PRECLAND: "Precision Landing",
    Mode.VTOL_TAKEOFF: "VTOL Takeoff",
}
_BY_COMMAND = {numbers: mode for mode, numbers in _NUMBERS.items() if mode is not Mode.ORBIT}


class UnsupportedAutoModeError(Exception):
    """An AUTO mode that PX4 refuses by name."""


def mode_of(main: int, sub: int, firmware: Px4Release) -> Mode | None:
    """The mode that DO_SET_MODE means with these numbers; None for a main mode that PX4 passes over in silence.

    Raises:
        UnsupportedAutoModeError: PX4 has no such AUTO mode, and says so.
    """
    if main == _AUTO:
        mode = Mode.MISSION if sub == 0 else _BY_COMMAND.get((main, sub))
        if mode is None:
            raise UnsupportedAutoModeError
        return mode
    if main == _POSCTL:
        return Mode.POSITION_SLOW if sub == 2 and firmware != "1.13" else Mode.POSCTL
    return _BY_COMMAND.get((main, 0))


def mode_of_base(base_mode: int) -> Mode | None:
    """The mode that MAV_MODE_FLAGs mean without a custom mode."""
    if base_mode & 4:  # auto
        return Mode.MISSION
    if not base_mode & 64:  # manual input
        return None
    return Mode.POSCTL if base_mode & 8 else Mode.STABILIZED if base_mode & 16 else Mode.MANUAL
