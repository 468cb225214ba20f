"""Which telemetry is due: PX4's default rates, SET_MESSAGE_INTERVAL, and what the autopilot can deliver.

A stream is due in the first tick of each of its periods counted from boot, so that two streams of the same rate fall
into the same tick whenever they were asked for.
"""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import mavlink
from sitl_mock.config import StreamsConfig

DEFAULT_HZ: dict[int, float] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 100,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 10,
    mavlink.MAVLINK_MSG_ID_TIMESYNC: 10,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 5,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
}
"""Every stream and its rate on PX4's onboard link, in the order in which one tick sends them."""

# fmt: off
_UNSENT = frozenset({
    4, 8, 24, 25, 26, 49, 62, 65, 69, 74, 76, 85, 87, 93, 105, 106, 112, 115, 116, 124, 129, 132, 138, 140, 141, 148,
    149, 192, 225, 230, 231, 233, 235, 241, 246, 247, 250, 251, 253, 254, 261, 263, 264, 265, 280, 281, 284, 285, 286,
    290, 291, 300, 330, 331, 332, 339, 340, 350, 360, 370, 375, 395, 397, 12920,
})
# fmt: on
"""Ids of the other streams of PX4 1.13.3 (streams_list in mavlink_messages.cpp), which the mock does not send."""

_TICK_HZ = 250.0


class Streams:
    """The intervals in force, and the messages due now."""

    def __init__(self, config: StreamsConfig) -> None:
        self._fastest_hz = dict.fromkeys(DEFAULT_HZ, _TICK_HZ)
        self._fastest_hz[mavlink.MAVLINK_MSG_ID_ATTITUDE] = config.max_attitude_hz
        self._fastest_hz[mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION] = config.max_attitude_hz
        self._fastest_hz[mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED] = config.max_position_hz
        self._interval_us = {message_id: self._period_us(message_id, 1e6 / hz) for message_id, hz in DEFAULT_HZ.items()}
        self._due_us = dict.fromkeys(DEFAULT_HZ, 0)

    def _period_us(self, message_id: int, asked_us: float) -> int:
        return round(max(asked_us, 1e6 / self._fastest_hz[message_id]))

    def set_interval(self, message_id: int, interval_us: float, boot_us: int) -> bool:
        """Obey SET_MESSAGE_INTERVAL: 0 restores the default, below 0 stops. False for a message without a stream."""
        if message_id in _UNSENT:
            return True
        if message_id not in DEFAULT_HZ:
            return False
        if interval_us < 0:
            self._interval_us[message_id] = -1
            self._due_us[message_id] = NEVER_US
            return True
        asked_us = interval_us if interval_us > 0 else 1e6 / DEFAULT_HZ[message_id]
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
