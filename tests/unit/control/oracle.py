"""The normal form by computer algebra, from the model of the paper alone: what the hand-written one is held against."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import sympy as sp

STATE = sp.symbols("yaw pitch roll yaw_d pitch_d roll_d T T_d u2 u2_d vz")
FRICTION = sp.symbols("a_z a_yaw a_pitch a_roll")
INPUTS = sp.symbols("v1 v2 u3 u4")
GRAVITY = sp.Symbol("g")


@lru_cache(maxsize=1)
def chains() -> tuple[sp.Matrix, ...]:
    """zeta_3, zeta_4 and the fourth derivatives of (z, yaw, x, y), by differentiating along the model."""
    yaw, pitch, roll, yaw_d, pitch_d, roll_d, thrust, thrust_d, u2, u2_d, vz = STATE
    a_z, a_yaw, a_pitch, a_roll = FRICTION
    v1, v2, u3, u4 = INPUTS
    c, s = sp.cos, sp.sin
    r3 = sp.Matrix(
        [
            c(yaw) * s(pitch) * c(roll) + s(yaw) * s(roll),
            s(yaw) * s(pitch) * c(roll) - c(yaw) * s(roll),
            c(pitch) * c(roll),
        ]
    )
    vz_d = thrust * r3[2] - GRAVITY - a_z * vz
    flow = (
        yaw_d, pitch_d, roll_d,
        u2 - a_yaw * yaw_d, u4 - a_pitch * pitch_d, u3 - a_roll * roll_d,
        thrust_d, v1, u2_d, v2, vz_d,
    )  # fmt: skip

    def along(expression: sp.Expr) -> sp.Expr:
        return sum(sp.diff(expression, q) * f for q, f in zip(STATE, flow, strict=True))

    second = sp.Matrix([vz_d, flow[3], thrust * r3[0], thrust * r3[1]])
    third = second.applyfunc(along)
    return second, third, third.applyfunc(along)


@lru_cache(maxsize=1)
def symbolic_b4() -> sp.Matrix:
    return chains()[2].jacobian(INPUTS)


@lru_cache(maxsize=1)
def functions() -> tuple[Callable, Callable, Callable, Callable]:
    """Numeric zeta_3, zeta_4, q4, b4 of (state, friction, g)."""
    arguments = (*STATE, *FRICTION, GRAVITY)
    second, third, fourth = chains()
    drift = fourth.subs(dict.fromkeys(INPUTS, 0))
    third = third.subs(dict.fromkeys(INPUTS, 0))
    made = [sp.lambdify(arguments, m.tolist(), "math", cse=True) for m in (second, third, drift, symbolic_b4())]
    return made[0], made[1], made[2], made[3]
