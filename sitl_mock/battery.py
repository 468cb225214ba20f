"""The battery of the simulated vehicle: a voltage that falls with the charge, behind a resistance.

With c the share of the charge left, I the current, R the resistance, C the capacity, T_i the thrusts and T_h a quarter
of the weight:

    U = U_empty + (U_full - U_empty) c - R I,     I = I_hover / 4 sum (T_i / T_h)^1.5,     c' = -I / C

The exponent is that of a rotor's induced power. What a rotor can do goes with U^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from sitl_mock.geometry import Vec4
from sitl_mock.plant import TICK_S, VehicleParams

_S_PER_H = 3600.0


class Battery(NamedTuple):
    """What the autopilot measures of its battery: voltage in V, current in A, and the share of the charge left, 0 to 1."""

    voltage_v: float
    current_a: float
    remaining: float


@dataclass(frozen=True, slots=True)
class BatteryParams:
    """Constants of a battery; `capacity_ah` 0 never empties. The default is PX4 SIH's: four cells, always full."""

    full_v: float = 16.2
    empty_v: float = 14.0
    resistance_ohm: float = 0.0
    capacity_ah: float = 0.0
    hover_current_a: float = 0.0


FULL = Battery(16.2, 0.0, 1.0)
"""What PX4's SIH shows."""


class BatteryModel:
    """A battery and the motors that it feeds.

    Attributes:
        reading: what is measured now.
        supply: what the rotors can do, as a share of what they can with a full battery.
    """

    def __init__(self, params: BatteryParams, vehicle: VehicleParams, dt_s: float = TICK_S) -> None:
        self._params = params
        self._dt_h = dt_s / _S_PER_H
        self._curve = (1.0 - vehicle.thrust_curve, vehicle.thrust_curve)
        self._hover_share = 1.0 / vehicle.thrust_to_weight
        self.reading = Battery(params.full_v, 0.0, 1.0)
        self.supply = 1.0

    def step(self, motors: Vec4) -> None:
        """One tick with the motors at these levels."""
        if self._params.hover_current_a == 0.0:
            return
        linear, square = self._curve
        load = sum([(u * (linear + square * u) / self._hover_share) ** 1.5 for u in motors])
        current = 0.25 * self._params.hover_current_a * load
        remaining = self.reading.remaining
        if self._params.capacity_ah > 0.0:
            remaining = max(0.0, remaining - current * self._dt_h / self._params.capacity_ah)
        self._read(current, remaining)

    def drain(self, remaining: float) -> None:
        """Only this share of the charge, 0 to 1, is left."""
        self._read(self.reading.current_a, max(0.0, min(1.0, remaining)))

    def _read(self, current_a: float, remaining: float) -> None:
        params = self._params
        open_circuit = params.empty_v + (params.full_v - params.empty_v) * remaining
        voltage = open_circuit - params.resistance_ohm * current_a
        self.reading = Battery(voltage, current_a, remaining)
        self.supply = (voltage / params.full_v) ** 2
