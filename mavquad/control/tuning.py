"""What `LawParams` amount to: gains and limits in SI, worked out once and kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from mavquad.control.gains import chain_gains
from mavquad.control.limits import ChannelLimits
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.observer import ObserverGains
from mavquad.control.params import CHAIN_LENGTH, LawParams
from mavquad.types import Vec4

Gammas = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Tuning:
    """Numbers of the hot path; 4-tuples in the order z, yaw, x, y or v1, v2, u3, u4."""

    gammas: Gammas
    observers: tuple[ObserverGains, ObserverGains, ObserverGains, ObserverGains]
    levels: Vec4
    """N of sat_N."""
    friction_1_s: float
    angular_friction_1_s: float
    delay_us: int
    lag_s: float
    bridge_us: int
    """How much further than the delay the law looks ahead."""
    thrust_min_share: float
    thrust_max_share: float
    climb_speed_m_s: float
    yaw_input_max_rad_s2: float
    yaw_limits: ChannelLimits
    horizontal_limits: ChannelLimits


@lru_cache(maxsize=16)
def tuning(params: LawParams) -> Tuning:
    """The numbers behind a configuration."""
    place = chain_gains(params.polynomial, CHAIN_LENGTH, params.omega0_rad_s, params.poles)
    turn = chain_gains(params.polynomial, CHAIN_LENGTH, params.yaw_omega0_rad_s, params.poles)
    place_observer = ObserverGains(params.kappa_rad_s, params.observer_moduli, params.lag_s)
    turn_observer = ObserverGains(params.yaw_kappa_rad_s, params.observer_moduli, params.lag_s)
    levels, limits = params.saturation, params.limits
    tilt_acceleration = GRAVITY_M_S2 * math.tan(math.radians(limits.tilt_max_deg))
    yaw_acceleration = math.radians(limits.yaw_acceleration_max_deg_s2)
    return Tuning(
        gammas=(place, turn, place, place),
        observers=(place_observer, turn_observer, place_observer, place_observer),
        levels=(levels.thrust_snap_m_s4, levels.yaw_snap_rad_s4, levels.roll_rad_s2, levels.pitch_rad_s2),
        friction_1_s=params.friction_1_s,
        angular_friction_1_s=params.angular_friction_1_s,
        delay_us=round(params.delay_s * 1e6),
        lag_s=params.lag_s,
        bridge_us=round(params.lag_bridged * params.lag_s * 1e6),
        thrust_min_share=limits.thrust_min_g,
        thrust_max_share=limits.thrust_max_g,
        climb_speed_m_s=limits.climb_speed_max_m_s,
        yaw_input_max_rad_s2=yaw_acceleration,
        yaw_limits=ChannelLimits(math.radians(limits.yaw_rate_max_deg_s), -yaw_acceleration, yaw_acceleration),
        horizontal_limits=ChannelLimits(limits.approach_speed_max_m_s, -tilt_acceleration, tilt_acceleration),
    )
