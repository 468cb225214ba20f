"""Everything outside the autopilot's software: the vehicle, the wind, the sensors and what is estimated from them."""

from __future__ import annotations

import math

from sitl_mock.config import MockConfig
from sitl_mock.geometry import Vec4, from_euler
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


def _plant(config: MockConfig) -> Plant:
    params = config.vehicle.params()
    heading_rad = math.radians(config.vehicle.heading_deg)
    if config.vehicle.model == "paper":
        return PaperModel(params, PaperState(roll_pitch_yaw_rad=(0.0, 0.0, -heading_rad)))
    return RigidBody(params, VehicleState(quaternion=from_euler(0.0, 0.0, heading_rad)))
