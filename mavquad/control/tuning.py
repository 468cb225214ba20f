"""What `LawParams` amount to at one depth: gains and limits in SI, worked out once and kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from mavquad.control.defaults import CHAIN_LENGTHS, YAW_LENGTHS, Defaults
from mavquad.control.gains import chain_gains
from mavquad.control.limits import DemandLimits, ratios
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.observer import ChainSpec, rows
from mavquad.control.params import LawParams
from mavquad.types import Depth, Vec3

VELOCITY, ACCELERATION, JERK = 1, 2, 3
"""Which state of a chain each further row measures, counted from 0."""


@dataclass(frozen=True, slots=True)
class ChannelTuning:
    """One kind of channel.

    Attributes:
        spec: the chain, its rows and its actuator.
        gammas: gamma_1 .. gamma_r.
        ratios: gamma_i / gamma_(i+1).
        integrators: how many stand before its input.
        ahead_us: from when a command arrives until the moment that the law acts for.
    """

    spec: ChainSpec
    gammas: tuple[float, ...]
    ratios: tuple[float, ...]
    integrators: int
    ahead_us: int

    def row(self, index: int) -> int:
        """Which of its rows measures this state; 0, the output's own, where none does."""
        places = [row.index for row in self.spec.rows]
        return places.index(index) if index in places else 0


@dataclass(frozen=True, slots=True)
class Tuning:
    """Numbers of the hot path."""

    depth: Depth
    state_feedback: bool
    constant_gain: bool
    vertical: ChannelTuning
    horizontal: ChannelTuning
    yaw: ChannelTuning
    levels: Vec3
    """N of sat_N of thrust, yaw, and roll and pitch."""
    friction_1_s: float
    angular_friction_1_s: float
    delay_us: int
    limits: DemandLimits
    yaw_input_max: float


@lru_cache(maxsize=64)
def tuning(params: LawParams, depth: Depth) -> Tuning:
    """The numbers behind a configuration at a depth."""
    own = params.own(depth)
    length, limits = CHAIN_LENGTHS[depth], params.limits
    yaw_rate, yaw_acceleration = map(math.radians, (limits.yaw_rate_max_deg_s, limits.yaw_acceleration_max_deg_s2))
    levels = params.saturation
    yaw_most = yaw_acceleration if depth == "torque" else yaw_rate
    return Tuning(
        depth=depth,
        state_feedback=params.form == "state_feedback",
        constant_gain=params.constant_gain(depth),
        vertical=_place(params, own, depth, _given(params.thrust_lag_s, own.thrust_lag_s), 0.0),
        horizontal=_place(
            params, own, depth, _given(params.lag_s, own.lag_s), _given(params.dead_time_s, own.dead_time_s)
        ),
        yaw=_turn(params, own, depth),
        levels=(
            {4: levels.thrust_snap_m_s4, 3: levels.thrust_jerk_m_s3, 2: math.inf}[length],
            levels.padded_yaw if params.yaw_padding else yaw_most,
            {4: levels.roll_pitch_rad_s2, 3: levels.roll_pitch_rad_s, 2: math.inf}[length],
        ),
        friction_1_s=_given(params.friction_1_s, own.friction_1_s),
        angular_friction_1_s=_given(params.angular_friction_1_s, own.angular_friction_1_s),
        delay_us=round(_given(params.delay_s, own.delay_s) * 1e6),
        limits=DemandLimits(
            speed_m_s=limits.approach_speed_max_m_s,
            climb_m_s=limits.climb_speed_max_m_s,
            yaw_rate_rad_s=yaw_rate,
            yaw_acceleration_rad_s2=yaw_acceleration,
            thrust_low_m_s2=limits.thrust_min_g * GRAVITY_M_S2,
            thrust_high_m_s2=limits.thrust_max_g * GRAVITY_M_S2,
            tilt_tangent=math.tan(math.radians(limits.tilt_max_deg)),
            jerk_m_s3=GRAVITY_M_S2 * limits.turn_rate_max_rad_s,
        ),
        yaw_input_max=yaw_most,
    )


def _given(value: float | None, own: float) -> float:
    return own if value is None else value


def _place(params: LawParams, own: Defaults, depth: Depth, lag_s: float, dead_s: float) -> ChannelTuning:
    """z, or x and y."""
    length = CHAIN_LENGTHS[depth]
    omega0 = _given(params.omega0_rad_s, own.omega0_rad_s)
    kappas = {0: _given(params.kappa_rad_s, own.kappa_per_omega0 * omega0)}
    measured = params.measured()
    if measured == "full" and params.velocity != "ignored":
        kappas[VELOCITY] = _given(params.velocity_kappa_rad_s, own.velocity_kappa_rad_s)
    if measured != "position_yaw":
        kappas[ACCELERATION] = _given(params.attitude_kappa_rad_s, own.attitude_kappa_rad_s)
    if measured == "full":
        kappas[JERK] = _given(params.rates_kappa_rad_s, own.rates_kappa_rad_s)
    kappas = {index: kappa for index, kappa in kappas.items() if index < length}
    spread = _given(params.observer_spread, own.observer_spread)
    spec = ChainSpec(
        length,
        rows(length, kappas, spread, {VELOCITY: params.velocity_slopes or 0, ACCELERATION: params.wind_slopes}),
        lag_s,
        round(dead_s * 1e6),
    )
    gammas = chain_gains(params.polynomial, length, omega0, params.poles)
    return ChannelTuning(spec, gammas, ratios(gammas), length - 2, _ahead_us(params, dead_s, lag_s))


def _turn(params: LawParams, own: Defaults, depth: Depth) -> ChannelTuning:
    length = YAW_LENGTHS[depth] + params.yaw_padding
    omega0 = _given(params.yaw_omega0_rad_s, own.yaw_omega0_rad_s)
    kappas = {0: _given(params.yaw_kappa_rad_s, own.yaw_kappa_per_omega0 * omega0)}
    if params.measured() == "full" and depth == "torque":
        kappas[1] = _given(params.rates_kappa_rad_s, own.rates_kappa_rad_s)
    lag_s = _given(params.yaw_lag_s, own.yaw_lag_s)
    dead_s = _given(params.yaw_dead_time_s, own.yaw_dead_time_s)
    spread = _given(params.observer_spread, own.observer_spread)
    spec = ChainSpec(length, rows(length, kappas, spread), lag_s, round(dead_s * 1e6))
    polynomial = "binomial" if params.polynomial == "poles" and length != len(params.poles) else params.polynomial
    gammas = chain_gains(polynomial, length, omega0, params.poles)
    return ChannelTuning(spec, gammas, ratios(gammas), params.yaw_padding, _ahead_us(params, dead_s, lag_s))


def _ahead_us(params: LawParams, dead_s: float, lag_s: float) -> int:
    return round((dead_s + params.lag_bridged * lag_s) * 1e6)
