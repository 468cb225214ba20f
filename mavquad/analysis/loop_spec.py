"""What the linear analysis is told of one channel: the law's own numbers, the clock that it is stepped by, the true plant.

Time is cut into ticks of the faster of the streams that concern the channel. Position may come every n-th tick, and at
measurement set position_yaw, where the position steps the law, yaw is measured between commands; n ticks are one beat,
after which everything repeats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import ACCELERATION, ChannelTuning, tuning
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

Kind = Literal["vertical", "horizontal", "yaw"]
KINDS: tuple[Kind, ...] = ("vertical", "horizontal", "yaw")
"""z; x and y; yaw."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of white noise, of each sample: those of the mock's estimator, which took PX4's for a model."""

    position_m: float = 0.003
    velocity_m_s: float = 0.01
    angle_rad: float = math.radians(0.1)
    """Roll, pitch and yaw."""
    rate_rad_s: float = 0.01
    """Body rates."""

    def of_rows(self, kind: Kind) -> tuple[float, ...]:
        """Of zeta_1 .. zeta_4, in m/s^i or rad/s^i.

        Roll and pitch turn the thrust g sideways; level, they leave its vertical part alone to first order.
        """
        if kind == "yaw":
            return (self.angle_rad, self.rate_rad_s)
        level = (0.0, 0.0) if kind == "vertical" else (GRAVITY_M_S2 * self.angle_rad, GRAVITY_M_S2 * self.rate_rad_s)
        return (self.position_m, self.velocity_m_s, *level)


@dataclass(frozen=True, slots=True)
class Path:
    """What really stands between a measurement and the plant, as opposed to what the law is told of it."""

    delay_s: float
    """From the stamp of a measurement until the command that was computed from it arrives."""
    dead_time_s: float
    lag_s: float


@dataclass(frozen=True, slots=True)
class Beat:
    """The clock of one channel.

    Attributes:
        tick_us: spacing of the faster stream.
        ticks: how many make a beat.
        command_every: ticks from one command to the next.
        output_every: ticks from one measurement of position and velocity (or of yaw) to the next; attitude and rates
            come with every tick.
    """

    tick_us: int
    ticks: int = 1
    command_every: int = 1
    output_every: int = 1


@dataclass(frozen=True, slots=True)
class LoopSpec:
    """One channel's loop.

    Attributes:
        kind: which channel.
        depth: of the law's command.
        tune: chain, rows, gammas, integrators and prediction, as the law flies them.
        delay_us: what the law takes for the delay.
        state_feedback: eq. (6) instead of the observer.
        beat: the clock.
        path: what is true.
        noise: standard deviation of zeta_1, zeta_2, ... where measured.
    """

    kind: Kind
    depth: Depth
    tune: ChannelTuning
    delay_us: int
    state_feedback: bool
    beat: Beat
    path: Path
    noise: tuple[float, ...]

    @property
    def integrators(self) -> int:
        """How many the law has before this input; roll and pitch go out as they are."""
        return 0 if self.kind == "horizontal" else self.tune.integrators

    @property
    def plant_length(self) -> int:
        """States of the plant without those that the law integrates itself."""
        return self.tune.spec.length - self.integrators

    @property
    def measured(self) -> tuple[int, ...]:
        """Which states of the chain are measured, the output's first, counted from 0."""
        if self.state_feedback:
            return tuple(range(self.tune.spec.length))
        return tuple(row.index for row in self.tune.spec.rows)

    @property
    def bandwidth_rad_s(self) -> float:
        """Geometric mean of the moduli of the law's poles: omega0."""
        return math.exp(math.log(self.tune.gammas[0]) / len(self.tune.gammas))

    def every(self, index: int) -> int:
        """Ticks between measurements of a state."""
        fast = index >= ACCELERATION and self.kind != "yaw"
        return 1 if fast or self.state_feedback else self.beat.output_every


def loop_spec(
    law: LawParams,
    depth: Depth,
    kind: Kind,
    streams: StreamParams,
    path: Path | None = None,
    noise: Noise | None = None,
) -> LoopSpec:
    """The loop of one channel.

    Args:
        law: the law.
        depth: where it acts.
        kind: which channel.
        streams: rates of position and attitude; the attitude steps the law where the measurement set has its rows.
        path: what is true; what the law is told, if not given.
        noise: of the measurements.
    """
    tune = tuning(law, depth)
    channel: ChannelTuning = getattr(tune, kind)
    told = Path(tune.delay_us * 1e-6, channel.spec.dead_us * 1e-6, channel.spec.lag_s)
    return LoopSpec(
        kind=kind,
        depth=depth,
        tune=channel,
        delay_us=tune.delay_us,
        state_feedback=tune.state_feedback,
        beat=beat(kind, law.measured() != "position_yaw", streams),
        path=path or told,
        noise=(noise or Noise()).of_rows(kind),
    )


def beat(kind: Kind, attitude_steps: bool, streams: StreamParams) -> Beat:
    """The clock of a channel; ratios of the rates are rounded to whole ticks.

    Where the attitude steps the law, positions that come faster than it count as coming with it.
    """
    position_us, attitude_us = (round(1e6 / hz) for hz in (streams.position_hz, streams.attitude_hz))
    slower = max(1, round(position_us / attitude_us))
    if attitude_steps:
        return Beat(attitude_us) if kind == "yaw" else Beat(attitude_us, slower, 1, slower)
    if kind != "yaw":
        return Beat(position_us)
    if slower > 1:
        return Beat(attitude_us, slower, slower, 1)
    yaw_slower = max(1, round(attitude_us / position_us))
    return Beat(position_us, yaw_slower, 1, yaw_slower)
