"""Which streams PX4 has on each kind of link, their default rates, and how fast they can be."""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from sitl_mock.config.sensors import StreamsConfig
from sitl_mock.personality.streams import Streams
from sitl_mock.port import PortKind

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


def streams_of(kind: PortKind, limits: StreamsConfig) -> Streams:
    """The streams of a link at boot."""
    fastest_hz = {
        mavlink.MAVLINK_MSG_ID_ATTITUDE: limits.max_attitude_hz,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: limits.max_attitude_hz,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: limits.max_position_hz,
    }
    return Streams(DEFAULT_HZ, fastest_hz, _UNSENT)
