"""What output feedback is held against: the plant of the chain alone, and state feedback that knows all about it.

Nothing but the chain: the vehicle has at once what is commanded, the link has no delay and no noise, limits are far off.
State feedback is told of friction and inverts the gain at the measured attitude; output feedback is told of neither, inverts
b(0, yaw), and has position and yaw: all the rest is for its observer to find out.
"""

from __future__ import annotations

import math

from mavquad.control.params import LawParams, LimitParams, SaturationParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Depth
from tests.unit.control.plant import Flight, Link, Vehicle, fly

VEHICLE = Vehicle(
    rotor_lag_s=0.0, angular_drag=0.025, drag_n_s_m=1.0, inertia=(0.025, 0.025, 0.025), perfect_loops=True
)
KNOWN = {"friction_1_s": 1.0, "angular_friction_1_s": 1.0}
UNKNOWN = {"friction_1_s": 0.0, "angular_friction_1_s": 0.0}
FAR_LIMITS = LimitParams(
    approach_speed_max_m_s=20.0,
    climb_speed_max_m_s=20.0,
    tilt_max_deg=75.0,
    thrust_max_g=5.0,
    yaw_rate_max_deg_s=720.0,
    yaw_acceleration_max_deg_s2=5000.0,
)
FAR_LEVELS = SaturationParams(thrust_snap_m_s4=1e4, thrust_jerk_m_s3=1e4, roll_pitch_rad_s2=1e3, roll_pitch_rad_s=50.0)
NO_LAG = {"dead_time_s": 0.0, "lag_s": 0.0, "yaw_dead_time_s": 0.0, "yaw_lag_s": 0.0}
GOAL = hold(Pose((1.5, -0.9, 0.6), 0.0))
DURATION_S = 6.0


def quiet(rate_hz: float, delay_s: float = 0.0) -> Link:
    return Link(rate_hz=rate_hz, delay_s=delay_s, white_m=0.0, wander_m=0.0, yaw_white_rad=0.0, rate_white_rad_s=0.0)


def path(depth: Depth, link: Link, seed: int = 1, **settings: object) -> Flight:
    """From rest to a goal some 2 m off, with omega0 = 2 rad/s."""
    params = LawParams(
        **{
            "omega0_rad_s": 2.0,
            "observer_spread": 1.0,
            "delay_s": link.delay_s,
            # The derivative of the thrust comes from the replica of its lag: short, but longer than a sample.
            "thrust_lag_s": 0.005 if depth == "torque" else 0.0,
            "limits": FAR_LIMITS,
            "saturation": FAR_LEVELS,
            **NO_LAG,
            **settings,
        }
    )
    return fly(params, lambda _: GOAL, DURATION_S, depth=depth, vehicle=VEHICLE, link=link, seed=seed)


def state_feedback(depth: Depth, link: Link) -> Flight:
    """The yardstick, eq. (6)."""
    return path(depth, link, form="state_feedback", decoupling="attitude", **KNOWN)


def output_feedback(depth: Depth, link: Link, kappa_rad_s: float, seed: int = 1) -> Flight:
    """Eqs. (7), (8)."""
    return path(
        depth, link, seed, kappa_rad_s=kappa_rad_s, yaw_kappa_rad_s=kappa_rad_s, measurements="position_yaw",
        decoupling="constant", **UNKNOWN,
    )  # fmt: skip


def distances_m(one: Flight, other: Flight) -> list[float]:
    """Between two trajectories, moment by moment."""
    return [math.dist(a, b) for a, b in zip(one.truth, other.truth, strict=True)]
