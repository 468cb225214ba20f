"""Which streams PX4 has on each kind of link, their default rates, and how fast they can be.

Rates and order as recorded from 1.13.3 and 1.16.2 (the ground station's link: from 1.13.3); 1.14, 1.15 and 1.17 were
seen to be as 1.16, but for ATTITUDE, which comes faster.
A message can come no oftener than the topic behind it is published, and on 1.16, whose simulator runs in lockstep,
PX4's sender misses some of the fastest topics: what is asked of 1.16.2 at 250 Hz comes at 208 Hz (ATTITUDE; 241 Hz of
1.15.4 and 1.17.0), 238 Hz
(HIGHRES_IMU), 241 Hz (outputs) and 125 Hz (position) of its own clock.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from mavquad.protocol.codec import mavlink
from sitl_mock.config import Px4Release
from sitl_mock.config.streams import StreamsConfig
from sitl_mock.personality.streams import OFF_HZ, UNLIMITED_HZ, StreamKind, Streams
from sitl_mock.plant import TICK_US
from sitl_mock.port import PortKind


class Topic(Enum):
    """What messages are made from."""

    ANY_TICK = auto()
    ATTITUDE = auto()
    IMU = auto()
    OUTPUTS = auto()
    POSITION = auto()
    GPS = auto()
    DISTANCE = auto()
    POWER = auto()
    VIBRATION = auto()


_LOCKSTEP_US = {
    Topic.ANY_TICK: TICK_US,
    Topic.ATTITUDE: 4_808,
    Topic.IMU: 4_202,
    Topic.OUTPUTS: 4_149,
    Topic.POSITION: 8_000,
    Topic.GPS: 125_000,
    Topic.DISTANCE: 20_000,
    Topic.POWER: 10_000,
    Topic.VIBRATION: 90_000,
}
_FASTER_US = {**_LOCKSTEP_US, Topic.ATTITUDE: 4_150}
_TOPICS_US: dict[Px4Release, dict[Topic, int]] = {
    "1.13": {
        Topic.ANY_TICK: TICK_US,
        Topic.ATTITUDE: 4_032,
        Topic.IMU: 4_016,
        Topic.OUTPUTS: TICK_US,
        Topic.POSITION: 11_240,
        Topic.GPS: 50_710,
        Topic.DISTANCE: 20_800,
        Topic.POWER: 10_000,
        Topic.VIBRATION: 90_000,
    },
    "1.14": _FASTER_US,
    "1.15": _FASTER_US,
    "1.16": _LOCKSTEP_US,
    "1.17": _FASTER_US,
}
"""How often each is worked out anew."""


class _Row(NamedTuple):
    message_id: int
    topic: Topic
    onboard_hz: float
    gcs_hz: float
    releases: tuple[Px4Release, ...] = ("1.13", "1.14", "1.15", "1.16", "1.17")


_OLD: tuple[Px4Release, ...] = ("1.13",)
_UTM: tuple[Px4Release, ...] = ("1.13", "1.14")
_MISSION: tuple[Px4Release, ...] = ("1.15", "1.16", "1.17")
_NEW: tuple[Px4Release, ...] = ("1.14", "1.15", "1.16", "1.17")
_ROWS = (
    _Row(mavlink.MAVLINK_MSG_ID_HEARTBEAT, Topic.ANY_TICK, 1, 1),
    _Row(mavlink.MAVLINK_MSG_ID_TIMESYNC, Topic.ANY_TICK, 10, OFF_HZ),
    _Row(mavlink.MAVLINK_MSG_ID_HIGHRES_IMU, Topic.IMU, 50, OFF_HZ),
    _Row(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, Topic.POSITION, 30, 50),
    _Row(mavlink.MAVLINK_MSG_ID_ATTITUDE, Topic.ATTITUDE, 100, 50),
    _Row(mavlink.MAVLINK_MSG_ID_ALTITUDE, Topic.ANY_TICK, 10, 1),
    _Row(mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR, Topic.DISTANCE, 10, 0.5),
    _Row(mavlink.MAVLINK_MSG_ID_ODOMETRY, Topic.POSITION, 30, OFF_HZ),
    _Row(mavlink.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET, Topic.OUTPUTS, 10, OFF_HZ, _OLD),
    _Row(mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, Topic.ATTITUDE, 50, 50),
    _Row(mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, Topic.POSITION, 10, 50),
    _Row(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, Topic.POWER, 0.5, 0.5),
    _Row(mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS, Topic.POSITION, 1, 0.5),
    _Row(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, Topic.ANY_TICK, 5, 1),
    _Row(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, Topic.POSITION, 50, 50),
    _Row(mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, Topic.GPS, UNLIMITED_HZ, 1),
    _Row(mavlink.MAVLINK_MSG_ID_HOME_POSITION, Topic.ANY_TICK, 0.5, 0.5),
    _Row(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, Topic.ANY_TICK, 1, 1, _MISSION),
    _Row(mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION, Topic.GPS, 1, 1, _NEW),
    _Row(mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM, Topic.GPS, 1, 1, _NEW),
    _Row(mavlink.MAVLINK_MSG_ID_PING, Topic.ANY_TICK, 1, 0.1),
    _Row(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT, Topic.ANY_TICK, 10, 1),
    _Row(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED, Topic.POSITION, 10, 50),
    _Row(mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE, Topic.DISTANCE, 1, 1, _NEW),
    _Row(mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, Topic.OUTPUTS, 10, 50),
    _Row(mavlink.MAVLINK_MSG_ID_SYS_STATUS, Topic.POWER, 5, 1),
    _Row(mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, Topic.ANY_TICK, 1, OFF_HZ),
    _Row(mavlink.MAVLINK_MSG_ID_UTM_GLOBAL_POSITION, Topic.POSITION, 1, 0.5, _UTM),
    _Row(mavlink.MAVLINK_MSG_ID_VFR_HUD, Topic.POSITION, 10, 4),
    _Row(mavlink.MAVLINK_MSG_ID_VIBRATION, Topic.VIBRATION, 0.5, 0.1),
    _Row(mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS, Topic.OUTPUTS, OFF_HZ, OFF_HZ),
)
"""Every stream of the mock, in the order in which one tick sends them (that of the onboard link)."""

# fmt: off
_UNSENT = frozenset({
    8, 26, 49, 62, 65, 69, 76, 93, 106, 112, 115, 116, 124, 129, 138, 148, 149, 192, 225, 233, 235, 246, 247, 250, 251,
    253, 254, 261, 263, 264, 265, 280, 281, 284, 285, 286, 290, 291, 300, 330, 332, 339, 350, 360, 370, 395, 397, 12920,
})
_UNSENT_NEW = _UNSENT | {380, 411, 435, 436, 437, 12918}
# fmt: on
"""Ids of the other streams of PX4 1.13.3 (streams_list in mavlink_messages.cpp), and of 1.16, which the mock does not
send unasked."""


def topics_us(release: Px4Release, limits: StreamsConfig) -> dict[Topic, int]:
    """How often each topic is worked out anew, in us; the limits override what the release does."""
    periods_us = dict(_TOPICS_US[release])
    if limits.max_attitude_hz != "auto":
        periods_us[Topic.ATTITUDE] = round(1e6 / limits.max_attitude_hz)
    if limits.max_position_hz != "auto":
        periods_us[Topic.POSITION] = round(1e6 / limits.max_position_hz)
    return periods_us


def streams_of(kind: PortKind, release: Px4Release, limits: StreamsConfig) -> Streams:
    """The streams of a link at boot."""
    periods_us = topics_us(release, limits)
    kinds = [
        StreamKind(row.message_id, row.onboard_hz if kind == "onboard" else row.gcs_hz, periods_us[row.topic])
        for row in _ROWS
        if release in row.releases
    ]
    return Streams(kinds, _UNSENT if release == "1.13" else _UNSENT_NEW)
