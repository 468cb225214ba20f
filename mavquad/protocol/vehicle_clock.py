"""The vehicle's clock on our time base: a line through what exchanges of time stamps prove.

A question left us at `sent` and its answer was here at `received`; in between the vehicle's clock showed V. So, whatever
the delays were, at the middle of the two the vehicle was ahead of us by

    offset = V - (sent + received) / 2     within  +- half = (received - sent) / 2.

Over the latest exchanges a line offset(t) = level + drift (t - newest) is fitted by least squares. One that took long may
err by more, by as much as it took longer than the quickest: its weight is 1 / (floor + half - least half)^2. That is
what makes the fit robust: an outlier is slow, and what is slow weighs nothing. The drift has a prior, which counts while
the exchanges span no time.

With a constant drift the bounds are proofs, not statistics, also for a link that is slower one way than the other:
    |drift error| <= sum |s_i| half_i + shrink |prior's|,   s_i: weight of the i-th offset in the drift;
                                                            shrink: that of the prior
    |level error| <= min over i of (half_i + |residual_i| + |t_i| |drift error|).
An exchange that contradicts them proves that the clock has stepped, or changed its pace: a simulator in lockstep stands
still while its host is busy. The level starts again from that exchange then, and the drift goes on as the prior. A
clock that shows less than an answer that was here before the question left has started again.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from operator import mul
from typing import NamedTuple

EXCHANGES_MAX = 64
FLOOR_US, FLOOR_SHARE = 100.0, 0.1
"""What the quickest exchanges are taken to err by: so much, and this share of the least half."""
DRIFT_MAX = 0.5
"""No clock is taken to be further off the pace: a simulator on a busy computer may run at half speed."""
STEP_MAX_US = 1_000_000
"""A greater step than this is another clock: nothing that was known about the drift counts."""


class Prior(NamedTuple):
    """What is taken for known of the drift before exchanges tell: its mean, standard deviation, and greatest error."""

    drift: float
    sd: float
    bound: float


UNKNOWN = Prior(0.0, 0.02, DRIFT_MAX)
"""Real PX4 SITL in lockstep drifts by 0.01 to 0.025, crystals by 1e-4."""
AFTER_STEP_SD, AFTER_STEP_BOUND = 0.005, 0.05
"""Of the drift before a step, if that was known better than `UNKNOWN`."""


class Exchange:
    """One question and its answer: our clock at both, and the vehicle's in between.

    Attributes:
        middle_us: when on our clock the vehicle's showed `vehicle_us`, within `half_us`.
        half_us: half of the round trip.
    """

    __slots__ = ("half_us", "middle_us", "received_us", "sent_us", "vehicle_us")

    def __init__(self, sent_us: int, received_us: int, vehicle_us: int) -> None:
        self.sent_us, self.received_us, self.vehicle_us = sent_us, received_us, vehicle_us
        self.middle_us = (sent_us + received_us) // 2
        self.half_us = (received_us - sent_us) / 2


@dataclass(frozen=True, slots=True)
class Line:
    """vehicle - ours = level + drift (t - at), both with the bounds of their errors; times in us."""

    at_us: int
    level_us: float
    drift: float
    level_bound_us: float
    drift_bound: float

    def offset_us(self, our_us: int) -> float:
        """How far the vehicle's clock is ahead of ours."""
        return self.level_us + self.drift * (our_us - self.at_us)

    def bound_us(self, our_us: int) -> float:
        """By how much that may be wrong."""
        return self.level_bound_us + self.drift_bound * abs(our_us - self.at_us)


class VehicleClock:
    """The filter. Feed it exchanges; ask it for times.

    Attributes:
        line: the clock as it is now known; None before the first exchange.
        reboots: how often the clock has started again.
        steps: how often it has stepped, or changed its pace, by more than exchanges can err.
    """

    def __init__(self) -> None:
        self.line: Line | None = None
        self.reboots = 0
        self.steps = 0
        self._exchanges: deque[Exchange] = deque(maxlen=EXCHANGES_MAX)
        self._newest_us = 0
        self._prior = UNKNOWN

    def forget(self) -> None:
        """Nothing is known about the clock any more."""
        self._exchanges.clear()
        self._newest_us = 0
        self._prior = UNKNOWN
        self.line = None

    def take(self, exchange: Exchange) -> None:
        """Take in an exchange; answers may overtake each other."""
        if self._newest_us > exchange.vehicle_us and any(_went_back(before, exchange) for before in self._exchanges):
            self.reboots += 1
            self.forget()
        elif self.line is not None:
            self._notice_step(self.line, exchange)
        self._exchanges.append(exchange)
        self._newest_us = max(self._newest_us, exchange.vehicle_us)
        self.line = _fit(self._exchanges, self._prior)

    @property
    def least_round_trip_us(self) -> int | None:
        """That of the quickest of the latest exchanges."""
        return min((round(2 * each.half_us) for each in self._exchanges), default=None)

    def _notice_step(self, line: Line, exchange: Exchange) -> None:
        step_us = exchange.vehicle_us - exchange.middle_us - line.offset_us(exchange.middle_us)
        if abs(step_us) <= exchange.half_us + line.bound_us(exchange.middle_us) + 1.0:
            return
        self.steps += 1
        self.forget()
        if abs(step_us) <= STEP_MAX_US and line.drift_bound < UNKNOWN.sd:
            self._prior = Prior(line.drift, AFTER_STEP_SD, AFTER_STEP_BOUND)


def _went_back(before: Exchange, exchange: Exchange) -> bool:
    return exchange.sent_us >= before.received_us and exchange.vehicle_us < before.vehicle_us


def _fit(exchanges: deque[Exchange], prior: Prior) -> Line:
    """Weighted least squares with a prior on the drift; numbers relative to the newest exchange, or they lose digits."""
    middles = [each.middle_us for each in exchanges]
    halves = [each.half_us for each in exchanges]
    at_us, least_us = max(middles), min(halves)
    zero_us = exchanges[-1].vehicle_us - exchanges[-1].middle_us
    floor_us = FLOOR_US + FLOOR_SHARE * least_us - least_us
    weights = [1.0 / (floor_us + half) ** 2 for half in halves]
    times = [float(middle_us - at_us) for middle_us in middles]
    offsets = [
        each.vehicle_us - each.middle_us - zero_us - prior.drift * t for each, t in zip(exchanges, times, strict=True)
    ]
    total = sum(weights)
    mean_time = sum(map(mul, weights, times)) / total
    mean_offset = sum(map(mul, weights, offsets)) / total
    leans = [w * (t - mean_time) for w, t in zip(weights, times, strict=True)]
    spread = sum(map(mul, leans, times)) + prior.sd**-2
    further = sum(map(mul, leans, offsets)) / spread
    further = min(max(further, -DRIFT_MAX - prior.drift), DRIFT_MAX - prior.drift)
    level = mean_offset - further * mean_time
    drift_bound = (sum(map(mul, map(abs, leans), halves)) + prior.sd**-2 * prior.bound) / spread
    level_bound = min(
        [
            half + abs(y - level - further * t) - drift_bound * t
            for half, y, t in zip(halves, offsets, times, strict=True)
        ]
    )
    return Line(at_us, zero_us + level, prior.drift + further, level_bound, drift_bound)
