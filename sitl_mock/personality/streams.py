"""Which telemetry is due: default rates, SET_MESSAGE_INTERVAL, and what the autopilot can deliver.

A stream is due in the first tick of each of its periods counted from boot, so that two streams of the same rate fall
into the same tick whenever they were asked for.
"""

from __future__ import annotations

from collections.abc import Mapping

from mavquad.endpoint import NEVER_US

_TICK_HZ = 250.0


class Streams:
    """The intervals in force on one link, and the messages due now.

    Args:
        default_hz: every stream by message id, in the order in which one tick sends them, with its rate at boot.
        fastest_hz: the most that some of them can do; the others, one message a tick.
        unsent: ids of streams that the real autopilot has and the mock does not send; asking for them is accepted.
    """

    def __init__(
        self, default_hz: Mapping[int, float], fastest_hz: Mapping[int, float], unsent: frozenset[int] = frozenset()
    ) -> None:
        self._default_hz = default_hz
        self._fastest_hz = fastest_hz
        self._unsent = unsent
        self._interval_us = {message_id: self._period_us(message_id, 1e6 / hz) for message_id, hz in default_hz.items()}
        self._due_us = dict.fromkeys(default_hz, 0)

    def _period_us(self, message_id: int, asked_us: float) -> int:
        return round(max(asked_us, 1e6 / self._fastest_hz.get(message_id, _TICK_HZ)))

    def set_interval(self, message_id: int, interval_us: float, boot_us: int) -> bool:
        """Obey SET_MESSAGE_INTERVAL: 0 restores the default, below 0 stops. False for a message without a stream."""
        if message_id in self._unsent:
            return True
        if message_id not in self._default_hz:
            return False
        if interval_us < 0:
            self._interval_us[message_id] = -1
            self._due_us[message_id] = NEVER_US
            return True
        asked_us = interval_us if interval_us > 0 else 1e6 / self._default_hz[message_id]
        self._interval_us[message_id] = self._period_us(message_id, asked_us)
        self._schedule(message_id, boot_us)
        return True

    def interval_us(self, message_id: int) -> int:
        """The interval in force; -1 stopped, 0 no such stream (MESSAGE_INTERVAL's convention)."""
        return self._interval_us.get(message_id, 0)

    def due(self, boot_us: int) -> list[int]:
        """Ids of the messages to send in this tick."""
        ids = [message_id for message_id, due_us in self._due_us.items() if due_us <= boot_us]
        for message_id in ids:
            self._schedule(message_id, boot_us)
        return ids

    def _schedule(self, message_id: int, boot_us: int) -> None:
        interval = self._interval_us[message_id]
        self._due_us[message_id] = (boot_us // interval + 1) * interval
