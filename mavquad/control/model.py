"""The paper's simplified quadcopter (section 2), as the agent understands it.

    symbol   name           note
    phi      yaw_rad        the paper's text says roll; its equations make it the yaw
    theta    pitch_rad      positive is nose down (FLU)
    psi      roll_rad       positive is right side down
    F_i      forces_n       one per rotor, in the paper's order (see `allocation`)
    l        lever_arm_m    about the axis: d / sqrt(2) for an X frame of arm d
    C        yaw_lever_m    drag torque of a rotor over its thrust

Kim, Pyrkin, Borisov, eqs. of section 2, with what its print got wrong put right: R e3 is the one column that the thrust
acts along, the left side of the angle equation holds second derivatives, and the angles are named after what they do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.types import Vec3, Vec4

GRAVITY_M_S2 = 9.81
"""The paper's g."""


@dataclass(frozen=True, slots=True)
class ModelParams:
    """Constants of the simplified model. Angle triples are (roll, pitch, yaw)."""

    mass_kg: float
    inertia_kg_m2: Vec3
    lever_arm_m: float
    yaw_lever_m: float
    friction_nwu_1_s: Vec3 = (0.0, 0.0, 0.0)
    angular_friction_1_s: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ModelState:
    """Position and velocity in NWU, Euler angles (roll, pitch, yaw) and their rates; also used for its derivative."""

    position_nwu_m: Vec3
    velocity_nwu_m_s: Vec3
    euler_rad: Vec3
    euler_rates_rad_s: Vec3


def thrust_direction_nwu(euler_rad: Vec3) -> Vec3:
    """r3 = R e3 of R = Rz(yaw) Ry(pitch) Rx(roll): where the rotors push."""
    roll, pitch, yaw = euler_rad
    s_roll, c_roll = math.sin(roll), math.cos(roll)
    s_pitch, c_pitch = math.sin(pitch), math.cos(pitch)
    s_yaw, c_yaw = math.sin(yaw), math.cos(yaw)
    return (
        c_yaw * s_pitch * c_roll + s_yaw * s_roll,
        s_yaw * s_pitch * c_roll - c_yaw * s_roll,
        c_pitch * c_roll,
    )


def derivative(params: ModelParams, state: ModelState, forces_n: Vec4) -> ModelState:
    """The right side of the model: time derivatives of the four fields of the state."""
    return ModelState(
        position_nwu_m=state.velocity_nwu_m_s,
        velocity_nwu_m_s=_acceleration(params, state, sum(forces_n)),
        euler_rad=state.euler_rates_rad_s,
        euler_rates_rad_s=_angular_acceleration(params, state.euler_rates_rad_s, forces_n),
    )


def _acceleration(params: ModelParams, state: ModelState, total_n: float) -> Vec3:
    rx, ry, rz = thrust_direction_nwu(state.euler_rad)
    vx, vy, vz = state.velocity_nwu_m_s
    ax, ay, az = params.friction_nwu_1_s
    thrust = total_n / params.mass_kg
    return (thrust * rx - ax * vx, thrust * ry - ay * vy, thrust * rz - az * vz - GRAVITY_M_S2)


def _angular_acceleration(params: ModelParams, rates: Vec3, forces_n: Vec4) -> Vec3:
    f1, f2, f3, f4 = forces_n
    j_roll, j_pitch, j_yaw = params.inertia_kg_m2
    a_roll, a_pitch, a_yaw = params.angular_friction_1_s
    return (
        -a_roll * rates[0] + params.lever_arm_m / j_roll * (-f1 + f2 + f3 - f4),
        -a_pitch * rates[1] + params.lever_arm_m / j_pitch * (-f1 - f2 + f3 + f4),
        -a_yaw * rates[2] + params.yaw_lever_m / j_yaw * (f1 - f2 + f3 - f4),
    )
