"""Everything outside the autopilot's software: the vehicle, the wind, the sensors and what is estimated from them."""

from __future__ import annotations

import math

from sitl_mock.config import MockConfig
from sitl_mock.geometry import Vec3, Vec4, from_euler
from sitl_mock.paper_model import PaperModel, PaperState
from sitl_mock.plant import TICK_US, Plant, VehicleState
from sitl_mock.quadcopter import RigidBody
from sitl_mock.sensors import Estimate, Estimator
from sitl_mock.wind import Wind

TICK_S = TICK_US / 1e6


class World:
    """The simulated world of one vehicle.

    Attributes:
        estimate: what the autopilot's estimator says now.
    """

    def __init__(self, config: MockConfig, seed: int) -> None:
        self._plant = _plant(config)
        self._wind = Wind(config.wind_ned_m_s, config.gusts_m_s, config.gusts_time_s, seed)
        self._estimator = Estimator(config.sensors, seed)
        self.estimate: Estimate = self._estimator.step(self._plant.state, 0, TICK_S)

    @property
    def state(self) -> VehicleState:
        """The true state now."""
        return self._plant.state

    def step(self, motor_commands: Vec4, boot_us: int) -> None:
        """One tick: the vehicle moves under these commands, then is measured."""
        self._plant.step(motor_commands, self._wind.step(TICK_S), TICK_S)
        self.estimate = self._estimator.step(self._plant.state, boot_us, TICK_S)

    def drop_payload(self) -> None:
        """The payload falls off; the vehicle is lighter by it."""

    def weaken_rotor(self, rotor: int, share: float) -> None:
        """Rotor 1 to 4, in the autopilot's numbering, gives only `share` (0 to 1) of its thrust and torque from now on."""

    def jump_position(self, offset_ned_m: Vec3) -> None:
        """The estimated position is off by this much more from now on; `Estimate.reset_count` counts."""
        self._estimator.jump_position(offset_ned_m)

    def drain_battery(self, remaining: float) -> None:
        """Only the share `remaining` (0 to 1) of the battery's charge is left."""
        self._estimator.drain_battery(remaining)


def _plant(config: MockConfig) -> Plant:
    params = config.vehicle.params()
    heading_rad = math.radians(config.vehicle.heading_deg)
    if config.vehicle.model == "paper":
        return PaperModel(params, PaperState(roll_pitch_yaw_rad=(0.0, 0.0, -heading_rad)))
    return RigidBody(params, VehicleState(quaternion=from_euler(0.0, 0.0, heading_rad)))
