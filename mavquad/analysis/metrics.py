"""How well a flight was flown: what `summary.json` says of its errors.

The error is the measured (or true) output minus its reference, in the order z, yaw, x, y (NWU), over the time that the
law is in control. The first seconds, the hand-over, count for the settling time only.
"""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from dataclasses import asdict, dataclass

from mavquad.flight_record import TraceRow
from mavquad.frames import wrap_pi
from mavquad.types import Vec4

LEFT_OUT_S = 5.0
SETTLED_POSITION_M = 0.05
SETTLED_YAW_RAD = math.radians(3.0)
SETTLED_FOR_S = 3.0


@dataclass(frozen=True, slots=True)
class ErrorSample:
    """The error `t_s` seconds after the law took control: z (m), yaw (rad, wrapped), x, y (m), NWU."""

    t_s: float
    error: Vec4

    @property
    def position_m(self) -> float:
        """Norm of the position error in three dimensions."""
        return math.hypot(self.error[0], self.error[2], self.error[3])

    @property
    def yaw_rad(self) -> float:
        """The heading error."""
        return self.error[1]


@dataclass(frozen=True, slots=True)
class FlightMetrics:
    """Figures of one flight; None where the flight was too short to tell, or an error was not a number.

    Attributes:
        position_rms_m: root mean square of the 3-D position error, first 5 s left out.
        position_max_m: the largest 3-D position error, first 5 s left out.
        yaw_rms_rad: root mean square of the heading error, first 5 s left out.
        settle_s: when the error came to stay within 5 cm and 3 degrees for 3 s, since the law took control; None if never.
    """

    position_rms_m: float | None
    position_max_m: float | None
    yaw_rms_rad: float | None
    settle_s: float | None

    def to_json(self) -> dict[str, float | None]:
        """As `summary.json` keeps it."""
        return asdict(self)


def error_samples(rows: Sequence[TraceRow], phases: Container[str] | None = None) -> list[ErrorSample]:
    """Errors of a trace, by default of all its rows; `phases` picks those in which the law is in control."""
    chosen = [row for row in rows if phases is None or row.phase in phases]
    return [ErrorSample((row.stamp_us - chosen[0].stamp_us) * 1e-6, trace_error(row)) for row in chosen]


def trace_error(row: TraceRow) -> Vec4:
    """Measured minus reference of one row: z (m), yaw (rad, wrapped), x, y (m)."""
    z, yaw, x, y = (measured - wanted for measured, wanted in zip(row.measured, row.reference, strict=True))
    return (z, wrap_pi(yaw), x, y)


def flight_metrics(samples: Sequence[ErrorSample]) -> FlightMetrics:
    """Metrics of the time that the law is in control; `samples` are in the order of time."""
    counted = [sample for sample in samples if sample.t_s >= LEFT_OUT_S]
    positions_m = [sample.position_m for sample in counted]
    return FlightMetrics(
        position_rms_m=root_mean_square(positions_m),
        position_max_m=_largest(positions_m),
        yaw_rms_rad=root_mean_square([sample.yaw_rad for sample in counted]),
        settle_s=settling_time_s(samples),
    )


def settling_time_s(samples: Sequence[ErrorSample]) -> float | None:
    """When the first settled stretch of `SETTLED_FOR_S` began; None if there is none.

    "To the end of the flight" would let one gust, or one leg, half an hour later decide about the hand-over.
    """
    since_s: float | None = None
    for sample in samples:
        if not _is_settled(sample):
            since_s = None
            continue
        since_s = sample.t_s if since_s is None else since_s
        if sample.t_s - since_s >= SETTLED_FOR_S:
            return since_s
    return None


def root_mean_square(values: Sequence[float]) -> float | None:
    """Root of the mean square; None of nothing, or where a value is not finite."""
    if not values or not all(map(math.isfinite, values)):
        return None
    return math.sqrt(math.fsum(value * value for value in values) / len(values))


def _largest(values: Sequence[float]) -> float | None:
    return max(values) if values and all(map(math.isfinite, values)) else None


def _is_settled(sample: ErrorSample) -> bool:
    return sample.position_m <= SETTLED_POSITION_M and abs(sample.yaw_rad) <= SETTLED_YAW_RAD
