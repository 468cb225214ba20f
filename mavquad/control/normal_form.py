"""The normal form (Kim, Pyrkin, Borisov, eqs. (4), (5)): zeta, q4, b4 and b4(0, yaw).

The law inverts b4(0, yaw) as it stands here, and b4 in the body's axes (`mavquad.control.inversion`); what stands here
of b4 and q4 is the paper's own writing, which that one is held against.

    zeta_1 = (z, yaw, x, y), zeta_(i+1) = d zeta_i / dt,   d zeta_4 / dt = q4 + b4 U,   U = (v1, v2, u3, u4)

With thrust per mass T and r3 = R e3, the acceleration is T r3 - g e3, and its second derivative

    T_dd r3 + 2 T_d R (w x e3) + T R (w_d x e3 + w x (w x e3))

is read in two parts: what is there without inputs is q4, the rest is b4 U. One column of b4 for each input:

    v1 (T_dd): r3        u3 (roll_dd): -T r2        u4 (pitch_dd): T cos(roll) r1        v2 (u2_dd): yaw alone

with r1, r2, r3 the columns of R. They are orthogonal, hence det b4 = T^2 cos(roll): the matrix is singular in free fall
and at 90 degrees of roll (the paper says never), and solving it needs three dot products and no elimination.
The friction of x and y is left to the observer's sigma, as in the paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavquad.control.euler import Trig, body_acceleration, body_rates
from mavquad.types import Vec3, Vec4

Matrix4 = tuple[Vec4, Vec4, Vec4, Vec4]

DETERMINANT_MIN_M_S2 = 1.0
"""T cos(roll) is not let nearer to zero than this when b4 is solved."""


@dataclass(frozen=True, slots=True)
class BodyState:
    """What zeta_3, zeta_4 and q4 are functions of, beside the attitude."""

    euler_rates_rad_s: Vec3
    thrust_m_s2: float
    thrust_rate_m_s3: float
    yaw_input_rad_s2: float
    """u2, the first of the two integrators before the yaw."""
    yaw_input_rate_rad_s3: float


@dataclass(frozen=True, slots=True)
class Friction:
    """The paper's viscous coefficients that enter q4: a_z, and a_psi, a_theta, a_phi."""

    vertical_1_s: float = 0.0
    angular_1_s: Vec3 = (0.0, 0.0, 0.0)


NO_FRICTION = Friction()


def columns(t: Trig) -> tuple[Vec3, Vec3, Vec3]:
    """r1, r2, r3: where the body's axes point."""
    return (
        (t.c_yaw * t.c_pitch, t.s_yaw * t.c_pitch, -t.s_pitch),
        (
            t.c_yaw * t.s_pitch * t.s_roll - t.s_yaw * t.c_roll,
            t.s_yaw * t.s_pitch * t.s_roll + t.c_yaw * t.c_roll,
            t.c_pitch * t.s_roll,
        ),
        (
            t.c_yaw * t.s_pitch * t.c_roll + t.s_yaw * t.s_roll,
            t.s_yaw * t.s_pitch * t.c_roll - t.c_yaw * t.s_roll,
            t.c_pitch * t.c_roll,
        ),
    )


def b4(t: Trig, thrust_m_s2: float) -> Matrix4:
    """b4(zeta, yaw): rows z, yaw, x, y; columns v1, v2, u3 (roll), u4 (pitch)."""
    (r1x, r1y, r1z), (r2x, r2y, r2z), (r3x, r3y, r3z) = columns(t)
    roll, pitch = -thrust_m_s2, thrust_m_s2 * t.c_roll
    return (
        (r3z, 0.0, roll * r2z, pitch * r1z),
        (0.0, 1.0, 0.0, 0.0),
        (r3x, 0.0, roll * r2x, pitch * r1x),
        (r3y, 0.0, roll * r2y, pitch * r1y),
    )


def solve_b4(t: Trig, thrust_m_s2: float, demanded: Vec4) -> Vec4:
    """U of b4 U = demanded, with thrust and cos(roll) kept away from the singularity."""
    wz, wyaw, wx, wy = demanded
    along = [rx * wx + ry * wy + rz * wz for rx, ry, rz in columns(t)]
    thrust = max(thrust_m_s2, DETERMINANT_MIN_M_S2)
    pitch_gain = math.copysign(max(thrust * abs(t.c_roll), DETERMINANT_MIN_M_S2), t.c_roll)
    return (along[2], wyaw, -along[1] / thrust, along[0] / pitch_gain)


def apply_b4(t: Trig, thrust_m_s2: float, inputs: Vec4) -> Vec4:
    """b4(zeta, yaw) U."""
    v1, v2, roll, pitch = inputs
    (r1x, r1y, r1z), (r2x, r2y, r2z), (r3x, r3y, r3z) = columns(t)
    along1, along2 = thrust_m_s2 * t.c_roll * pitch, -thrust_m_s2 * roll
    return (
        v1 * r3z + along1 * r1z + along2 * r2z,
        v2,
        v1 * r3x + along1 * r1x + along2 * r2x,
        v1 * r3y + along1 * r1y + along2 * r2y,
    )


def apply_b0(s_yaw: float, c_yaw: float, gravity_m_s2: float, inputs: Vec4) -> Vec4:
    """b4(0, yaw) U = blkdiag(I2, g [[sin, cos], [-cos, sin]]) U; eq. (5) prints another block, and that one diverges."""
    v1, v2, roll, pitch = inputs
    return (v1, v2, gravity_m_s2 * (s_yaw * roll + c_yaw * pitch), gravity_m_s2 * (s_yaw * pitch - c_yaw * roll))


def solve_b0(s_yaw: float, c_yaw: float, gravity_m_s2: float, demanded: Vec4) -> Vec4:
    """U of b4(0, yaw) U = demanded: the block is g times an orthogonal matrix."""
    wz, wyaw, wx, wy = demanded
    return (wz, wyaw, (s_yaw * wx - c_yaw * wy) / gravity_m_s2, (c_yaw * wx + s_yaw * wy) / gravity_m_s2)


def q4(t: Trig, body: BodyState, friction: Friction = NO_FRICTION, vertical_jerk_m_s3: float = 0.0) -> Vec4:
    """q4(zeta, yaw): the fourth derivatives of (z, yaw, x, y) when U = 0. q4(0, yaw) = 0."""
    roll_d, pitch_d, yaw_d = body.euler_rates_rad_s
    a_roll, a_pitch, a_yaw = friction.angular_1_s
    yaw_dd = body.yaw_input_rad_s2 - a_yaw * yaw_d
    rates = body_rates(t, body.euler_rates_rad_s)
    turning = body_acceleration(t, body.euler_rates_rad_s, (-a_roll * roll_d, -a_pitch * pitch_d, yaw_dd))
    wx, wy, wz = _thrust_terms(t, body, rates, turning)
    yaw_dddd = -a_yaw * (body.yaw_input_rate_rad_s3 - a_yaw * yaw_dd)
    return (wz - friction.vertical_1_s * vertical_jerk_m_s3, yaw_dddd, wx, wy)


def _thrust_terms(t: Trig, body: BodyState, rates: Vec3, turning: Vec3) -> Vec3:
    """2 T_d R (w x e3) + T R (w_d x e3 + w x (w x e3)); in the body's axes w x e3 = (q, -p, 0)."""
    p, q, r = rates
    thrust, twice_rate = body.thrust_m_s2, 2.0 * body.thrust_rate_m_s3
    along1 = twice_rate * q + thrust * (turning[1] + r * p)
    along2 = -twice_rate * p + thrust * (-turning[0] + r * q)
    along3 = -thrust * (p * p + q * q)
    (r1x, r1y, r1z), (r2x, r2y, r2z), (r3x, r3y, r3z) = columns(t)
    return (
        along1 * r1x + along2 * r2x + along3 * r3x,
        along1 * r1y + along2 * r2y + along3 * r3y,
        along1 * r1z + along2 * r2z + along3 * r3z,
    )


def zeta(t: Trig, outputs: Vec4, rates_of_outputs: Vec4, body: BodyState, gravity_m_s2: float) -> tuple[Vec4, ...]:
    """One chain (zeta_1 .. zeta_4) for each of z, yaw, x, y, from a full measured state.

    Friction is not in zeta_3 and zeta_4 here; `chains.measured` adds what is known of it.
    """
    (r1x, r1y, r1z), (r2x, r2y, r2z), (r3x, r3y, r3z) = columns(t)
    p, q, _ = body_rates(t, body.euler_rates_rad_s)
    thrust, rate = body.thrust_m_s2, body.thrust_rate_m_s3
    along1, along2 = thrust * q, -thrust * p
    z, yaw, x, y = outputs
    vz, yaw_d, vx, vy = rates_of_outputs
    return (
        (z, vz, thrust * r3z - gravity_m_s2, along1 * r1z + along2 * r2z + rate * r3z),
        (yaw, yaw_d, body.yaw_input_rad_s2, body.yaw_input_rate_rad_s3),
        (x, vx, thrust * r3x, along1 * r1x + along2 * r2x + rate * r3x),
        (y, vy, thrust * r3y, along1 * r1y + along2 * r2y + rate * r3y),
    )
