"""The controller: observer, law, limits and actuator replica composed.

    measurement at t -> correct each chain -> predict to when the new command will act (t + delay, and the lag)
    -> w = ref^(4) - sigma - sum gamma_i (zeta_i - ref^(i-1)) -> U = sat_N(B^-1 w) -> the two integrators before thrust and
    yaw -> Euler accelerations as the body's -> remember the w that U really makes, for the observer

Output feedback is Kim, Pyrkin, Borisov, eqs. (7), (8), from position and yaw alone with B = b4(0, yaw); the measured roll,
pitch and rates serve only to turn the commanded Euler accelerations into those of the body. State feedback is eq. (6) on
the measured state, with b4 and q4.
"""

from __future__ import annotations

from mavquad.control.actuation import Command, appended
from mavquad.control.chains import look_ahead, measured, observed, observed_yaw, rotors_at, with_friction
from mavquad.control.euler import body_acceleration, euler_rates, trig
from mavquad.control.integrators import Integrator, advanced
from mavquad.control.inversion import Bounds, Gain, Realised, realise
from mavquad.control.limits import ChannelLimits, Demand, DemandLimits, demand
from mavquad.control.observer import Estimate
from mavquad.control.params import LawParams
from mavquad.control.reference import shifted
from mavquad.control.state import YAW, Chains, ControllerState, Estimates, Rotors, StepResult, Trace, Z, begin
from mavquad.control.tuning import Tuning, tuning
from mavquad.frames import unwrap_near
from mavquad.types import Attitude, Position, ReferencePoint, TorqueCommand

__all__ = ["ControllerState", "StepResult", "Trace", "begin", "observe_attitude", "step"]

HOLD_MAX_S = 0.1
"""The vehicle holds a thrust, it does not go on integrating: a longer gap counts as this much for the integrators."""


def observe_attitude(params: LawParams, state: ControllerState, attitude: Attitude) -> ControllerState:
    """Correct the yaw chain; roll, pitch and rates are not used. A stamp already seen changes nothing."""
    yaw, stale = _yaw_observed(tuning(params), state, attitude)
    if yaw is state.estimates[YAW] and not stale:
        return state
    z, _, x, y = state.estimates
    return _with(state, (z, yaw, x, y), state.stale_positions, state.stale_attitudes + stale)


def _yaw_observed(tune: Tuning, state: ControllerState, attitude: Attitude) -> tuple[Estimate, int]:
    """The yaw chain after an attitude, and 1 when the attitude was older than it and refused."""
    yaw = state.estimates[YAW]
    if attitude.stamp_us <= yaw.stamp_us:
        return yaw, int(attitude.stamp_us < yaw.stamp_us)
    return observed_yaw(tune, state, attitude.stamp_us, attitude.yaw_rad), 0


def step(
    params: LawParams, state: ControllerState, position: Position, attitude: Attitude, reference: ReferencePoint
) -> StepResult:
    """One command from one position.

    Args:
        params: the law's configuration.
        state: from `begin`, or the step before.
        position: a new one; when it is older than the last, the last command is given again and the position counted.
        attitude: the latest.
        reference: of the moment `position.stamp_us`; it is carried on by its own derivatives to when the command acts.
    """
    if position.stamp_us < state.estimates[Z].stamp_us and state.trace is not None:
        refused = _with(state, state.estimates, state.stale_positions + 1, state.stale_attitudes)
        return StepResult(state.command, refused, state.trace)
    tune = tuning(params)
    t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    rates = euler_rates(t, attitude.rates_flu_rad_s)
    yaw_now, stale_attitude = _yaw_observed(tune, state, attitude)
    if params.form == "output_feedback":
        rotors, estimates, gain = state.rotors, observed(tune, state, position, yaw_now), Gain(t, full=False)
    else:
        rotors = rotors_at(tune, state, position.stamp_us)
        estimates, gain = measured(tune, state, position, yaw_now, t, rates, rotors)
    act_us = position.stamp_us + tune.delay_us
    law_us = act_us + tune.bridge_us
    bounds = _bounds(tune, state.trim_m_s2)
    flying = _before(state.commands, act_us)
    ahead = look_ahead(tune, estimates, flying, law_us)
    references = _references(reference, (law_us - position.stamp_us) * 1e-6, ahead)
    asked = demand(tune.gammas, references, ahead, _demand_limits(tune, bounds))
    thrust, yaw = _integrated(state, bounds, act_us)
    gain = with_friction(tune, gain, references)
    done = realise(gain, asked.w, tune.levels, thrust, yaw, bounds)
    command = TorqueCommand(
        body_acceleration(t, rates, (done.inputs[2], done.inputs[3], yaw.value)), state.trim_m_s2 + thrust.value
    )
    trace = _trace(position, estimates, reference, attitude, asked, done)
    after = ControllerState(
        estimates=estimates,
        commands=appended(state.commands, (act_us, done.w), min(position.stamp_us, estimates[YAW].stamp_us)),
        thrust=Integrator(thrust.value, thrust.rate, done.inputs[0]),
        yaw=Integrator(yaw.value, yaw.rate, done.inputs[1]),
        rotors=rotors if params.form == "output_feedback" else _sent(rotors, act_us, thrust.value, yaw.value),
        trim_m_s2=state.trim_m_s2,
        command=command,
        trace=trace,
        stale_positions=state.stale_positions,
        stale_attitudes=state.stale_attitudes + stale_attitude,
    )
    return StepResult(command, after, trace)


def _before(commands: tuple[Command, ...], act_us: int) -> tuple[Command, ...]:
    """The commands that the new one comes after; it replaces the answer to an earlier look at the same moment."""
    if commands[-1][0] < act_us:
        return commands
    return tuple(command for command in commands if command[0] < act_us) or commands[:1]


def _integrated(state: ControllerState, bounds: Bounds, act_us: int) -> tuple[Integrator, Integrator]:
    """u1 and u2 when the new command starts to act."""
    dt_s = min((act_us - state.commands[-1][0]) * 1e-6, HOLD_MAX_S)
    yaw_high = bounds.yaw_high_rad_s2
    return (
        advanced(state.thrust, dt_s, bounds.thrust_low_m_s2, bounds.thrust_high_m_s2),
        advanced(state.yaw, dt_s, -yaw_high, yaw_high),
    )


def _bounds(tune: Tuning, trim_m_s2: float) -> Bounds:
    return Bounds(
        (tune.thrust_min_share - 1.0) * trim_m_s2, (tune.thrust_max_share - 1.0) * trim_m_s2, tune.yaw_input_max_rad_s2
    )


def _demand_limits(tune: Tuning, bounds: Bounds) -> DemandLimits:
    vertical = ChannelLimits(tune.climb_speed_m_s, bounds.thrust_low_m_s2, bounds.thrust_high_m_s2)
    return DemandLimits(vertical, tune.yaw_limits, tune.horizontal_limits)


def _references(reference: ReferencePoint, ahead_s: float, chains: Chains) -> Chains:
    """The reference carried on to the moment that the law acts for; yaw by the turn that is nearest."""
    z, yaw, x, y = (shifted(channel, ahead_s) for channel in reference.channels())
    return (z, (unwrap_near(yaw[0], chains[YAW][0]), *yaw[1:]), x, y)


def _sent(rotors: Rotors, act_us: int, thrust: float, yaw: float) -> Rotors:
    sent = appended(rotors.sent, (act_us, (thrust, yaw, 0.0, 0.0)), rotors.stamp_us)
    return Rotors(rotors.stamp_us, rotors.lagged, sent)


def _trace(
    position: Position,
    estimates: Estimates,
    reference: ReferencePoint,
    attitude: Attitude,
    asked: Demand,
    done: Realised,
) -> Trace:
    px, py, pz = position.position_nwu_m
    z, yaw, x, y = (estimate.values for estimate in estimates)
    yaw_error = unwrap_near(reference.yaw_rad[0] - attitude.yaw_rad, 0.0)
    return Trace(
        stamp_us=position.stamp_us,
        zeta_hat=(z[:-1], yaw[:-1], x[:-1], y[:-1]),
        sigma=(z[-1], yaw[-1], x[-1], y[-1]),
        error=(reference.z_m[0] - pz, yaw_error, reference.x_m[0] - px, reference.y_m[0] - py),
        demanded=asked.w,
        inputs=done.inputs,
        limits_active=asked.active + done.active,
    )


def _with(state: ControllerState, estimates: Estimates, stale_positions: int, stale_attitudes: int) -> ControllerState:
    return ControllerState(
        estimates=estimates,
        commands=state.commands,
        thrust=state.thrust,
        yaw=state.yaw,
        rotors=state.rotors,
        trim_m_s2=state.trim_m_s2,
        command=state.command,
        trace=state.trace,
        stale_positions=stale_positions,
        stale_attitudes=stale_attitudes,
    )
