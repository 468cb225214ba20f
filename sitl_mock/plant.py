"""What every simulated vehicle looks like from outside: its parameters, its state, and one step.

The default numbers are those of PX4's built-in SIH quadcopter (SIH_MASS, SIH_T_MAX, ... of v1.13 to v1.16). Motors 1
and 2 turn the nose right, 3 and 4 left, and are placed as PX4 and ArduPilot number them:

    frame "x":     1 front right, 2 rear left, 3 front left, 4 rear right
    frame "plus":  1 right,       2 left,      3 front,      4 rear
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from sitl_mock.geometry import IDENTITY, ZERO3, Quaternion, Vec3, Vec4

TICK_US = 4000
"""The step of the physics."""
TICK_S = TICK_US / 1e6
GRAVITY_M_S2 = 9.81

Frame = Literal["x", "plus"]


@dataclass(frozen=True, slots=True)
class VehicleParams:
    """Constants of the vehicle.

    Attributes:
        mass_kg: with the payload, if any.
        arm_m: the lever about the roll and pitch axes, in frame "x" not the distance to the rotor.
        thrust_curve: e in T = motor_thrust_max_n ((1 - e) u + e u^2) at the level u; the reaction torque goes with T.
        rotor_drag_n_s_m: drag force per airspeed at hover thrust; it goes with the square root of the thrust.
        rotor_strengths: share of its thrust and torque that each rotor gives.
    """

    mass_kg: float = 1.0
    inertia_kg_m2: Vec3 = (0.025, 0.025, 0.030)
    motor_thrust_max_n: float = 5.0
    motor_torque_max_nm: float = 0.1
    arm_m: float = 0.2
    linear_drag_n_s_m: float = 1.0
    angular_drag_nm_s_rad: float = 0.025
    motor_time_constant_s: float = 0.05
    gravity_m_s2: float = GRAVITY_M_S2
    frame: Frame = "x"
    thrust_curve: float = 0.0
    quadratic_drag_n_s2_m2: float = 0.0
    rotor_drag_n_s_m: float = 0.0
    payload_kg: float = 0.0
    rotor_strengths: Vec4 = (1.0, 1.0, 1.0, 1.0)

    @property
    def thrust_to_weight(self) -> float:
        """Full thrust of all motors in units of the weight."""
        return 4 * self.motor_thrust_max_n / (self.mass_kg * self.gravity_m_s2)

    @property
    def hover_thrust_norm(self) -> float:
        """The motor command u, 0 to 1, at which thrust equals weight: (1 - e) u + e u^2 = 1 / thrust_to_weight."""
        linear, share = 1.0 - self.thrust_curve, 1.0 / self.thrust_to_weight
        return 2 * share / (linear + math.sqrt(linear * linear + 4 * self.thrust_curve * share))


class Impact(NamedTuple):
    """How the vehicle met the ground."""

    speed_m_s: float
    tilt_rad: float


class VehicleState(NamedTuple):
    """The true state: world NED, body FRD, `quaternion` turns FRD into NED.

    Attributes:
        motors: each motor's level after its lag, 0 to 1.
        on_ground: held by the ground plane z = 0, at rest.
        impact: set by the step in which the vehicle came down, None in every other.
        acceleration_ned_m_s2: mean acceleration over the last step; zero on the ground, the impact is left out.
    """

    position_ned_m: Vec3 = ZERO3
    velocity_ned_m_s: Vec3 = ZERO3
    quaternion: Quaternion = IDENTITY
    rates_frd_rad_s: Vec3 = ZERO3
    motors: Vec4 = (0.0, 0.0, 0.0, 0.0)
    on_ground: bool = True
    impact: Impact | None = None
    acceleration_ned_m_s2: Vec3 = ZERO3


class Plant(Protocol):
    """A simulated vehicle."""

    @property
    def state(self) -> VehicleState:
        """The true state now."""

    def step(self, motor_commands: Vec4, wind_ned_m_s: Vec3) -> None:
        """Let one tick pass with constant motor commands (each 0 to 1, motor 1 first) and wind."""

    def change(self, params: VehicleParams) -> None:
        """From now on it has these constants."""
