"""The lockstep driver: two endpoints in virtual time, as fast as the machine can, every byte packed and parsed.

The link between them is ideal here; delay, jitter and loss belong to an endpoint that wraps one of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from mavquad.drivers.collector import without_collector
from mavquad.drivers.runner import Recorder, Runner
from mavquad.endpoint import NEVER_US, Endpoint

START_US = 1_577_836_800_000_000
"""Virtual time starts on 2020-01-01, so that the same seed gives the same bytes, stamps included."""


class Lockstep:
    """Two endpoints and what is on its way between them.

    Attributes:
        near: the recorded end (the agent).
        far: the other end (the mock autopilot and its link).
        now_us: virtual time.
    """

    def __init__(self, near: Endpoint, far: Endpoint, recorder: Recorder | None = None) -> None:
        self._to_near: deque[bytes] = deque()
        self._to_far: deque[bytes] = deque()
        self.now_us = START_US
        to_near, to_far = self._to_near.append, self._to_far.append
        self.near = Runner(near, START_US, lambda _stamp_us, data: to_far(data), recorder)
        self.far = Runner(far, START_US, lambda _stamp_us, data: to_near(data))

    def run(self, until: Callable[[], bool], limit_s: float) -> None:
        """Run until the condition holds or `limit_s` of virtual time has passed since the start."""
        limit_us = START_US + round(limit_s * 1e6)
        with without_collector():
            while not until() and self.now_us < limit_us:
                self.step()

    def step(self) -> None:
        """Move on to the next deadline of either end and carry over what it sends."""
        near, far = self.near, self.far
        next_one = far if far.deadline_us <= near.deadline_us else near
        if next_one.deadline_us > self.now_us:
            self.now_us = next_one.deadline_us
            assert self.now_us < NEVER_US, "both ends wait for ever"
        next_one.advance(self.now_us)
        if self._to_near or self._to_far:
            self._carry()

    def command(self, name: str, act: Callable[..., None], *args: float | str) -> None:
        """An operator's command to the near end, now."""
        self.near.command(name, act, self.now_us, args)
        self._carry()

    def _carry(self) -> None:
        to_near, to_far, now_us = self._to_near, self._to_far, self.now_us
        while to_near or to_far:
            while to_near:
                self.near.datagram(to_near.popleft(), now_us)
            if to_far:
                self.far.datagram(to_far.popleft(), now_us)

    def end(self) -> None:
        """Record the end."""
        self.near.end(self.now_us)
