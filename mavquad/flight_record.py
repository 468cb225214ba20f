"""What one step of the law leaves behind: the row that the agent hands out and `trace.csv` keeps."""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.types import Vec4


@dataclass(frozen=True, slots=True)
class TraceRow:
    """One step of the law. 4-vectors are in the order of `mavquad.types.CHANNELS`: z, yaw, x, y (NWU).

    Attributes:
        stamp_us: the agent's time, Unix us.
        vehicle_stamp_us: the vehicle's time of the measurement, us since its boot.
        phase: name of the flight phase.
        measured: outputs as the law took them: z_m, yaw_rad (continuous), x_m, y_m.
        reference: the same of the reference.
        zeta_hat: per channel the observer's estimate of the output (m or rad) and its first three derivatives.
        sigma: observer's estimate of the total disturbance, unit of the highest derivative + 1.
        demanded: highest derivative that the law demands of each output, before the limits.
        input: the command U: v1 m/s^4, v2 rad/s^4, roll and pitch acceleration rad/s^2.
        controls: what went on the wire: roll, pitch, yaw, thrust (FRD, normalised).
        limits: names of the limits that were active.
    """

    stamp_us: int
    vehicle_stamp_us: int
    phase: str
    measured: Vec4
    reference: Vec4
    zeta_hat: tuple[Vec4, ...]
    sigma: Vec4
    demanded: Vec4
    input: Vec4
    controls: Vec4
    limits: tuple[str, ...]
