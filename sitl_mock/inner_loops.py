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

from sitl_mock.attitude_loop import wanted_rates
from sitl_mock.geometry import ZERO3, Quaternion, Vec3, from_euler, yaw_of
from sitl_mock.sensors import Estimate


@dataclass(frozen=True, slots=True)
class PositionSetpoint:
    """What to follow. A None coordinate is not controlled in position, its velocity is still followed."""

    position_ned_m: tuple[float | None, float | None, float | None] = (None, None, None)
    velocity_ned_m_s: Vec3 = ZERO3
    acceleration_ned_m_s2: Vec3 = ZERO3
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """Attitude FRD to NED, collective thrust, and a yaw rate about the vertical as feed-forward."""

    quaternion: Quaternion
    thrust_norm: float
    yaw_rate_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RatesSetpoint:
    """Body rates and collective thrust; a None axis is not corrected."""

    rates_frd_rad_s: tuple[float | None, float | None, float | None]
    thrust_norm: float


@dataclass(frozen=True, slots=True)
class TorqueSetpoint:
    """Normalised torques about roll, pitch, yaw axis and collective thrust, as the mixer takes them."""

    torque_frd_norm: Vec3
    thrust_norm: float


Setpoint = PositionSetpoint | AttitudeSetpoint | RatesSetpoint | TorqueSetpoint


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains and limits. Position 1/s; velocity (m/s^2)/(m/s) and (m/s^2)/m; attitude 1/s; rate norm/(rad/s), norm/rad.

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
    speed_max_m_s: Vec3 = (5.0, 5.0, 1.5)
    integral_max_m_s2: Vec3 = (15.0, 15.0, 5.0)
    rates_max_rad_s: Vec3 = (math.radians(220.0), math.radians(220.0), math.radians(200.0))
    tilt_max_rad: float = math.radians(60.0)
    thrust_min_norm: float = 0.12


@dataclass(frozen=True, slots=True)
class LoopState:
    """Integrators, and the last attitude and rates asked for (for ATTITUDE_TARGET; NaN: a rate not asked for)."""

    velocity_integral_m_s2: Vec3 = ZERO3
    rate_integral_norm: Vec3 = ZERO3
    attitude_target: Quaternion = (1.0, 0.0, 0.0, 0.0)
    rates_target_rad_s: Vec3 = ZERO3


def step(
    gains: Gains, state: LoopState, setpoint: Setpoint, estimate: Estimate, dt_s: float
) -> tuple[TorqueSetpoint, LoopState]:
    """One pass of the cascade from the setpoint's own level down to torques and thrust."""
    if isinstance(setpoint, PositionSetpoint):
        setpoint, state = position_loop(gains, state, setpoint, estimate, dt_s)
    if isinstance(setpoint, AttitudeSetpoint):
        state = LoopState(state.velocity_integral_m_s2, state.rate_integral_norm, setpoint.quaternion)
        setpoint = attitude_loop(gains, setpoint, estimate)
    if isinstance(setpoint, RatesSetpoint):
        return rate_loop(gains, state, setpoint, estimate, dt_s)
    return setpoint, state


def position_loop(
    gains: Gains, state: LoopState, setpoint: PositionSetpoint, estimate: Estimate, dt_s: float
) -> tuple[AttitudeSetpoint, LoopState]:
    """Position P and velocity PI to a demanded acceleration, and that to attitude and thrust."""
    demanded = [0.0, 0.0, 0.0]
    integral = [0.0, 0.0, 0.0]
    for i in range(3):
        speed = setpoint.velocity_ned_m_s[i]
        target = setpoint.position_ned_m[i]
        if target is not None:
            speed += gains.position_p[i] * (target - estimate.position_ned_m[i])
        error = _limited(speed, gains.speed_max_m_s[i]) - estimate.velocity_ned_m_s[i]
        total = state.velocity_integral_m_s2[i] + gains.velocity_i[i] * error * dt_s
        integral[i] = _limited(total, gains.integral_max_m_s2[i])
        demanded[i] = setpoint.acceleration_ned_m_s2[i] + gains.velocity_p[i] * error + integral[i]
    yaw_rad = yaw_of(estimate.quaternion) if setpoint.yaw_rad is None else setpoint.yaw_rad
    attitude = attitude_for(gains, (demanded[0], demanded[1], demanded[2]), yaw_rad)
    return attitude, LoopState((integral[0], integral[1], integral[2]), state.rate_integral_norm)


def attitude_for(gains: Gains, acceleration_ned_m_s2: Vec3, yaw_rad: float) -> AttitudeSetpoint:
    """Attitude and thrust that give an acceleration.

    The rotors' force per mass f = a - g e3 must lie along -z of the body. In the frame turned by the yaw, the body's
    z axis (third column of Ry(pitch) Rx(roll)) is (sin pitch cos roll, -sin roll, cos pitch cos roll) = -f / |f|.
    """
    north, east, down = acceleration_ned_m_s2
    up = max(gains.gravity_m_s2 - down, 0.2 * gains.gravity_m_s2)
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    ahead, right = cos_yaw * north + sin_yaw * east, -sin_yaw * north + cos_yaw * east
    sideways, most = math.hypot(ahead, right), up * math.tan(gains.tilt_max_rad)
    if sideways > most:
        ahead, right = ahead * most / sideways, right * most / sideways
    force = math.sqrt(ahead * ahead + right * right + up * up)
    thrust = max(gains.thrust_min_norm, min(1.0, gains.hover_thrust_norm * force / gains.gravity_m_s2))
    return AttitudeSetpoint(from_euler(math.asin(right / force), math.atan2(-ahead, up), yaw_rad), thrust)


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
    torque = [0.0, 0.0, 0.0]
    integral = [0.0, 0.0, 0.0]
    targets = [0.0, 0.0, 0.0]
    for i in range(3):
        wanted = setpoint.rates_frd_rad_s[i]
        targets[i] = math.nan if wanted is None else wanted
        error = 0.0 if wanted is None else wanted - estimate.rates_frd_rad_s[i]
        total = state.rate_integral_norm[i] + gains.rate_i[i] * error * dt_s
        integral[i] = _limited(total, gains.rate_integral_max_norm)
        torque[i] = _limited(gains.rate_p[i] * error + integral[i], 1.0)
    after = LoopState(
        state.velocity_integral_m_s2,
        (integral[0], integral[1], integral[2]),
        state.attitude_target,
        (targets[0], targets[1], targets[2]),
    )
    return TorqueSetpoint((torque[0], torque[1], torque[2]), setpoint.thrust_norm), after


def _limited(value: float, limit: float) -> float:
    return -limit if value < -limit else limit if value > limit else value
