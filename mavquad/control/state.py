"""The controller's memory, its evidence, and how it starts."""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.actuation import Command
from mavquad.control.euler import euler_rates, trig
from mavquad.control.integrators import Integrator
from mavquad.control.observer import Estimate
from mavquad.control.params import LawParams
from mavquad.types import Attitude, Position, TorqueCommand, Vec4

Chains = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
Estimates = tuple[Estimate, Estimate, Estimate, Estimate]

Z, YAW, X, Y = range(4)
"""Places of the outputs in every 4-vector of the law."""

_NOTHING: Vec4 = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Trace:
    """The law's evidence for one step. 4-vectors are in the order z, yaw, x, y, but for `inputs`."""

    stamp_us: int
    zeta_hat: Chains
    """The estimate at the moment of the measurement: (zeta_1 .. zeta_4) of each channel."""
    sigma: Vec4
    error: Vec4
    """Reference minus measured, m and rad."""
    demanded: Vec4
    """w: the fourth derivatives asked for, m/s^4 and rad/s^4."""
    inputs: Vec4
    """U = (v1, v2, u3, u4) after saturation and limits: m/s^4, rad/s^4, rad/s^2, rad/s^2."""
    limits_active: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Rotors:
    """u1 and u2 behind the rotors' lag: part of the full state of eq. (6), kept up in that form only."""

    stamp_us: int
    lagged: tuple[float, float]
    sent: tuple[Command, ...]
    """(u1, u2, 0, 0), each with when it starts to act."""


@dataclass(frozen=True, slots=True)
class ControllerState:
    """All that the controller remembers between two steps."""

    estimates: Estimates
    """Of z, yaw, x, y; yaw has a stamp of its own."""
    commands: tuple[Command, ...]
    """Chain inputs w that are acting or still in flight."""
    thrust: Integrator
    """u1 at the moment when the latest command starts to act."""
    yaw: Integrator
    """u2 likewise."""
    rotors: Rotors
    """For the state feedback."""
    trim_m_s2: float
    """Thrust per mass that held the hover at the start: it stands for g in T = u1 + g."""
    command: TorqueCommand
    """The latest."""
    trace: Trace | None
    """Of the latest step."""
    stale_positions: int
    """Positions refused because they were older than the estimate."""
    stale_attitudes: int


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step gives back."""

    command: TorqueCommand
    state: ControllerState
    trace: Trace


def begin(params: LawParams, position: Position, attitude: Attitude, specific_thrust_m_s2: float) -> ControllerState:
    """Take over without a bump: estimates from the measured pose and its rates, nothing else moving, sigma zero.

    Args:
        params: the law's configuration.
        position: the latest.
        attitude: the latest.
        specific_thrust_m_s2: the thrust per mass that holds the hover now.
    """
    t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    yaw_rate = euler_rates(t, attitude.rates_flu_rad_s)[2]
    x, y, z = position.position_nwu_m
    vx, vy, vz = position.velocity_nwu_m_s
    stamp_us = position.stamp_us
    unknown = (0.0,) * (len(params.observer_moduli) - 2)
    return ControllerState(
        estimates=(
            Estimate(stamp_us, (z, vz, *unknown), 0.0),
            Estimate(attitude.stamp_us, (attitude.yaw_rad, yaw_rate, *unknown), 0.0),
            Estimate(stamp_us, (x, vx, *unknown), 0.0),
            Estimate(stamp_us, (y, vy, *unknown), 0.0),
        ),
        commands=((min(stamp_us, attitude.stamp_us), _NOTHING),),
        thrust=Integrator(0.0, 0.0, 0.0),
        yaw=Integrator(0.0, 0.0, 0.0),
        rotors=Rotors(stamp_us, (0.0, 0.0), ((stamp_us, _NOTHING),)),
        trim_m_s2=specific_thrust_m_s2,
        command=TorqueCommand((0.0, 0.0, 0.0), specific_thrust_m_s2),
        trace=None,
        stale_positions=0,
        stale_attitudes=0,
    )
