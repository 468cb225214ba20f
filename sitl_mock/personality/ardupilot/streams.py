"""ArduPilot's telemetry on one link: nothing but HEARTBEAT and TIMESYNC until asked, whole milliseconds, groups.

A stream is sent when its interval has passed since it was due last, so that its mean rate is what was asked for
whatever the tick; faster than a tick (250 Hz here, 400 on the real one) is accepted and cannot be delivered.
"""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import mavlink

LEAST_INTERVAL_MS = 3
"""What ArduPilot takes at most is 0.8 times its loop rate of 400 Hz; shorter whole milliseconds are refused."""
_ALL = 0

# fmt: off
GROUPS: dict[int, tuple[str, tuple[int, ...]]] = {
    1: ("RAW_SENS", (27, 116, 129, 29, 137)),
    2: ("EXT_STAT", (1, 125, 11039, 152, 42, 24, 62, 162, 87)),
    3: ("RC_CHAN", (36, 65)),
    6: ("POSITION", (33, 32)),
    10: ("EXTRA1", (30, 164, 178)),
    11: ("EXTRA2", (74,)),
    12: ("EXTRA3", (163, 2, 168, 147, 193, 241)),
}
"""REQUEST_DATA_STREAM's numbers: the group's name in the MAVn_ parameters, and its messages."""

KNOWN = frozenset({
    0, 1, 2, 24, 26, 27, 29, 30, 31, 32, 33, 34, 35, 36, 42, 49, 62, 65, 74, 83, 85, 87, 100, 105, 108, 116, 124, 125,
    127, 128, 129, 132, 133, 136, 137, 143, 147, 148, 152, 162, 163, 164, 165, 168, 173, 178, 181, 191, 192, 193, 194,
    225, 226, 235, 241, 242, 245, 246, 259, 260, 261, 262, 263, 269, 271, 285, 295, 373, 435, 9000, 9005, 11020, 11030,
    11031, 11032, 11033, 11034, 11035, 11036, 11037, 11038, 11039,
})
"""Ids that ArduPilot has a stream for; the mock does not send every one, but setting an interval is accepted."""
# fmt: on

_HEARTBEAT_MS = 1000
_BUSY_FACTOR = 4
"""While a parameter list is sent, streams are this much slower."""


def group_named(name: str) -> int | None:
    """The number of a group by its name in the MAVn_ parameters."""
    return next((number for number, (known, _) in GROUPS.items() if known == name), None)


class Streams:
    """The intervals in force on one link, and what is due there."""

    def __init__(self, first_heartbeat_us: int) -> None:
        heartbeat = mavlink.MAVLINK_MSG_ID_HEARTBEAT
        self._interval_us: dict[int, int] = {heartbeat: _HEARTBEAT_MS * 1000}
        self._due_us: dict[int, int] = {heartbeat: first_heartbeat_us}
        self._next_us = first_heartbeat_us

    def set_interval_ms(self, message_id: int, interval_ms: int, boot_us: int) -> None:
        """Send a message every so many whole milliseconds; 0 stops it."""
        if interval_ms <= 0:
            self._interval_us.pop(message_id, None)
            self._due_us.pop(message_id, None)
            return
        self._interval_us[message_id] = 1000 * interval_ms
        self._due_us[message_id] = boot_us + 1000 * interval_ms
        self._next_us = min(self._next_us, self._due_us[message_id])

    def interval_us(self, message_id: int) -> int:
        """The interval in force; 0 for none."""
        return self._interval_us.get(message_id, 0)

    def set_group_hz(self, group: int, rate_hz: int, boot_us: int) -> tuple[str, ...]:
        """Obey REQUEST_DATA_STREAM; the groups' names whose rate it set."""
        chosen = tuple(GROUPS) if group == _ALL else (group,) if group in GROUPS else ()
        interval_ms = max(LEAST_INTERVAL_MS, 1000 // rate_hz) if rate_hz > 0 else 0
        for number in chosen:
            for message_id in GROUPS[number][1]:
                self.set_interval_ms(message_id, interval_ms, boot_us)
        return tuple(GROUPS[number][0] for number in chosen)

    def due(self, boot_us: int, is_busy: bool) -> list[int]:
        """Ids of the messages to send now, in the order of their numbers' first request."""
        if boot_us < self._next_us:
            return []
        due_us = self._due_us
        ids = [message_id for message_id, due in due_us.items() if due <= boot_us]
        for message_id in ids:
            interval = self._interval_us[message_id] * (_BUSY_FACTOR if is_busy and message_id else 1)
            due_us[message_id] = max(due_us[message_id] + interval, boot_us - interval)
        self._next_us = min(due_us.values(), default=NEVER_US)
        return ids
