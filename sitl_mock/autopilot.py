"""The mock autopilot as an Endpoint: plant, estimator and personality, stepped every 4 ms of virtual time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.endpoint import NEVER_US, floor_to_grid_us
from mavquad.protocol.codec import decode, frame_source
from sitl_mock.config import MockConfig
from sitl_mock.geometry import Quaternion, Vec3, Vec4, from_euler, to_euler
from sitl_mock.paper_model import PaperModel, PaperState
from sitl_mock.personality.px4 import Px4
from sitl_mock.plant import TICK_US, Plant, VehicleState
from sitl_mock.quadcopter import RigidBody
from sitl_mock.script import Script
from sitl_mock.sensors import Estimator
from sitl_mock.wind import Wind

_TICK_S = TICK_US / 1e6


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happens, for tests and summaries; `quaternion` turns FRD into NED, `euler_rad` is roll, pitch, yaw."""

    boot_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    quaternion: Quaternion
    euler_rad: Vec3
    rates_frd_rad_s: Vec3
    armed: bool
    landed: bool
    crashed: bool
    mode: str
    motor_commands: Vec4


class MockAutopilot:
    """A simulated vehicle with its autopilot. Boot is at `start_us`; the same inputs and seed give the same bytes."""

    def __init__(self, config: MockConfig, seed: int, start_us: int) -> None:
        self._wind = Wind(config.wind_ned_m_s, config.gusts_m_s, config.gusts_time_s, seed)
        self._start_us = floor_to_grid_us(start_us)
        self._tick_us = self._start_us
        self._plant = _plant(config)
        self._estimator = Estimator(config.sensors, seed)
        self._script = Script(config.faults)
        self._personality = Px4(config, self._script, self._estimator.step(self._plant.state, 0, _TICK_S))
        self._motor_commands: Vec4 = (0.0, 0.0, 0.0, 0.0)
        self._is_dead = False

    @property
    def mode(self) -> str:
        """PX4's name of the mode in force, e.g. AUTO.LOITER."""
        return self._personality.commander.mode.value

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._personality.commander.armed

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one whole, valid frame."""
        if not self._is_dead:
            self._personality.handle(decode(data), frame_source(data), now_us - self._start_us)

    def next_deadline_us(self) -> int:
        """The next tick of the physics."""
        return NEVER_US if self._is_dead else self._tick_us + TICK_US

    def on_deadline(self, now_us: int) -> None:
        """One tick: the vehicle moves under the last motor commands, then is measured, controlled and reported."""
        self._tick_us = now_us
        boot_us = now_us - self._start_us
        if self._script.is_dead(boot_us):
            self._is_dead = True
            return
        self._plant.step(self._motor_commands, self._wind.step(_TICK_S), _TICK_S)
        state = self._plant.state
        estimate = self._estimator.step(state, boot_us, _TICK_S)
        self._motor_commands = self._personality.fly(state, estimate, boot_us, _TICK_S)
        self._personality.report(boot_us)

    def datagrams_to_send(self) -> list[bytes]:
        """The frames made since the last call, each a datagram."""
        frames, self._personality.outbox = self._personality.outbox, []
        return frames

    def truth(self) -> Truth:
        """The true state now."""
        state, commander = self._plant.state, self._personality.commander
        return Truth(
            self._tick_us - self._start_us,
            state.position_ned_m,
            state.velocity_ned_m_s,
            state.quaternion,
            to_euler(state.quaternion),
            state.rates_frd_rad_s,
            commander.armed,
            commander.landed,
            commander.crashed,
            commander.mode.value,
            self._motor_commands,
        )


def _plant(config: MockConfig) -> Plant:
    params = config.vehicle.params()
    heading_rad = math.radians(config.vehicle.heading_deg)
    if config.vehicle.model == "paper":
        return PaperModel(params, PaperState(roll_pitch_yaw_rad=(0.0, 0.0, -heading_rad)))
    return RigidBody(params, VehicleState(quaternion=from_euler(0.0, 0.0, heading_rad)))
