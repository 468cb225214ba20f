"""Everything outside the autopilot's software: the vehicle, the wind, the sensors and what is estimated from them."""

from __future__ import annotations

import math
from dataclasses import replace

from sitl_mock.battery import BatteryModel
from sitl_mock.config import MockConfig
from sitl_mock.geometry import Vec3, Vec4, from_euler
from sitl_mock.paper_model import PaperModel, PaperState
from sitl_mock.plant import TICK_S, Plant, VehicleState
from sitl_mock.quadcopter import RigidBody
from sitl_mock.sensors import Estimate, Estimator
from sitl_mock.wind import ChangedWind, Wind, wind_of

__all__ = ["TICK_S", "World"]

_SUPPLY_STEP = 1e-3
"""The rotors follow the battery in steps of this share of their thrust."""


class World:
    """The simulated world of one vehicle.

    Attributes:
        state: the true state now.
        estimate: what the autopilot's estimator says now.
    """

    def __init__(self, config: MockConfig, seed: int) -> None:
        self._params = config.vehicle.params()
        self._plant = _plant(config)
        self._wind: Wind = wind_of(config, seed)
        self._battery = BatteryModel(config.vehicle.battery(), self._params)
        self._supply = 1.0
        self._estimator = Estimator(config.estimator, seed)
        self.state: VehicleState = self._plant.state
        self.estimate: Estimate = self._estimator.step(self.state, 0, self._battery.reading)

    def step(self, motor_commands: Vec4, boot_us: int) -> None:
        """One tick: the vehicle moves under these commands, then is measured."""
        plant, battery = self._plant, self._battery
        plant.step(motor_commands, self._wind.step(self.state))
        state = self.state = plant.state
        battery.step(state.motors)
        if abs(battery.supply - self._supply) > _SUPPLY_STEP:
            self._change()
        self.estimate = self._estimator.step(state, boot_us, battery.reading)

    def change_wind(self, change_ned_m_s: Vec3) -> None:
        """The wind blows so much more towards north, east, down from now on, gusts as before."""
        self._wind = ChangedWind(self._wind, change_ned_m_s)

    def drop_payload(self) -> None:
        """The payload falls off; the vehicle is lighter by it."""
        self._params = replace(self._params, mass_kg=self._params.mass_kg - self._params.payload_kg, payload_kg=0.0)
        self._change()

    def weaken_rotor(self, rotor: int, share: float) -> None:
        """Rotor 1 to 4, in the autopilot's numbering, gives only `share` (0 to 1) of its thrust and torque from now on."""
        one, two, three, four = (
            share if number == rotor else strength for number, strength in enumerate(self._params.rotor_strengths, 1)
        )
        self._params = replace(self._params, rotor_strengths=(one, two, three, four))
        self._change()

    def jump_position(self, offset_ned_m: Vec3) -> None:
        """The estimated position is off by this much more from now on; `Estimate.reset_count` counts."""
        self._estimator.jump_position(offset_ned_m)

    def drain_battery(self, remaining: float) -> None:
        """Only the share `remaining` (0 to 1) of the battery's charge is left."""
        self._battery.drain(remaining)

    def _change(self) -> None:
        self._supply = supply = self._battery.supply
        a, b, c, d = self._params.rotor_strengths
        self._plant.change(replace(self._params, rotor_strengths=(a * supply, b * supply, c * supply, d * supply)))


def _plant(config: MockConfig) -> Plant:
    params = config.vehicle.params()
    heading_rad = math.radians(config.vehicle.heading_deg)
    if config.vehicle.model == "paper":
        return PaperModel(params, PaperState(roll_pitch_yaw_rad=(0.0, 0.0, -heading_rad)))
    return RigidBody(params, VehicleState(quaternion=from_euler(0.0, 0.0, heading_rad)))
