"""Guards of the law itself: a disturbance it cannot bear, an observer that does not follow, an output that is no number."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pydantic import Field

from mavquad.endpoint import grid_us
from mavquad.flight.guard_types import GuardSection, Lasting, Tripped
from mavquad.flight_record import TraceRow
from mavquad.types import Depth


class SigmaParams(GuardSection):
    """[guards.sigma]: the disturbance that the observer estimates, the larger of its parts."""

    wind_m_s2: float = Field(default=25.0, ge=0.0, le=1000.0)
    """Acceleration that is not the thrust's, m/s^2, as far as the observer tells it apart; 0: off."""
    attitude_m_s2: float = Field(default=25.0, ge=0.0, le=1e6)
    """sigma of z, x, y at depth attitude, m/s^2; 0: off."""
    rate_m_s3: float = Field(default=0.0, ge=0.0, le=1e6)
    """The same at depth rate, m/s^3; 0: off."""
    torque_m_s4: float = Field(default=0.0, ge=0.0, le=1e6)
    """The same at depth torque, m/s^4; 0: off."""
    for_s: float = Field(default=0.5, ge=0.0, le=60.0)
    """How long it must last, s."""


class SigmaMonitor:
    """The disturbance in the rows of the law."""

    def __init__(self, params: SigmaParams) -> None:
        self._params = params
        self._limits: dict[Depth, tuple[float, str]] = {
            "attitude": (params.attitude_m_s2, "m/s^2"),
            "rate": (params.rate_m_s3, "m/s^3"),
            "torque": (params.torque_m_s4, "m/s^4"),
        }
        self._windy = Lasting(grid_us(params.for_s))
        self._disturbed = Lasting(grid_us(params.for_s))

    def take(self, row: TraceRow) -> Tripped | None:
        """The next row."""
        params, (limit, unit) = self._params, self._limits[row.depth]
        z, _, x, y = row.sigma
        wind_m_s2, sigma = math.hypot(*row.wind), math.hypot(x, y, z)
        if self._windy.holds(0.0 < params.wind_m_s2 < wind_m_s2, row.stamp_us):
            words = f"the wind accelerates it by {wind_m_s2:.1f} m/s^2, {params.wind_m_s2:g} allowed"
            return Tripped("sigma", words, params.reaction)
        if self._disturbed.holds(0.0 < limit < sigma, row.stamp_us):
            return Tripped("sigma", f"the disturbance is {sigma:.1f} {unit}, {limit:g} allowed", params.reaction)
        return None


class InnovationParams(GuardSection):
    """[guards.innovation]: what was measured less what the observer expected."""

    position_m: float = Field(default=0.5, ge=0.0, le=100.0)
    """Of the position, m; 0: off."""
    yaw_deg: float = Field(default=20.0, ge=0.0, le=180.0)
    """Of the yaw, deg; 0: off."""
    for_s: float = Field(default=0.3, ge=0.0, le=60.0)
    """How long it must last, s."""


class InnovationMonitor:
    """The innovation in the rows of the law: measured less estimated output, where the observer stands just behind it."""

    def __init__(self, params: InnovationParams) -> None:
        self._params = params
        self._off_place = Lasting(grid_us(params.for_s))
        self._off_course = Lasting(grid_us(params.for_s))

    def take(self, row: TraceRow) -> Tripped | None:
        """The next row."""
        params = self._params
        (z, yaw_rad, x, y), (of_z, of_yaw, of_x, of_y) = row.measured, row.zeta_hat
        distance_m, yaw_deg = math.hypot(x - of_x[0], y - of_y[0], z - of_z[0]), math.degrees(abs(yaw_rad - of_yaw[0]))
        if self._off_place.holds(0.0 < params.position_m < distance_m, row.stamp_us):
            return self._tripped(f"by {distance_m:.2f} m, {params.position_m:g} allowed")
        if self._off_course.holds(0.0 < params.yaw_deg < yaw_deg, row.stamp_us):
            return self._tripped(f"by {yaw_deg:.0f} degrees of yaw, {params.yaw_deg:g} allowed")
        return None

    def _tripped(self, words: str) -> Tripped:
        return Tripped("innovation", f"the observer does not follow what is measured: {words}", self._params.reaction)


class NanParams(GuardSection):
    """[guards.nan]: an output of the law that is no number is never sent; only the reaction can be chosen."""


def no_number(params: NanParams, controls: Iterable[float]) -> Tripped | None:
    """The law's output holds NaN or infinity, and must not be sent.

    Args:
        params: what is done about it.
        controls: what would go on the wire.
    """
    if all(map(math.isfinite, controls)):
        return None
    return Tripped("NaN", "the law's output holds a value that is not a number", params.reaction)
