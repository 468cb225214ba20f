"""Guards of the link: frames lost, a round trip that takes too long, a ground station that is gone."""

from __future__ import annotations

from collections import deque

from pydantic import Field

from mavquad.endpoint import GRID_US, NEVER_US, grid_us
from mavquad.flight.guard_types import GuardSection, Tripped

_HALF_CIRCLE = 128
_SEEN = (1 << _HALF_CIRCLE) - 1
_STEPS = 20
"""A window slides by this part of itself."""
_LEAST_FRAMES = 20
"""Fewer frames than this in a window say nothing of a share."""


class LinkLossParams(GuardSection):
    """[guards.link_loss]"""

    share: float = Field(default=0.6, ge=0.0, lt=1.0)
    """Share of the vehicle's frames that are lost, by their sequence numbers; 0: off."""
    window_s: float = Field(default=2.0, gt=0.1, le=60.0)
    """Over this long, s."""
    round_trip_s: float = Field(default=0.5, ge=0.0, le=10.0)
    """A round trip (TIMESYNC) that takes longer, three times in a row, s; 0: off."""
    slower_s: float = Field(default=0.2, ge=0.0, le=10.0)
    """A round trip that takes this much longer than they did when the law took over, five times in a row, s; 0: off. The
    law's margin of delay is 0.04 to 0.09 s, and what it asks for too late shakes the vehicle within two seconds."""


class LinkLossMonitor:
    """Counts the frames of one sender that came, and those that should have.

    A frame that comes late is no longer lost, one that comes twice is one. A frame of a message that this side does not
    know is not handed in and counts as lost: of real PX4 it is one of 300.
    """

    def __init__(self, params: LinkLossParams) -> None:
        self._params = params
        self._newest = -1
        self._seen = 0
        self._expected = 0
        self._came = 0
        self._window_us = grid_us(params.window_s)
        self._marks: deque[tuple[int, int, int]] = deque()
        self._slow = 0
        self._slower = 0
        self._usual_s: float | None = None

    def start(self, round_trip_s: float) -> None:
        """The law takes over; a round trip took so long just before, the median."""
        self._usual_s = round_trip_s

    def take(self, sequence: int, now_us: int) -> Tripped | None:
        """The next frame of the vehicle, by its sequence number."""
        self._count(sequence)
        if self._marks and (now_us - self._marks[-1][0]) * _STEPS < self._window_us:
            return None
        self._marks.append((now_us, self._expected, self._came))
        while len(self._marks) > 1 and self._marks[1][0] <= now_us - self._window_us:
            self._marks.popleft()
        stamp_us, expected, came = self._marks[0]
        expected, came = self._expected - expected, self._came - came
        is_whole = stamp_us <= now_us - self._window_us and expected >= _LEAST_FRAMES
        share = 1.0 - came / expected if is_whole else 0.0
        if not 0.0 < self._params.share < share:
            return None
        words = f"{100 * share:.0f} % of the frames are lost, {100 * self._params.share:g} % allowed"
        return Tripped("link loss", words, self._params.reaction)

    def _count(self, sequence: int) -> None:
        ahead = (sequence - self._newest) % 256 if self._newest >= 0 else 1
        if 0 < ahead <= _HALF_CIRCLE:
            self._newest = sequence
            self._expected += ahead
            self._came += 1
            self._seen = (self._seen << ahead | 1) & _SEEN
            return
        bit = 1 << (-ahead % 256)
        if not self._seen & bit:
            self._seen |= bit
            self._came += 1

    def take_round_trip(self, round_trip_us: int) -> Tripped | None:
        """The next answer to a TIMESYNC of ours."""
        limit_s, seconds = self._params.round_trip_s, round_trip_us * 1e-6
        self._slow = self._slow + 1 if 0.0 < limit_s < seconds else 0
        if self._slow >= 3:
            words = f"a round trip over the link takes {seconds:.2f} s, {limit_s:g} allowed"
            return Tripped("link loss", words, self._params.reaction)
        return self._take_slower(seconds)

    def _take_slower(self, seconds: float) -> Tripped | None:
        usual_s, slower_s = self._usual_s, self._params.slower_s
        is_slower = usual_s is not None and 0.0 < slower_s < seconds - usual_s
        self._slower = self._slower + 1 if is_slower else 0
        if usual_s is None or self._slower < 5:
            return None
        words = f"a round trip over the link takes {seconds:.2f} s, {usual_s + slower_s:.2f} allowed"
        return Tripped("link loss", words, self._params.reaction)


class GcsLossParams(GuardSection):
    """[guards.gcs_loss]"""

    silent_s: float = Field(default=0.0, ge=0.0, le=600.0)
    """No HEARTBEAT of a ground station (MAV_TYPE_GCS) other than ours for this long, s; 0: off. The autopilot must forward
    them to our link (ArduPilot does; PX4 with MAV_x_FORWARD)."""


class GcsLossMonitor:
    """When a ground station was last heard."""

    def __init__(self, params: GcsLossParams) -> None:
        self._params = params
        self._silent_us = grid_us(params.silent_s)
        self._heard_us: int | None = None
        self._deadline_us = NEVER_US
        self._begun_us = NEVER_US

    @property
    def is_missing(self) -> bool:
        """Whether one is wanted and none was ever heard."""
        return self._silent_us > 0 and self._heard_us is None

    def start(self, now_us: int) -> None:
        """The law takes over: from now on it must be there."""
        self._begun_us = now_us
        self._wait(now_us if self._heard_us is None else self._heard_us)

    def heard(self, now_us: int) -> None:
        """A HEARTBEAT of a ground station that is not us."""
        self._heard_us = now_us
        self._wait(now_us)

    def _wait(self, since_us: int) -> None:
        if self._silent_us and self._begun_us != NEVER_US:
            # A deadline is never in the past: there, one that was silent for long trips at once.
            self._deadline_us = max(since_us + self._silent_us, self._begun_us + GRID_US)

    def next_deadline_us(self) -> int:
        """When the silence will have been too long; NEVER_US once it has been told, until one is heard again."""
        return self._deadline_us

    def check(self, now_us: int) -> Tripped | None:
        """Whether it has been."""
        if now_us < self._deadline_us:
            return None
        self._deadline_us = NEVER_US
        words = f"no ground station's HEARTBEAT for {self._params.silent_s:g} s"
        return Tripped("GCS loss", words, self._params.reaction)
