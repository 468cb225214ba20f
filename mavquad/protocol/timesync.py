"""TIMESYNC (MAVLink 111): asking the vehicle for its time, and answering when it asks.

A question has tc1 = 0 and the asker's time in ts1; the answer repeats ts1 and puts the other's time into tc1, both in ns.
PX4 and ArduPilot answer with the time since boot, which is also that of time_boot_ms. An answer counts if it is to a
question of ours and the first to it, so that what others ask on the same link, copies and forgeries say nothing.
"""

from __future__ import annotations

from collections import deque

from mavquad.endpoint import GRID_US, NEVER_US
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.vehicle_clock import Exchange, VehicleClock

PERIOD_US = 100_000
"""Between two questions. A simulator that stalls steps its clock, and poses look old until the next answer."""
ROUND_TRIPS = 5
QUESTIONS_MAX = 64
AGE_MAX_US = 10_000_000
"""A stamp that seems older is not of the clock that answers (a reboot that is not known yet; another time base)."""


class TimeSync:
    """The exchange and the clock that it tells.

    Attributes:
        clock: the vehicle's clock, with its drift, steps and reboots.
        latest_round_trip_us: of the latest answer; None before the first.
        strays: answers to nothing that was asked.
    """

    def __init__(self) -> None:
        self.clock = VehicleClock()
        self.latest_round_trip_us: int | None = None
        self._round_trips_us: deque[int] = deque(maxlen=ROUND_TRIPS)
        self.strays = 0
        self._asked_us: dict[int, int] = {}
        self._next_us = NEVER_US

    # ------------------------------------------------------------------ the exchange

    def start(self, now_us: int) -> None:
        """The vehicle is found: ask from now on; a deadline is later than the input that sets it."""
        self._next_us = now_us + GRID_US

    def stop(self) -> None:
        """Ask no more."""
        self._next_us = NEVER_US

    def next_deadline_us(self) -> int:
        """When to ask."""
        return self._next_us

    def on_deadline(self, now_us: int) -> Message | None:
        """The question, when its time has come."""
        if now_us < self._next_us:
            return None
        self._next_us = now_us + PERIOD_US
        self._asked_us[now_us * 1000] = now_us
        while len(self._asked_us) > QUESTIONS_MAX:
            del self._asked_us[next(iter(self._asked_us))]
        return mavlink.MAVLink_timesync_message(0, now_us * 1000)

    def on_message(self, message: Message, now_us: int) -> Message | None:
        """Take in a TIMESYNC of the vehicle; returns our answer if it asks."""
        if message.tc1 == 0:
            return mavlink.MAVLink_timesync_message(now_us * 1000, message.ts1)
        sent_us = self._asked_us.pop(message.ts1, None)
        if sent_us is None or message.tc1 < 0:
            self.strays += 1
            return None
        self.latest_round_trip_us = now_us - sent_us
        self._round_trips_us.append(self.latest_round_trip_us)
        self.clock.take(Exchange(sent_us, now_us, message.tc1 // 1000))
        return None

    # ------------------------------------------------------------------ what it tells

    @property
    def round_trip_us(self) -> int | None:
        """How long the link takes: the quickest of the latest `ROUND_TRIPS` answers, since one that was held up, by a busy
        computer at either end, says nothing about the link. None before the first."""
        return min(self._round_trips_us, default=None)

    @property
    def drift(self) -> float | None:
        """How much faster the vehicle's clock runs than ours, as a share: -0.013 loses 13 ms a second."""
        return None if self.clock.line is None else self.clock.line.drift

    def vehicle_us(self, our_us: int) -> int | None:
        """What the vehicle's clock showed at a time of ours."""
        line = self.clock.line
        return None if line is None else our_us + round(line.offset_us(our_us))

    def our_us(self, stamp_us: int) -> int | None:
        """When, on our time base, the vehicle's clock showed this."""
        line = self.clock.line
        if line is None:
            return None
        # vehicle = ours + level + drift (ours - at), solved for ours.
        return line.at_us + round((stamp_us - line.at_us - line.level_us) / (1.0 + line.drift))

    def age_us(self, stamp_us: int, now_us: int) -> int | None:
        """How old a measurement with this stamp of the vehicle's clock is; never negative.

        None: not known, or the stamp is not of the clock that answers. A stamp in whole ms (time_boot_ms) was cut, so
        that this is up to 1 ms too much.
        """
        taken_us = self.our_us(stamp_us)
        if taken_us is None or not -self.uncertainty_us(now_us) - PERIOD_US <= now_us - taken_us <= AGE_MAX_US:
            return None
        return max(0, now_us - taken_us)

    def uncertainty_us(self, now_us: int) -> int:
        """By how much an age may be wrong, either way; more the longer ago the last answer is. 0 while nothing is known.

        Half of the quickest round trip is part of it: which way is the slower one, no exchange tells.
        """
        line = self.clock.line
        return 0 if line is None else round(line.bound_us(now_us))
