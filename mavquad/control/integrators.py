"""The two integrators before thrust and yaw (paper, step 2: u_d = rho, rho_d = v), with limits that cannot wind up.

An input that has a limit is not cut when it gets there: its second derivative v is kept within

    -2 k rho + k^2 (u_min - u)  <=  v  <=  -2 k rho + k^2 (u_max - u)

so that u comes to rest at the limit by itself, like a critically damped system (a barrier of relative degree two). The v
that was allowed is the one that the observer hears of. Nothing is left to unwind: with the demand gone, u leaves at once.
"""

from __future__ import annotations

from dataclasses import dataclass

BARRIER_RAD_S = 12.0
"""k: how late the barrier may begin to brake. Well below the sampling rate, above the loop's bandwidth."""


@dataclass(frozen=True, slots=True)
class Integrator:
    """u and rho of one input, and the v that is being integrated."""

    value: float
    rate: float
    drive: float


def advanced(integrator: Integrator, dt_s: float, low: float, high: float) -> Integrator:
    """After `dt_s` of the present drive. The last word on the limit is a stop, for a gap longer than the barrier foresaw."""
    drive = integrator.drive
    value = integrator.value + dt_s * (integrator.rate + 0.5 * dt_s * drive)
    rate = integrator.rate + dt_s * drive
    if value > high:
        return Integrator(high, min(rate, 0.0), drive)
    if value < low:
        return Integrator(low, max(rate, 0.0), drive)
    return Integrator(value, rate, drive)


def allowed_drive(integrator: Integrator, drive: float, low: float, high: float) -> float:
    """The v nearest to the wanted one that keeps u between its limits."""
    brake = -2.0 * BARRIER_RAD_S * integrator.rate
    stiffness = BARRIER_RAD_S * BARRIER_RAD_S
    most = brake + stiffness * (high - integrator.value)
    least = brake + stiffness * (low - integrator.value)
    return min(max(drive, least), most)
