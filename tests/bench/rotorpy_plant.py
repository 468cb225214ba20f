"""rotorpy's multirotor, its air and the errands of one flight on it: used by `rotorpy_se3.py`.

The world's x, y, z (z up) and the body's (x forward, y left) are taken as our NWU and FLU.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from rotorpy.vehicles.multirotor import Multirotor
from rotorpy.vehicles.px4_sihsim_quadx_params import quad_params

from mavquad.types import ReferencePoint

State = dict[str, np.ndarray]
Control = dict[str, Any]

DURATION_US = 20_000_000
LEFT_OUT_US = 5_000_000
"""The beginning of a flight that counts in no figure."""
LOST_M = 10.0
"""A flight further than this from its reference has diverged."""
LOST_RAD_S = 100.0
LONGEST_STEP_US = 5_000
"""rotorpy closes its own inner loops once a step of the plant."""

TOLD_MASS_KG = quad_params["mass"]
TOLD_INERTIA_KG_M2 = np.array([quad_params["Ixx"], quad_params["Iyy"], quad_params["Izz"]])
TOLD_HOVER_N = TOLD_MASS_KG * 9.81
MOTOR_LAG_S = quad_params["tau_m"]

RATE_GAIN_1_S = 20.0
"""rotorpy's `k_w`, by which "cmd_ctbr" answers a rate error; its default of 1 takes a second to reach a rate."""
ATTITUDE_GAIN_1_S2 = 310.0
"""rotorpy's `kp_att` for "cmd_ctatt": that of its SE3 controller. The plant's default of 3000 is for faster motors."""
ATTITUDE_DAMPING_1_S = 57.0
"""rotorpy's `kd_att` likewise; the default is 360."""

GUST_STEP_US = 1_000
GUST_SIGMA_M_S = 1.5
GUST_TIME_S = 1.0


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table.

    Attributes:
        name: what the row is called.
        eight: the figure-eight, or the hover at the origin.
        wind_m_s: towards +x.
        gusts: an Ornstein-Uhlenbeck process on each axis besides.
        mass_factor: of the plant; no controller is told.
    """

    name: str
    eight: bool
    wind_m_s: float = 0.0
    gusts: bool = False
    mass_factor: float = 1.0


CASES = (
    Case("hover, 5 m/s", eight=False, wind_m_s=5.0),
    Case("hover, 12 m/s", eight=False, wind_m_s=12.0),
    Case("hover, 5 m/s + gusts", eight=False, wind_m_s=5.0, gusts=True),
    Case("hover, mass +20 %", eight=False, mass_factor=1.2),
    Case("figure-eight, calm", eight=True),
    Case("figure-eight, 5 m/s", eight=True, wind_m_s=5.0),
    Case("figure-eight, 12 m/s", eight=True, wind_m_s=12.0),
)


class Pilot(Protocol):
    """A controller as the plant sees it.

    Attributes:
        abstraction: which of rotorpy's commands it gives.
        period_us: it gives one this often.
    """

    abstraction: str
    period_us: int

    def command(self, stamp_us: int, state: State) -> Control:
        """The command from the true state at a moment."""
        ...


@dataclass(frozen=True, slots=True)
class Score:
    """3-D position error over the part of a flight that counts.

    Attributes:
        mean_square_m2: mean of the squared error.
        max_m: the largest.
        lost_s: when the flight diverged, None if it did not.
    """

    mean_square_m2: float
    max_m: float
    lost_s: float | None = None


def sine(amplitude: float, rate_rad_s: float, t_s: float) -> tuple[float, ...]:
    """A sin(w t) and its first four derivatives."""
    return tuple(amplitude * rate_rad_s**i * math.sin(rate_rad_s * t_s + 0.5 * math.pi * i) for i in range(5))


_REST = (0.0,) * 5


def figure_eight(stamp_us: int) -> ReferencePoint:
    """x = 1.25 sin t, z = 0.75 sin 2t."""
    t_s = stamp_us * 1e-6
    return ReferencePoint(z_m=sine(0.75, 2.0, t_s), yaw_rad=_REST, x_m=sine(1.25, 1.0, t_s), y_m=_REST)


def hover(stamp_us: int) -> ReferencePoint:
    """The origin, at any time."""
    return ReferencePoint(z_m=_REST, yaw_rad=_REST, x_m=_REST, y_m=_REST)


def reference_of(case: Case) -> Callable[[int], ReferencePoint]:
    """The case's reference by time."""
    return figure_eight if case.eight else hover


def place(reference: ReferencePoint, derivative: int = 0) -> np.ndarray:
    """Position of a reference, or a derivative of it, in rotorpy's order."""
    return np.array([reference.x_m[derivative], reference.y_m[derivative], reference.z_m[derivative]])


def gusts(seed: int) -> np.ndarray:
    """An Ornstein-Uhlenbeck wind, stationary from the start: one row each `GUST_STEP_US`, three axes."""
    random = np.random.default_rng(seed)
    keep = math.exp(-GUST_STEP_US * 1e-6 / GUST_TIME_S)
    drive = GUST_SIGMA_M_S * math.sqrt(1.0 - keep * keep) * random.standard_normal((DURATION_US // GUST_STEP_US, 3))
    wind = np.empty_like(drive)
    now = GUST_SIGMA_M_S * random.standard_normal(3)
    for row, push in enumerate(drive):
        wind[row] = now = keep * now + push
    return wind


def air(case: Case, seed: int) -> Callable[[int], np.ndarray]:
    """The wind by time."""
    steady = np.array([case.wind_m_s, 0.0, 0.0])
    if not case.gusts:
        return lambda _: steady
    blown = steady + gusts(seed)
    return lambda stamp_us: blown[stamp_us // GUST_STEP_US]


def at_start(case: Case, offset_m: float) -> State:
    """On the reference with its velocity, but for an offset in x and y; level, the rotors holding the true weight."""
    point = reference_of(case)(0)
    hover_rad_s = math.sqrt(case.mass_factor * TOLD_HOVER_N / (4.0 * quad_params["k_eta"]))
    return {
        "x": place(point) + np.array([offset_m, offset_m, 0.0]),
        "v": place(point, 1),
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover_rad_s),
    }


def plant_of(case: Case, abstraction: str, state: State) -> Multirotor:
    """rotorpy's plant, its inner loops with the gains above."""
    true = {
        **quad_params,
        "mass": case.mass_factor * TOLD_MASS_KG,
        "k_w": RATE_GAIN_1_S,
        "kp_att": ATTITUDE_GAIN_1_S2,
        "kd_att": ATTITUDE_DAMPING_1_S,
    }
    return Multirotor(true, state, control_abstraction=abstraction)


def resting() -> Control:
    """What the plant is told before the first command arrives: level, hover thrust."""
    return {
        "cmd_thrust": TOLD_HOVER_N,
        "cmd_moment": np.zeros(3),
        "cmd_w": np.zeros(3),
        "cmd_q": np.array([0.0, 0.0, 0.0, 1.0]),
    }


def is_lost(error_m: float, state: State) -> bool:
    """NaN is lost as well."""
    return not (error_m < LOST_M and np.max(np.abs(state["w"])) < LOST_RAD_S)


def fly(pilot: Pilot, case: Case, delay_us: int, seed: int, offset_m: float) -> Score:
    """One flight.

    The state at each multiple of the pilot's period is measured; the command computed from it begins to act `delay_us`
    later and holds until the next one does. rotorpy's inner loops, where the command goes through one, are not delayed.
    """
    if delay_us % pilot.period_us:
        raise ValueError(f"a delay of {delay_us} us is no multiple of the period of {pilot.period_us} us")
    reference, wind, state = reference_of(case), air(case, seed), at_start(case, offset_m)
    plant = plant_of(case, pilot.abstraction, state)
    on_the_way = deque([resting()] * (delay_us // pilot.period_us))
    errors_m: list[float] = []
    for stamp_us in range(0, DURATION_US, pilot.period_us):
        error_m = float(np.linalg.norm(state["x"] - place(reference(stamp_us))))
        if is_lost(error_m, state):
            return Score(math.nan, math.nan, lost_s=stamp_us * 1e-6)
        if stamp_us >= LEFT_OUT_US:
            errors_m.append(error_m)
        on_the_way.append(pilot.command(stamp_us, state))
        state = advanced(plant, state, on_the_way.popleft(), stamp_us, pilot.period_us, wind)
    return Score(float(np.mean(np.square(errors_m))), max(errors_m))


def advanced(
    plant: Multirotor,
    state: State,
    control: Control,
    stamp_us: int,
    period_us: int,
    wind: Callable[[int], np.ndarray],
) -> State:
    """The state after one command, in steps of at most `LONGEST_STEP_US`."""
    steps = -(-period_us // LONGEST_STEP_US)
    step_us = period_us // steps
    for k in range(steps):
        state["wind"] = wind(stamp_us + k * step_us)
        state = plant.step(state, control, step_us * 1e-6)
    return state
