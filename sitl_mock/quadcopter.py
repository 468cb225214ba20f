"""A rigid-body quadcopter: 6 degrees of freedom, rotor lag, drag, wind, a ground plane. Pure functions.

World NED, body FRD, unit quaternion FRD to NED. With u_i the motor levels (PX4's quad-X order, see `plant`), v the
velocity, v_w the wind, w the body rates:

    m v'  = R [0, 0, -T_max sum u_i] + m g e3 - k_v (v - v_w)
    J w'  = M - w x J w - k_w w
    M     = [l T_max (-u1+u2+u3-u4),  l T_max (u1-u2+u3-u4),  Q_max (u1+u2-u3-u4)]
    u_i'  = (command_i - u_i) / tau

Source: PX4's SIH simulator (equations and numbers); SIH itself has no wind. The lag is discretised exactly, the rest
is integrated with the classical Runge-Kutta method (RK4), which sees the lag's exact values at its stages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from sitl_mock.geometry import ZERO3, Quaternion, Vec3, Vec4, from_euler, normalised, tilt_rad, yaw_of
from sitl_mock.plant import Impact, VehicleParams, VehicleState

FLIPPED_RAD = math.radians(60.0)
"""A vehicle that comes down with more tilt stays lying on its side or back."""

Motion = tuple[float, float, float, float, float, float, float, float, float, float]
"""Velocity NED (m/s), quaternion, body rates FRD (rad/s), flat; or the time derivative of these."""


@dataclass(frozen=True, slots=True)
class Wrench:
    """Thrust (N, along -z of the body) and moments (Nm, FRD)."""

    thrust_n: float
    moment_nm: Vec3


def wrench(params: VehicleParams, motors: Vec4) -> Wrench:
    """What the four motors at these levels do to the body."""
    u1, u2, u3, u4 = motors
    lever = params.arm_m * params.motor_thrust_max_n
    return Wrench(
        params.motor_thrust_max_n * (u1 + u2 + u3 + u4),
        (
            lever * (-u1 + u2 + u3 - u4),
            lever * (u1 - u2 + u3 - u4),
            params.motor_torque_max_nm * (u1 + u2 - u3 - u4),
        ),
    )


def derivative(params: VehicleParams, motion: Motion, applied: Wrench, wind_ned_m_s: Vec3) -> Motion:
    """Time derivative of (velocity, quaternion, rates) in free flight; the equations of the module's docstring."""
    vn, ve, vd, qw, qx, qy, qz, p, q, r = motion
    wn, we, wd = wind_ned_m_s
    mx, my, mz = applied.moment_nm
    jx, jy, jz = params.inertia_kg_m2
    thrust = applied.thrust_n / params.mass_kg
    drag = params.linear_drag_n_s_m / params.mass_kg
    kw = params.angular_drag_nm_s_rad
    return (
        -2 * thrust * (qw * qy + qx * qz) - drag * (vn - wn),
        -2 * thrust * (qy * qz - qw * qx) - drag * (ve - we),
        params.gravity_m_s2 - thrust * (1 - 2 * (qx * qx + qy * qy)) - drag * (vd - wd),
        0.5 * (-qx * p - qy * q - qz * r),
        0.5 * (qw * p + qy * r - qz * q),
        0.5 * (qw * q - qx * r + qz * p),
        0.5 * (qw * r + qx * q - qy * p),
        (mx - kw * p + (jy - jz) * q * r) / jx,
        (my - kw * q + (jz - jx) * r * p) / jy,
        (mz - kw * r + (jx - jy) * p * q) / jz,
    )


def lagged(motors: Vec4, commands: Vec4, decay: float) -> Vec4:
    """First-order lag over one interval, exact for a constant command; `decay` = exp(-dt / tau)."""
    a, b, c, d = commands
    return (
        a + (motors[0] - a) * decay,
        b + (motors[1] - b) * decay,
        c + (motors[2] - c) * decay,
        d + (motors[3] - d) * decay,
    )


def lag_decay(time_constant_s: float, dt_s: float) -> float:
    """exp(-dt / tau); 0 for a motor without lag."""
    return math.exp(-dt_s / time_constant_s) if time_constant_s > 0 else 0.0


def step(
    params: VehicleParams, state: VehicleState, motor_commands: Vec4, wind_ned_m_s: Vec3, dt_s: float
) -> VehicleState:
    """The state after `dt_s` with constant motor commands (each 0 to 1) and constant wind."""
    decay = lag_decay(params.motor_time_constant_s, dt_s / 2)
    motors_mid = lagged(state.motors, motor_commands, decay)
    motors_end = lagged(motors_mid, motor_commands, decay)
    if state.on_ground and not _lifts_off(params, state, motors_end):
        return replace(state, motors=motors_end, impact=None)
    stages = (wrench(params, state.motors), wrench(params, motors_mid), wrench(params, motors_end))
    flown = _runge_kutta(params, state, stages, wind_ned_m_s, dt_s, motors_end)
    if flown.position_ned_m[2] >= 0.0 and flown.velocity_ned_m_s[2] >= 0.0:
        return _touch_down(flown)
    return flown


def _lifts_off(params: VehicleParams, state: VehicleState, motors: Vec4) -> bool:
    lift_n = wrench(params, motors).thrust_n * math.cos(tilt_rad(state.quaternion))
    return lift_n > params.mass_kg * params.gravity_m_s2


def _moved(motion: Motion, rate: Motion, dt_s: float) -> Motion:
    a0, a1, a2, a3, a4, a5, a6, a7, a8, a9 = motion
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9 = rate
    h = dt_s
    return (
        a0 + h * b0,
        a1 + h * b1,
        a2 + h * b2,
        a3 + h * b3,
        a4 + h * b4,
        a5 + h * b5,
        a6 + h * b6,
        a7 + h * b7,
        a8 + h * b8,
        a9 + h * b9,
    )


def _runge_kutta(
    params: VehicleParams,
    state: VehicleState,
    stages: tuple[Wrench, Wrench, Wrench],
    wind_ned_m_s: Vec3,
    dt_s: float,
    motors_end: Vec4,
) -> VehicleState:
    y1: Motion = (*state.velocity_ned_m_s, *state.quaternion, *state.rates_frd_rad_s)
    k1 = derivative(params, y1, stages[0], wind_ned_m_s)
    y2 = _moved(y1, k1, dt_s / 2)
    k2 = derivative(params, y2, stages[1], wind_ned_m_s)
    y3 = _moved(y1, k2, dt_s / 2)
    k3 = derivative(params, y3, stages[1], wind_ned_m_s)
    y4 = _moved(y1, k3, dt_s)
    k4 = derivative(params, y4, stages[2], wind_ned_m_s)
    sixth = dt_s / 6
    vn, ve, vd, qw, qx, qy, qz, p, q, r = [
        y + sixth * (a + 2 * (b + c) + d) for y, a, b, c, d in zip(y1, k1, k2, k3, k4, strict=True)
    ]
    n, e, d = state.position_ned_m
    position = (
        n + sixth * (y1[0] + 2 * (y2[0] + y3[0]) + y4[0]),
        e + sixth * (y1[1] + 2 * (y2[1] + y3[1]) + y4[1]),
        d + sixth * (y1[2] + 2 * (y2[2] + y3[2]) + y4[2]),
    )
    return VehicleState(position, (vn, ve, vd), normalised((qw, qx, qy, qz)), (p, q, r), motors_end, False)


def _touch_down(state: VehicleState) -> VehicleState:
    """Held by the ground: at rest, level at its heading (or as it fell, if flipped)."""
    vn, ve, vd = state.velocity_ned_m_s
    n, e, _ = state.position_ned_m
    tilt = tilt_rad(state.quaternion)
    resting: Quaternion = state.quaternion
    if tilt <= FLIPPED_RAD:
        resting = from_euler(0.0, 0.0, yaw_of(state.quaternion))
    impact = Impact(math.sqrt(vn * vn + ve * ve + vd * vd), tilt)
    return VehicleState((n, e, 0.0), ZERO3, resting, ZERO3, state.motors, True, impact)


class RigidBody:
    """The rigid-body quadcopter as a `Plant`."""

    def __init__(self, params: VehicleParams, state: VehicleState | None = None) -> None:
        self._params = params
        self._state = state or VehicleState()

    @property
    def state(self) -> VehicleState:
        """The true state now."""
        return self._state

    def step(self, motor_commands: Vec4, wind_ned_m_s: Vec3, dt_s: float) -> None:
        """Let `dt_s` pass."""
        self._state = step(self._params, self._state, motor_commands, wind_ned_m_s, dt_s)
