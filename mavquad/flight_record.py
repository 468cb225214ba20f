"""What a flight leaves behind: the row of each step of the law, the lines of its story, and a snapshot of any moment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from mavquad.types import Depth, Vec3, Vec4

_DEPTHS: dict[int, Depth] = {4: "torque", 3: "rate", 2: "attitude"}


class TraceRow(NamedTuple):
    """One step of the law. 4-vectors are in the order of `mavquad.types.CHANNELS`: z, yaw, x, y (NWU).

    Attributes:
        stamp_us: the agent's time, Unix us.
        vehicle_stamp_us: the vehicle's time of the measurement, us since its boot.
        phase: name of the flight phase.
        measured: outputs as the law took them: z_m, yaw_rad (continuous), x_m, y_m.
        reference: the same of the reference.
        zeta_hat: per channel the observer's estimate of the output (m or rad) and its derivatives, as many as its chain
            has: r of z, x and y (4 at depth torque, 3 at rate, 2 at attitude), yaw as many as its own.
        sigma: observer's estimate of the disturbance beside the input, unit of the chain's highest derivative.
        wind: acceleration of x, y, z that is not the thrust's, as far as it is told apart from sigma, m/s^2.
        demanded: highest derivative that the law demands of each output: after its limits of speed, acceleration and tilt,
            before the saturation of the inputs.
        input: the command U, for thrust, yaw, roll and pitch: derivatives r - 2 of thrust per mass (m/s^2 and on) and of
            roll and pitch (rad and on); the yaw chain's input.
        controls: what went on the wire (FRD), thrust (0..1) the last: roll, pitch, yaw torque in -1..1, or body rates in
            rad/s, or roll, pitch and yaw in rad.
        limits: names of the limits that were active.
    """

    stamp_us: int
    vehicle_stamp_us: int
    phase: str
    measured: Vec4
    reference: Vec4
    zeta_hat: tuple[tuple[float, ...], ...]
    sigma: Vec4
    wind: Vec3
    demanded: Vec4
    input: Vec4
    controls: Vec4
    limits: tuple[str, ...]

    @property
    def depth(self) -> Depth:
        """Told by the length of the chains."""
        return _DEPTHS[len(self.zeta_hat[0])]


@dataclass(frozen=True, slots=True)
class Note:
    """A line of the flight's story: a phase entered, a text of the vehicle, a guard."""

    stamp_us: int
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class Status:
    """What a display wants to know at any moment.

    Attributes:
        phase: name of the flight phase.
        mode: name of the autopilot's mode, "" before it is known.
        armed: as HEARTBEAT has it.
        vehicle: autopilot, version and ids, in words.
        version: the autopilot's release, (0, 0, 0) until it is known.
        height_m: above the arming point.
        row: of the last step, while the law is on.
        mission_s: since the mission began, of mission_duration_s.
        depth: what the law commands; "" until that is known.
        position_hz: rate of the positions in the last second.
        hover_thrust_norm: the hover thrust in use.
        setpoints_sent: setpoints of the law.
        safe_setpoints: setpoints sent once per loss.
        old_poses: poses that were not newer than the last, not used.
    """

    phase: str
    mode: str
    armed: bool
    vehicle: str
    version: tuple[int, int, int]
    height_m: float | None
    row: TraceRow | None
    mission_s: float
    mission_duration_s: float
    depth: str
    position_hz: float
    hover_thrust_norm: float
    setpoints_sent: int
    safe_setpoints: int
    old_poses: int

    @property
    def position_error_m(self) -> float | None:
        """Norm of reference minus measured position; None while the law is off."""
        if self.row is None:
            return None
        z, _, x, y = (r - m for r, m in zip(self.row.reference, self.row.measured, strict=True))
        return math.hypot(x, y, z)

    @property
    def yaw_error_rad(self) -> float | None:
        """Reference minus measured yaw; None while the law is off."""
        return None if self.row is None else self.row.reference[1] - self.row.measured[1]
