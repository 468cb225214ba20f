"""Rotor forces from the law's inputs and back (Kim, Pyrkin, Borisov, the choice of F), and whose rotor is whose.

    F = (1/4) M4 diag(m, J_phi/C, J_psi/l, J_theta/l) (u1 + g, u2, u3, u4)

The factor 1/4 is missing in print; without it the rotors lift four times the weight. M4 is orthogonal up to a factor of
two, so that the way back is its transpose.
"""

from __future__ import annotations

import math

from mavquad.control.model import ModelParams
from mavquad.types import Vec4

PAPER_ROTORS = ("front right", "front left", "rear left", "rear right")
"""Where the paper's rotors 1 to 4 sit: read from the signs of its roll and pitch rows, x forward, y left."""

PX4_ROTORS = ("front right", "rear left", "front left", "rear right")
"""PX4's quad-X, motors 1 to 4. Its rotors also spin the other way round: see `px4_order`."""

MIXER = (
    (1.0, 1.0, -1.0, -1.0),
    (1.0, -1.0, 1.0, -1.0),
    (1.0, 1.0, 1.0, 1.0),
    (1.0, -1.0, -1.0, 1.0),
)
"""M4: rows rotors 1 to 4, columns thrust, yaw, roll, pitch."""


def x_frame_lever_arm_m(arm_m: float) -> float:
    """The paper's l for an X frame: distance from a rotor to the roll or pitch AXIS, not to the centre of mass."""
    return arm_m / math.sqrt(2.0)


def forces_from_inputs(params: ModelParams, specific_thrust_m_s2: float, yaw: float, roll: float, pitch: float) -> Vec4:
    """The four rotor forces in newton, paper's order.

    Args:
        params: mass, inertia and lever arms.
        specific_thrust_m_s2: u1 + g.
        yaw: u2, second derivative of the yaw angle in rad/s^2.
        roll: u3, of the roll angle.
        pitch: u4, of the pitch angle.
    """
    scale = _scales(params)
    wanted = (specific_thrust_m_s2, yaw, roll, pitch)
    thrust_n, yaw_n, roll_n, pitch_n = (0.25 * s * u for s, u in zip(scale, wanted, strict=True))
    f1, f2, f3, f4 = (a * thrust_n + b * yaw_n + c * roll_n + d * pitch_n for a, b, c, d in MIXER)
    return (f1, f2, f3, f4)


def inputs_from_forces(params: ModelParams, forces_n: Vec4) -> Vec4:
    """(u1 + g, u2, u3, u4) that the four rotor forces amount to."""
    sums = [sum(row[k] * f for row, f in zip(MIXER, forces_n, strict=True)) for k in range(4)]
    thrust, yaw, roll, pitch = (total / s for total, s in zip(sums, _scales(params), strict=True))
    return (thrust, yaw, roll, pitch)


def px4_order(paper_order: Vec4) -> Vec4:
    """Per-rotor values in the paper's order, as PX4 numbers the motors of a quad-X (or back: it is its own inverse).

    Only the places are exchanged. PX4's rotors spin the other way round, so the yaw input changes sign before
    `forces_from_inputs` when its result is meant for a PX4 frame.
    """
    front_right, front_left, rear_left, rear_right = paper_order
    return (front_right, rear_left, front_left, rear_right)


def _scales(params: ModelParams) -> Vec4:
    j_roll, j_pitch, j_yaw = params.inertia_kg_m2
    return (
        params.mass_kg,
        j_yaw / params.yaw_lever_m,
        j_roll / params.lever_arm_m,
        j_pitch / params.lever_arm_m,
    )
