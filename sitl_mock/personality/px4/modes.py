"""PX4's flight modes and their numbers in HEARTBEAT.custom_mode: main mode << 16 | sub mode << 24."""

from __future__ import annotations

from enum import Enum

_CUSTOM_ENABLED = 1
_AUTO_FLAGS = 0x1C  # stabilize, guided, auto
_MANUAL_FLAGS = 0x50  # manual input, stabilize
_ARMED = 0x80


class Mode(Enum):
    """The modes that the mock can be in, by PX4's names."""

    MANUAL = "MANUAL"
    POSCTL = "POSCTL"
    OFFBOARD = "OFFBOARD"
    TAKEOFF = "AUTO.TAKEOFF"
    LOITER = "AUTO.LOITER"
    RTL = "AUTO.RTL"
    LAND = "AUTO.LAND"

    @property
    def custom_mode(self) -> int:
        """The number in HEARTBEAT.custom_mode."""
        main, sub = _NUMBERS[self]
        return main << 16 | sub << 24

    def base_mode(self, armed: bool) -> int:
        """HEARTBEAT.base_mode, as recorded from PX4 1.13 and 1.16."""
        return _CUSTOM_ENABLED | _FLAGS.get(self, _AUTO_FLAGS) | (_ARMED if armed else 0)


_FLAGS = {Mode.MANUAL: _MANUAL_FLAGS, Mode.POSCTL: _MANUAL_FLAGS, Mode.OFFBOARD: 0}
_NUMBERS: dict[Mode, tuple[int, int]] = {
    Mode.MANUAL: (1, 0),
    Mode.POSCTL: (3, 0),
    Mode.OFFBOARD: (6, 0),
    Mode.TAKEOFF: (4, 2),
    Mode.LOITER: (4, 3),
    Mode.RTL: (4, 5),
    Mode.LAND: (4, 6),
}


def mode_of(main: int, sub: int) -> Mode | None:
    """The mode with these numbers; None for one that the mock does not have."""
    for mode, numbers in _NUMBERS.items():
        if numbers == (main, sub if main == 4 else 0):
            return mode
    return None
