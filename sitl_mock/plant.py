"""What every simulated vehicle looks like from outside: its parameters, its state, and one step.

The default numbers are those of PX4's built-in SIH quadcopter (SIH_MASS, SIH_T_MAX, ... of v1.13 to v1.16). Motors are
in PX4's quad-X order: 1 front right, 2 rear left, 3 front left, 4 rear right; 1 and 2 turn the nose right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sitl_mock.geometry import IDENTITY, ZERO3, Quaternion, Vec3, Vec4

TICK_US = 4000
"""The step of the physics."""


@dataclass(frozen=True, slots=True)
class VehicleParams:
    """Constants of the vehicle. `arm_m` is the lever about the roll and pitch axes, not the distance to the rotor."""

    mass_kg: float = 1.0
    inertia_kg_m2: Vec3 = (0.025, 0.025, 0.030)
    motor_thrust_max_n: float = 5.0
    motor_torque_max_nm: float = 0.1
    arm_m: float = 0.2
    linear_drag_n_s_m: float = 1.0
    angular_drag_nm_s_rad: float = 0.025
    motor_time_constant_s: float = 0.05
    gravity_m_s2: float = 9.81

    @property
    def hover_thrust_norm(self) -> float:
        """The motor command, 0 to 1, at which thrust equals weight."""
        return self.mass_kg * self.gravity_m_s2 / (4 * self.motor_thrust_max_n)


@dataclass(frozen=True, slots=True)
class Impact:
    """How the vehicle met the ground."""

    speed_m_s: float
    tilt_rad: float


@dataclass(frozen=True, slots=True)
class VehicleState:
    """The true state: world NED, body FRD, `quaternion` turns FRD into NED.

    Attributes:
        motors: each motor's level after its lag, 0 to 1.
        on_ground: held by the ground plane z = 0, at rest.
        impact: set by the step in which the vehicle came down, None in every other.
    """

    position_ned_m: Vec3 = ZERO3
    velocity_ned_m_s: Vec3 = ZERO3
    quaternion: Quaternion = IDENTITY
    rates_frd_rad_s: Vec3 = ZERO3
    motors: Vec4 = (0.0, 0.0, 0.0, 0.0)
    on_ground: bool = True
    impact: Impact | None = None


class Plant(Protocol):
    """A simulated vehicle."""

    @property
    def state(self) -> VehicleState:
        """The true state now."""

    def step(self, motor_commands: Vec4, wind_ned_m_s: Vec3, dt_s: float) -> None:
        """Let `dt_s` pass with constant motor commands (each 0 to 1, PX4's order) and wind."""
