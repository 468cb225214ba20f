"""Who is there: a ground station, by its HEARTBEATs, and a pilot, by MANUAL_CONTROL."""

from __future__ import annotations

from collections.abc import Callable

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.px4.settings import Settings

_INFO: int = mavlink.MAV_SEVERITY_INFO
_US_PER_S = 1e6


class Links:
    """Attributes: `has_ground_station` and `has_sticks` now, `had_sticks` since boot. None of them at boot."""

    def __init__(self, say: Callable[[int, str], None], is_113: bool) -> None:
        self._say = say
        self._regained = "Data link regained" if is_113 else "GCS connection regained"
        self._ground_station_us = 0
        self._sticks_us = 0
        self._had_ground_station = False
        self._has_transmitter = False
        self.has_ground_station = False
        self.has_sticks = False
        self.had_sticks = False

    def ground_station_heard(self, boot_us: int) -> None:
        """A HEARTBEAT of a ground station came in."""
        self._ground_station_us = boot_us
        if not self.has_ground_station and self._had_ground_station:
            self._say(_INFO, self._regained)
        self.has_ground_station = self._had_ground_station = True

    def sticks_heard(self, boot_us: int) -> None:
        """The pilot's sticks came in."""
        self._sticks_us = boot_us
        self.has_sticks = self.had_sticks = True

    def transmitter_found(self) -> None:
        """A pilot with a radio transmitter is there, for good."""
        self.has_sticks = self.had_sticks = self._has_transmitter = True

    def step(self, settings: Settings, boot_us: int) -> None:
        """Notice who is gone."""
        if self.has_ground_station and boot_us - self._ground_station_us > settings.com_dl_loss_t * _US_PER_S:
            self.has_ground_station = False
            self._say(_INFO, "Connection to ground station lost")
        if (
            self.has_sticks
            and not self._has_transmitter
            and boot_us - self._sticks_us > settings.com_rc_loss_t * _US_PER_S
        ):
            self.has_sticks = False
            self._say(mavlink.MAV_SEVERITY_CRITICAL, "Manual control lost")
