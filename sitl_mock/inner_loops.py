"""The autopilot's own cascade: position P, velocity PI, attitude P, body-rate PI; after PX4's multicopter controllers.

NED and FRD; thrust and torques normalised as PX4 does (thrust 0..1, torque -1..1). A setpoint enters the cascade at
its own level. Pure functions over `LoopState`; gains and limits of PX4 1.13 (MPC_*, MC_*) without the derivative
terms. The rate gains are not PX4's: they are chosen so that a step of the rates is answered as was recorded, by a
vehicle with SIH's numbers and an estimate 5 ms old. MC_ROLLRATE_MAX and its like limit what the attitude loop asks
for; body rates that come over MAVLink go to the rate loop as they are (PX4's mavlink_receiver and mc_rate_control).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl_mock.attitude_loop import wanted_rates
from sitl_mock.geometry import ZERO3, Quaternion, Vec3, from_euler, yaw_of
from sitl_mock.sensors import Estimate


class PositionSetpoint(NamedTuple):
    """What to follow. A None coordinate is not controlled in position, nor in velocity if that is None too.

    Without a yaw the nose stays where it is, but for the yaw rate, which is also led along a yaw.
    """

    position_ned_m: tuple[float | None, float | None, float | None] = (None, None, None)
    velocity_ned_m_s: tuple[float | None, float | None, float | None] = ZERO3
    acceleration_ned_m_s2: Vec3 = ZERO3
    yaw_rad: float | None = None
    yaw_rate_rad_s: float = 0.0


class AttitudeSetpoint(NamedTuple):
    """Attitude FRD to NED, collective thrust, and a yaw rate about the vertical as feed-forward."""

    quaternion: Quaternion
    thrust_norm: float
    yaw_rate_rad_s: float = 0.0


class RatesSetpoint(NamedTuple):
    """Body rates and collective thrust; a None axis is not corrected."""

    rates_frd_rad_s: tuple[float | None, float | None, float | None]
    thrust_norm: float


class TorqueSetpoint(NamedTuple):
    """Normalised torques about roll, pitch, yaw axis and collective thrust, as the mixer takes them."""

    torque_frd_norm: Vec3
    thrust_norm: float


Setpoint = PositionSetpoint | AttitudeSetpoint | RatesSetpoint | TorqueSetpoint


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains and limits. Position 1/s; velocity (m/s^2)/(m/s) and (m/s^2)/m; attitude 1/s; rate norm/(rad/s), norm/rad.

    The largest speed towards north, east and down; upwards it may be another, `climb_max_m_s`.

    `yaw_weight`: part of the yaw error that the attitude loop counts beside the tilt (MC_YAW_WEIGHT).
    """

    hover_thrust_norm: float = 0.4905
    gravity_m_s2: float = 9.81
    position_p: Vec3 = (0.95, 0.95, 1.0)
    velocity_p: Vec3 = (1.8, 1.8, 4.0)
    velocity_i: Vec3 = (0.4, 0.4, 2.0)
    attitude_p: Vec3 = (6.5, 6.5, 2.8)
    yaw_weight: float = 0.4
    rate_p: Vec3 = (0.11, 0.11, 0.145)
    rate_i: Vec3 = (0.1, 0.1, 0.1)
    rate_integral_max_norm: float = 0.3
    speed_max_m_s: Vec3 = (12.0, 12.0, 1.5)
    climb_max_m_s: float | None = None
    integral_max_m_s2: Vec3 = (15.0, 15.0, 5.0)
    rates_max_rad_s: Vec3 = (math.radians(220.0), math.radians(220.0), math.radians(200.0))
    tilt_max_rad: float = math.radians(45.0)
    thrust_min_norm: float = 0.12


class LoopState(NamedTuple):
    """Integrators, and the last attitude and rates asked for (for ATTITUDE_TARGET; NaN: a rate not asked for)."""

    velocity_integral_m_s2: Vec3 = ZERO3
    rate_integral_norm: Vec3 = ZERO3
    attitude_target: Quaternion = (1.0, 0.0, 0.0, 0.0)
    rates_target_rad_s: Vec3 = ZERO3


def step(
    gains: Gains, state: LoopState, setpoint: Setpoint, estimate: Estimate, dt_s: float
) -> tuple[TorqueSetpoint, LoopState]:
    """One pass of the cascade from the setpoint's own level down to torques and thrust."""
    if isinstance(setpoint, TorqueSetpoint):
        return setpoint, state
    if isinstance(setpoint, PositionSetpoint):
        setpoint, state = position_loop(gains, state, setpoint, estimate, dt_s)
    if isinstance(setpoint, AttitudeSetpoint):
        state = LoopState(state.velocity_integral_m_s2, state.rate_integral_norm, setpoint.quaternion)
        setpoint = attitude_loop(gains, setpoint, estimate)
    return rate_loop(gains, state, setpoint, estimate, dt_s)


def position_loop(
    gains: Gains, state: LoopState, setpoint: PositionSetpoint, estimate: Estimate, dt_s: float
) -> tuple[AttitudeSetpoint, LoopState]:
    """Position P and velocity PI to a demanded acceleration, and that to attitude and thrust.

    What the tilt limit leaves of the demand is taken from the error that is integrated (PX4's anti-windup).
    """
    errors = velocity_errors(gains, setpoint, estimate)
    pushed, held = setpoint.acceleration_ned_m_s2, state.velocity_integral_m_s2
    p, i = gains.velocity_p, gains.velocity_i
    demanded = (
        pushed[0] + p[0] * errors[0] + held[0],
        pushed[1] + p[1] * errors[1] + held[1],
        pushed[2] + p[2] * errors[2] + held[2],
    )
    yaw_rad = yaw_of(estimate.quaternion) if setpoint.yaw_rad is None else setpoint.yaw_rad
    attitude, share = attitude_for(gains, demanded, yaw_rad, setpoint.yaw_rate_rad_s)
    lost = 2.0 * (1.0 - share)
    north = errors[0] - lost * demanded[0] / p[0] if lost else errors[0]
    east = errors[1] - lost * demanded[1] / p[1] if lost else errors[1]
    most = gains.integral_max_m_s2
    integral = (
        _limited(held[0] + i[0] * north * dt_s, most[0]),
        _limited(held[1] + i[1] * east * dt_s, most[1]),
        _limited(held[2] + i[2] * errors[2] * dt_s, most[2]),
    )
    return attitude, LoopState(integral, state.rate_integral_norm)


def velocity_errors(gains: Gains, setpoint: PositionSetpoint, estimate: Estimate) -> Vec3:
    """What the velocities lack; an axis without position and velocity lacks nothing."""
    wanted = [0.0, 0.0, 0.0]
    is_free = [False, False, False]
    for axis in range(3):
        speed, target = setpoint.velocity_ned_m_s[axis], setpoint.position_ned_m[axis]
        is_free[axis] = speed is None and target is None
        wanted[axis] = speed or 0.0
        if target is not None:
            wanted[axis] += gains.position_p[axis] * (target - estimate.position_ned_m[axis])
    north, east, down = wanted
    speed, fastest = math.hypot(north, east), gains.speed_max_m_s[0]
    if speed > fastest:
        north, east = north * fastest / speed, east * fastest / speed
    sink = gains.speed_max_m_s[2]
    climb = sink if gains.climb_max_m_s is None else gains.climb_max_m_s
    down = max(-climb, min(sink, down))
    vn, ve, vd = estimate.velocity_ned_m_s
    return (
        0.0 if is_free[0] else north - vn,
        0.0 if is_free[1] else east - ve,
        0.0 if is_free[2] else down - vd,
    )


def attitude_for(
    gains: Gains, acceleration_ned_m_s2: Vec3, yaw_rad: float, yaw_rate_rad_s: float = 0.0
) -> tuple[AttitudeSetpoint, float]:
    """Attitude and thrust that give an acceleration, and the share of its horizontal part that the tilt limit leaves.

    The rotors' force per mass f = a - g e3 must lie along -z of the body. In the frame turned by the yaw, the body's
    z axis (third column of Ry(pitch) Rx(roll)) is (sin pitch cos roll, -sin roll, cos pitch cos roll) = -f / |f|.
    """
    north, east, down = acceleration_ned_m_s2
    up = max(gains.gravity_m_s2 - down, 0.2 * gains.gravity_m_s2)
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    ahead, right = cos_yaw * north + sin_yaw * east, -sin_yaw * north + cos_yaw * east
    sideways, most = math.hypot(ahead, right), up * math.tan(gains.tilt_max_rad)
    share = most / sideways if sideways > most else 1.0
    ahead, right = share * ahead, share * right
    force = math.sqrt(ahead * ahead + right * right + up * up)
    thrust = max(gains.thrust_min_norm, min(1.0, gains.hover_thrust_norm * force / gains.gravity_m_s2))
    quaternion = from_euler(math.asin(right / force), math.atan2(-ahead, up), yaw_rad)
    return AttitudeSetpoint(quaternion, thrust, yaw_rate_rad_s), share


def attitude_loop(gains: Gains, setpoint: AttitudeSetpoint, estimate: Estimate) -> RatesSetpoint:
    """Attitude P to body rates. An attitude that is NaN or zero asks for nothing."""
    if not 0.0 < sum(part * part for part in setpoint.quaternion) < math.inf:
        return RatesSetpoint((None, None, None), setpoint.thrust_norm)
    rates = wanted_rates(
        estimate.quaternion,
        setpoint.quaternion,
        setpoint.yaw_rate_rad_s,
        gains.attitude_p,
        gains.yaw_weight,
        gains.rates_max_rad_s,
    )
    return RatesSetpoint(rates, setpoint.thrust_norm)


def rate_loop(
    gains: Gains, state: LoopState, setpoint: RatesSetpoint, estimate: Estimate, dt_s: float
) -> tuple[TorqueSetpoint, LoopState]:
    """Body-rate PI to normalised torque."""
    (roll, pitch, yaw), (p, q, r) = setpoint.rates_frd_rad_s, estimate.rates_frd_rad_s
    errors = (
        0.0 if roll is None else roll - p,
        0.0 if pitch is None else pitch - q,
        0.0 if yaw is None else yaw - r,
    )
    held, i, most = state.rate_integral_norm, gains.rate_i, gains.rate_integral_max_norm
    integral = (
        _limited(held[0] + i[0] * errors[0] * dt_s, most),
        _limited(held[1] + i[1] * errors[1] * dt_s, most),
        _limited(held[2] + i[2] * errors[2] * dt_s, most),
    )
    p_gains = gains.rate_p
    torque = (
        _limited(p_gains[0] * errors[0] + integral[0], 1.0),
        _limited(p_gains[1] * errors[1] + integral[1], 1.0),
        _limited(p_gains[2] * errors[2] + integral[2], 1.0),
    )
    targets = (
        math.nan if roll is None else roll,
        math.nan if pitch is None else pitch,
        math.nan if yaw is None else yaw,
    )
    after = LoopState(state.velocity_integral_m_s2, integral, state.attitude_target, targets)
    return TorqueSetpoint(torque, setpoint.thrust_norm), after


def _limited(value: float, limit: float) -> float:
    return -limit if value < -limit else limit if value > limit else value
