"""The four chains brought to the moment of a measurement, by the observer or from the full state, and ahead of it."""

from __future__ import annotations

from mavquad.control.actuation import Command, advance, interval, lagged_input
from mavquad.control.euler import Trig
from mavquad.control.inversion import Gain
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.normal_form import BodyState, Friction, q4, zeta
from mavquad.control.observer import Estimate, correct, predict
from mavquad.control.params import CHAIN_LENGTH
from mavquad.control.state import YAW, Chains, ControllerState, Estimates, Rotors, X, Y, Z
from mavquad.control.tuning import Tuning
from mavquad.frames import unwrap_near
from mavquad.types import Position, Vec3, Vec4


def observed_yaw(tune: Tuning, state: ControllerState, stamp_us: int, yaw_rad: float) -> Estimate:
    """The yaw chain corrected by a yaw of any turn: it is unwrapped beside the prediction."""
    before = state.estimates[YAW]
    gains = tune.observers[YAW]
    predicted = predict(before, YAW, interval(CHAIN_LENGTH, tune.lag_s, state.commands, before.stamp_us, stamp_us))
    return correct(gains, predicted, unwrap_near(yaw_rad, predicted.values[0]), stamp_us - before.stamp_us)


def observed(tune: Tuning, state: ControllerState, position: Position, yaw: Estimate) -> Estimates:
    """z, x, y predicted to the position's stamp and corrected; yaw as given."""
    z, _, x, y = state.estimates
    px, py, pz = position.position_nwu_m
    span = interval(CHAIN_LENGTH, tune.lag_s, state.commands, z.stamp_us, position.stamp_us)
    dt_us = span.duration_us
    gains = tune.observers[Z]
    return (
        correct(gains, predict(z, Z, span), pz, dt_us),
        yaw,
        correct(gains, predict(x, X, span), px, dt_us),
        correct(gains, predict(y, Y, span), py, dt_us),
    )


def look_ahead(tune: Tuning, estimates: Estimates, commands: tuple[Command, ...], until_us: int) -> Chains:
    """(zeta_1 .. zeta_4, sigma) of each channel at a later moment, with the commands that are in flight."""
    z, yaw, x, y = estimates
    span = interval(CHAIN_LENGTH, tune.lag_s, commands, z.stamp_us, until_us)
    yaw_span = (
        span if yaw.stamp_us == z.stamp_us else interval(CHAIN_LENGTH, tune.lag_s, commands, yaw.stamp_us, until_us)
    )
    return (
        advance(z.values, z.lagged_input, span, Z)[0],
        advance(yaw.values, yaw.lagged_input, yaw_span, YAW)[0],
        advance(x.values, x.lagged_input, span, X)[0],
        advance(y.values, y.lagged_input, span, Y)[0],
    )


def rotors_at(tune: Tuning, state: ControllerState, stamp_us: int) -> Rotors:
    """u1 and u2 behind the rotors' lag at a moment, from the thrusts and yaw inputs that were sent."""
    before = state.rotors
    span = interval(CHAIN_LENGTH, tune.lag_s, before.sent, before.stamp_us, stamp_us)
    lagged = (lagged_input(before.lagged[0], span, 0), lagged_input(before.lagged[1], span, 1))
    return Rotors(stamp_us, lagged, before.sent)


def _rates_of(tune: Tuning, state: ControllerState, rotors: Rotors) -> tuple[float, float]:
    """Their derivatives: a_d = (sent - a) / lag, or what is being integrated when there is no lag."""
    if tune.lag_s <= 0.0:
        return state.thrust.rate, state.yaw.rate
    sent = interval(CHAIN_LENGTH, tune.lag_s, rotors.sent, rotors.stamp_us, rotors.stamp_us).first
    return (sent[0] - rotors.lagged[0]) / tune.lag_s, (sent[1] - rotors.lagged[1]) / tune.lag_s


def measured(
    tune: Tuning, state: ControllerState, position: Position, yaw: Estimate, t: Trig, rates: Vec3, rotors: Rotors
) -> tuple[Estimates, Gain]:
    """The chains from the measured state, sigma zero, and the gain and drift there, known friction included: eq. (6).

    Args:
        tune: gains and limits.
        state: before this step.
        position: measured.
        yaw: the yaw chain, which already has this attitude.
        t: of the measured attitude.
        rates: Euler rates measured.
        rotors: at the position's stamp.
    """
    thrust_rate, yaw_input_rate = _rates_of(tune, state, rotors)
    body = BodyState(
        euler_rates_rad_s=rates,
        thrust_m_s2=state.trim_m_s2 + rotors.lagged[0],
        thrust_rate_m_s3=thrust_rate,
        yaw_input_rad_s2=rotors.lagged[1],
        yaw_input_rate_rad_s3=yaw_input_rate,
    )
    px, py, pz = position.position_nwu_m
    vx, vy, vz = position.velocity_nwu_m_s
    z, _, x, y = state.estimates
    frictionless = zeta(t, (pz, yaw.values[0], px, py), (vz, rates[2], vx, vy), body, GRAVITY_M_S2)
    a, b = tune.friction_1_s, tune.angular_friction_1_s
    chains = tuple(_slowed(chain, f) for chain, f in zip(frictionless, (a, b, a, a), strict=True))
    span = interval(CHAIN_LENGTH, tune.lag_s, state.commands, z.stamp_us, position.stamp_us)

    def replaced(before: Estimate, channel: int) -> Estimate:
        lagged = lagged_input(before.lagged_input, span, channel)
        return Estimate(position.stamp_us, (*chains[channel], 0.0), lagged)

    estimates = (
        replaced(z, Z),
        Estimate(yaw.stamp_us, (*chains[YAW], 0.0), yaw.lagged_input),
        replaced(x, X),
        replaced(y, Y),
    )
    qz, qyaw, qx, qy = q4(t, body, Friction(a, (b, b, b)), vertical_jerk_m_s3=chains[Z][3])
    drift = (qz, qyaw, qx - a * chains[X][3], qy - a * chains[Y][3])
    return estimates, Gain(t, full=True, thrust_m_s2=body.thrust_m_s2, drift=drift)


def _slowed(chain: Vec4, friction_1_s: float) -> Vec4:
    """zeta_3 and zeta_4 of a chain whose second derivative also has -friction zeta_2."""
    first, second, third, fourth = chain
    third -= friction_1_s * second
    return (first, second, third, fourth - friction_1_s * third)


def with_friction(tune: Tuning, gain: Gain, references: Chains) -> Gain:
    """For the output feedback: the friction that a motion along the reference meets. Nothing is fed back by it.

    With x_dd = T theta - a x_d and theta_dd = u - b theta_d, the fourth derivative of x is
    T u - (a + b) x_ddd - a b x_dd; that of z has a alone, that of yaw b alone.
    """
    a, b = tune.friction_1_s, tune.angular_friction_1_s
    if gain.full or (a == 0.0 and b == 0.0):
        return gain  # eq. (6) has it in q4 already
    z, yaw, x, y = references
    qz, qyaw, qx, qy = gain.drift
    return Gain(
        gain.t,
        gain.full,
        gain.thrust_m_s2,
        (
            qz - a * z[3],
            qyaw - b * yaw[3],
            qx - (a + b) * x[3] - a * b * x[2],
            qy - (a + b) * y[3] - a * b * y[2],
        ),
    )
