"""The integrators before thrust and yaw (paper, step 2: u_d = rho, rho_d = v), with limits that cannot wind up.

There are as many as make a channel as long as the others: two, one, or none. An input that has a limit is not cut when it
gets there: its highest derivative v is kept within

    -2 k rho + k^2 (u_min - u)  <=  v  <=  -2 k rho + k^2 (u_max - u)       two integrators
                 k (u_min - u)  <=  v  <=  k (u_max - u)                    one
                          u_min <=  v  <=  u_max                            none

so that u comes to rest at the limit by itself, like a critically damped system (a barrier). The v that was allowed is the
one that the observer hears of. Nothing is left to unwind: with the demand gone, u leaves at once.
"""

from __future__ import annotations

from typing import NamedTuple

BARRIER_RAD_S = 12.0
"""k: how late the barrier may begin to brake. Well below the sampling rate, above the loop's bandwidth."""


class Integrator(NamedTuple):
    """u, rho, and the v that is being integrated; `order` integrators from v to u."""

    order: int
    value: float
    rate: float = 0.0
    drive: float = 0.0


def advanced(integrator: Integrator, dt_s: float, low: float, high: float) -> Integrator:
    """After `dt_s` of the present drive. The last word on the limit is a stop, for a gap longer than the barrier foresaw."""
    order, drive = integrator.order, integrator.drive
    if order == 0:
        return integrator
    if order == 1:
        return Integrator(1, min(max(integrator.value + dt_s * drive, low), high), drive, drive)
    value = integrator.value + dt_s * (integrator.rate + 0.5 * dt_s * drive)
    rate = integrator.rate + dt_s * drive
    if value > high:
        return Integrator(2, high, min(rate, 0.0), drive)
    if value < low:
        return Integrator(2, low, max(rate, 0.0), drive)
    return Integrator(2, value, rate, drive)


def allowed_drive(integrator: Integrator, drive: float, low: float, high: float) -> float:
    """The v nearest to the wanted one that keeps u between its limits."""
    if integrator.order == 0:
        return min(max(drive, low), high)
    brake, stiffness = 0.0, BARRIER_RAD_S
    if integrator.order == 2:
        brake, stiffness = -2.0 * BARRIER_RAD_S * integrator.rate, BARRIER_RAD_S * BARRIER_RAD_S
    most = brake + stiffness * (high - integrator.value)
    least = brake + stiffness * (low - integrator.value)
    return min(max(drive, least), most)


def driven(integrator: Integrator, drive: float) -> Integrator:
    """With another v from now on."""
    if integrator.order == 0:
        return Integrator(0, drive, 0.0, drive)
    rate = drive if integrator.order == 1 else integrator.rate
    return Integrator(integrator.order, integrator.value, rate, drive)
