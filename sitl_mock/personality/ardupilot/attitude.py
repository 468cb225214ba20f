"""ArduCopter's attitude control: a target that moves as the input asks, and the body that follows it.

The target is an attitude q_t with body rates w_t. What comes in moves it:

    rates        w_t runs to the rates asked for at no more than the acceleration limits (ATC_ACCEL_*_MAX, 0: at once)
    attitude     w_t runs to w_in + sqrt_control(e, 1 / ATC_INPUT_TC), e the turn from q_t to the attitude asked for
    q_t' = q_t w_t / 2

and the body follows: rates asked for = ATC_ANG_*_P times the turn from the body to q_t, plus w_t; the rate loop is a
PI on their error. So rates sent by MAVLink hold the attitude that they have led to, as on the real autopilot.

The rate gains are those of the parameters (ATC_RAT_*) for a vehicle with motors as quick as SITL's, whose loop then
has `RATE_BANDWIDTH` = P times the angular acceleration of full torque; on slower motors a user would tune it down,
and so does `rate_gains`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.attitude_loop import wanted_rates
from sitl_mock.geometry import IDENTITY, ZERO3, Quaternion, Vec3, conjugate, multiply, normalised, rotate
from sitl_mock.plant import VehicleParams
from sitl_mock.sensors import Estimate

RATE_BANDWIDTH = (38.0, 38.0, 4.3)
"""1/s, what ATC_RAT_RLL_P 0.135 and ATC_RAT_YAW_P 0.3 make of SITL's vehicle."""
_RATE_INTEGRAL = (1.0, 1.0, 0.07)
"""1/s, ATC_RAT_*_I over P."""
_INTEGRAL_MAX = 0.5
_FILTER = 1.0 - math.exp(-2.0 * math.pi * 20.0 * 0.004)
"""What a first-order filter at 20 Hz (ATC_RAT_*_FLTT) lets through in one tick of 4 ms."""
_ATTITUDE_P = (4.5, 4.5, 4.5)
_ATTITUDE_P_OF_RATES = (1.5, 1.5, 1.5)
"""1/s, towards an attitude that was asked for (ATC_ANG_*_P), and towards the one that rates have led to: chosen so that a
step of the rates is answered as was recorded."""
_NO_LIMITS = (math.inf, math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class RatesInput:
    """Body rates asked for, FRD."""

    rates_frd_rad_s: Vec3


@dataclass(frozen=True, slots=True)
class AttitudeInput:
    """An attitude asked for, FRD to NED, with body rates as feed-forward."""

    quaternion: Quaternion
    rates_frd_rad_s: Vec3 = ZERO3


@dataclass(frozen=True, slots=True)
class AttitudeState:
    """The target and the rate loop's integrators."""

    target: Quaternion = IDENTITY
    target_rates_rad_s: Vec3 = ZERO3
    integral_norm: Vec3 = ZERO3
    filtered_rad_s: Vec3 = ZERO3


@dataclass(frozen=True, slots=True)
class Shape:
    """Limits of the target's motion: angular accelerations in rad/s^2 (0: none) and ATC_INPUT_TC in s."""

    acceleration_rad_s2: Vec3
    input_tc_s: float


@dataclass(frozen=True, slots=True)
class RateGains:
    """Proportional gain in full torque per rad/s, and integral over proportional gain in 1/s."""

    p: Vec3
    i: Vec3 = _RATE_INTEGRAL


def torque_scale(vehicle: VehicleParams) -> Vec3:
    """Angular acceleration in rad/s^2 of full roll, pitch and yaw torque as `motors.mix` takes them.

    Plus: two motors differ by the full thrust, on the whole arm; x: each pair differs by 0.707 of it.
    """
    jx, jy, jz = vehicle.inertia_kg_m2
    lever_nm = vehicle.arm_m * vehicle.motor_thrust_max_n * (1.0 if vehicle.frame == "plus" else math.sqrt(2.0))
    return (lever_nm / jx, lever_nm / jy, 2.0 * vehicle.motor_torque_max_nm / jz)


def rate_gains(vehicle: VehicleParams) -> RateGains:
    """The gains that give the bandwidth above, less where the motors lag: 1 / (1 / w + 2 tau)."""
    lag_s = 2.0 * vehicle.motor_time_constant_s
    roll, pitch, yaw = (
        w / (1.0 + w * lag_s) / scale for w, scale in zip(RATE_BANDWIDTH, torque_scale(vehicle), strict=True)
    )
    return RateGains((roll, pitch, yaw))


def move_target(shape: Shape, state: AttitudeState, wanted: RatesInput | AttitudeInput, dt_s: float) -> AttitudeState:
    """Let the target move for `dt_s`."""
    rates = _target_rates(shape, state, wanted, dt_s)
    half = 0.5 * dt_s
    target = normalised(multiply(state.target, (1.0, half * rates[0], half * rates[1], half * rates[2])))
    return AttitudeState(target, rates, state.integral_norm, state.filtered_rad_s)


def _target_rates(shape: Shape, state: AttitudeState, wanted: RatesInput | AttitudeInput, dt_s: float) -> Vec3:
    asked = wanted.rates_frd_rad_s
    if isinstance(wanted, AttitudeInput):
        error = rotation_vector(multiply(conjugate(state.target), wanted.quaternion))
        asked = _towards(shape, error, asked)
    limits = shape.acceleration_rad_s2
    x, y, z = (
        _slewed(now, then, limit * dt_s)
        for now, then, limit in zip(state.target_rates_rad_s, asked, limits, strict=True)
    )
    return (x, y, z)


def _towards(shape: Shape, error_rad: Vec3, feed_forward_rad_s: Vec3) -> Vec3:
    gain = 1.0 / max(shape.input_tc_s, 0.01)
    x, y, z = (
        forward + sqrt_control(error, gain, limit)
        for error, forward, limit in zip(error_rad, feed_forward_rad_s, shape.acceleration_rad_s2, strict=True)
    )
    return (x, y, z)


def sqrt_control(error: float, gain: float, deceleration: float) -> float:
    """A speed towards the error's end: gain times the error, but never more than can be braked away.

    v = gain e for |e| < a / gain^2, beyond it sqrt(2 a (|e| - a / (2 gain^2))): the two meet with one slope.
    """
    if deceleration <= 0.0:
        return gain * error
    bend = deceleration / (gain * gain)
    if abs(error) <= bend:
        return gain * error
    return math.copysign(math.sqrt(2.0 * deceleration * (abs(error) - bend / 2.0)), error)


def follow(
    gains: RateGains, state: AttitudeState, is_rates: bool, estimate: Estimate, dt_s: float
) -> tuple[Vec3, Vec3, AttitudeState]:
    """(torque as a share of the full one, body rates asked for in rad/s, state): the body follows the target."""
    forward = rotate(multiply(conjugate(estimate.quaternion), state.target), state.target_rates_rad_s)
    back_gains = _ATTITUDE_P_OF_RATES if is_rates else _ATTITUDE_P
    back = wanted_rates(estimate.quaternion, state.target, 0.0, back_gains, 1.0, _NO_LIMITS)
    wanted = (back[0] + forward[0], back[1] + forward[1], back[2] + forward[2])
    torque, integral, filtered = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    for i in range(3):
        filtered[i] = state.filtered_rad_s[i] + _FILTER * (wanted[i] - state.filtered_rad_s[i])
        error = filtered[i] - estimate.rates_frd_rad_s[i]
        change = gains.p[i] * gains.i[i] * error * dt_s
        integral[i] = _limited(state.integral_norm[i] + change, _INTEGRAL_MAX)
        torque[i] = _limited(gains.p[i] * error + integral[i], 1.0)
    sums, smooth = (integral[0], integral[1], integral[2]), (filtered[0], filtered[1], filtered[2])
    after = AttitudeState(state.target, state.target_rates_rad_s, sums, smooth)
    return (torque[0], torque[1], torque[2]), wanted, after


def rotation_vector(turn: Quaternion) -> Vec3:
    """The turn's axis times its angle, at most pi."""
    w, x, y, z = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sine < 1e-6 else 2.0 * math.atan2(sine, w) / sine
    return (scale * x, scale * y, scale * z)


def _slewed(now: float, then: float, most: float) -> float:
    return then if most <= 0.0 else now + _limited(then - now, most)


def _limited(value: float, limit: float) -> float:
    return -limit if value < -limit else limit if value > limit else value
