"""What the vehicle says of itself, as last heard. HEARTBEAT tells the truth about mode and arming, up to a second late."""

from __future__ import annotations

from collections import deque

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.firmware import PX4, Firmware, Mode
from mavquad.protocol.streams import StreamMonitor

PREARM_OK = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
RC_RECEIVER = 0x10000  # MAV_SYS_STATUS_SENSOR_RC_RECEIVER
TEXTS_KEPT = 3
ROUND_TRIPS_KEPT = 64
TEXT_MATTERS_US = 3_000_000


class Vehicle:
    """The last word of the vehicle on each thing.

    Attributes:
        firmware: what flies it; PX4 until it is known.
        mode: from HEARTBEAT, None before the first.
        armed: from HEARTBEAT.
        reported: whether a SYS_STATUS has been heard.
        prearm_ok: whether its own pre-arm checks pass (SYS_STATUS).
        transmitter: whether a transmitter is heard (SYS_STATUS).
        on_ground_since_us: since when EXTENDED_SYS_STATE has shown it on the ground; NEVER_US while it does not.
        round_trips_us: of the last TIMESYNCs that it answered.
        streams: arrivals of the pose messages.
    """

    def __init__(self) -> None:
        self.firmware: Firmware = PX4
        self.mode: Mode | None = None
        self.armed = False
        self.reported = False
        self.prearm_ok = False
        self.transmitter = False
        self.on_ground_since_us = NEVER_US
        self.round_trips_us: deque[int] = deque(maxlen=ROUND_TRIPS_KEPT)
        self.streams = {"ATTITUDE": StreamMonitor(), "LOCAL_POSITION_NED": StreamMonitor()}
        self._texts: deque[tuple[int, str]] = deque(maxlen=TEXTS_KEPT)

    @property
    def on_ground(self) -> bool:
        """Whether EXTENDED_SYS_STATE shows it on the ground."""
        return self.on_ground_since_us != NEVER_US

    @property
    def mode_name(self) -> str:
        """Name of the mode, "" before the first HEARTBEAT."""
        return self.mode.name if self.mode else ""

    @property
    def round_trip_s(self) -> float | None:
        """The median of the last round trips; None before one was measured."""
        return sorted(self.round_trips_us)[len(self.round_trips_us) // 2] * 1e-6 if self.round_trips_us else None

    def take_heartbeat(self, message: Message) -> Mode | None:
        """Take in a HEARTBEAT; returns the mode if it is another one than before."""
        before = self.mode
        self.mode = self.firmware.mode(message.custom_mode)
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        return self.mode if self.mode != before else None

    def take_sys_status(self, message: Message) -> None:
        """Take in a SYS_STATUS."""
        self.reported = True
        health = message.onboard_control_sensors_health
        self.prearm_ok = bool(health & PREARM_OK)
        self.transmitter = bool(health & RC_RECEIVER)

    def take_extended_state(self, message: Message, now_us: int) -> None:
        """Take in an EXTENDED_SYS_STATE."""
        if message.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND:
            self.on_ground_since_us = NEVER_US
        else:
            self.on_ground_since_us = min(self.on_ground_since_us, now_us)

    def take_text(self, message: Message, now_us: int) -> str:
        """Take in a STATUSTEXT; returns it without the tab that PX4 1.13 ends its texts with."""
        text = str(message.text).strip()
        self._texts.append((now_us, text))
        return text

    def said(self, since_us: int, now_us: int) -> str:
        """Its last texts, those of the last seconds or after `since_us`: the ones that may explain what happens now."""
        since_us = min(since_us, now_us - TEXT_MATTERS_US)
        return "; ".join(text for stamp_us, text in self._texts if stamp_us >= since_us)
