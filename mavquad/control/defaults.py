"""What "auto" stands for in [law], for each autopilot and depth: gains, inner loops and friction, as measured on PX4's SIH
quadrotor and on ArduCopter's own simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mavquad.types import Depth

Measurements = Literal["position_yaw", "position_attitude", "full"]

Autopilot = Literal["px4", "arducopter"]
"""Whose inner loops the law sits on."""

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
CHAIN_LENGTHS: dict[Depth, int] = {"torque": 4, "rate": 3, "attitude": 2}
"""r: from the commanded input to position."""
YAW_LENGTHS: dict[Depth, int] = {"torque": 2, "rate": 1, "attitude": 1}
"""The yaw's own chain, before any padding; at depth attitude its rate is integrated to the angle on the wire."""


MISTRUSTING: dict[Depth, dict[str, float | str]] = {
    "torque": {
        "velocity": "ignored",
        "omega0_rad_s": 3.0,
        "kappa_rad_s": 15.0,
        "attitude_kappa_rad_s": 20.0,
        "rates_kappa_rad_s": 10.0,
    },
    "rate": {"velocity": "ignored", "kappa_rad_s": 15.0, "attitude_kappa_rad_s": 12.0},
    "attitude": {"velocity": "ignored", "omega0_rad_s": 2.0, "kappa_rad_s": 10.0},
}
"""What "auto" stands for where the estimated velocity is not the slope of the position: it is left out, and the position
counts more. Flown on PX4 in SIH: hover 2.9 cm instead of 9.1 at depth rate (1.16.2), 2.4 instead of 8.1 at torque (1.13.3),
3.7 instead of 9.4 at attitude (1.16.2). Its offset taken for a polynomial (`velocity_slopes`) has 3.8 cm at rate, and half
the error in gusts."""


@dataclass(frozen=True, slots=True)
class Defaults:
    """Numbers of one depth and measurement set; kappas of rows that the set does not have are not used."""

    omega0_rad_s: float
    kappa_per_omega0: float
    """kappa over omega0."""
    velocity_kappa_rad_s: float = 10.0
    attitude_kappa_rad_s: float = 12.0
    rates_kappa_rad_s: float = 12.0
    observer_spread: float = 1.0
    yaw_omega0_rad_s: float = 2.0
    yaw_kappa_per_omega0: float = 3.0
    dead_time_s: float = 0.0
    lag_s: float = 0.05
    thrust_lag_s: float = 0.05
    yaw_dead_time_s: float = 0.0
    yaw_lag_s: float = 0.05
    delay_s: float = 0.025
    friction_1_s: float = 1.0
    angular_friction_1_s: float = 0.9


_TORQUE = {"yaw_omega0_rad_s": 2.0}
_RATE = {"dead_time_s": 0.045, "lag_s": 0.048, "yaw_dead_time_s": 0.037, "yaw_lag_s": 0.5, "yaw_omega0_rad_s": 1.2}
_ATTITUDE = {"dead_time_s": 0.113, "lag_s": 0.06, "yaw_dead_time_s": 0.35, "yaw_lag_s": 0.22, "yaw_omega0_rad_s": 1.0}

_PX4: dict[tuple[Depth, Measurements], Defaults] = {
    ("torque", "position_yaw"): Defaults(2.7, 2.8, observer_spread=2.0, **_TORQUE),
    ("torque", "position_attitude"): Defaults(3.0, 2.5, **_TORQUE),
    ("torque", "full"): Defaults(3.4, 2.5, 20.0, 14.0, 14.0, **_TORQUE),
    ("rate", "position_yaw"): Defaults(2.0, 4.0, **_RATE),
    ("rate", "position_attitude"): Defaults(3.0, 4.0, **_RATE),
    ("rate", "full"): Defaults(3.0, 2.5, 20.0, 10.0, **_RATE),
    ("attitude", "position_yaw"): Defaults(1.5, 3.0, **_ATTITUDE),
    ("attitude", "position_attitude"): Defaults(1.5, 3.0, **_ATTITUDE),
    ("attitude", "full"): Defaults(2.5, 2.5, 14.0, **_ATTITUDE),
}


# As identified on ArduCopter 4.7 in its own simulator; its model has no rotor lag and little drag.
_ARDU: dict[str, float] = {"friction_1_s": 0.15, "angular_friction_1_s": 0.0, "thrust_lag_s": 0.02}
_ARDU_RATE = {
    **_ARDU,
    "dead_time_s": 0.02,
    "lag_s": 0.05,
    "yaw_dead_time_s": 0.04,
    "yaw_lag_s": 0.2,
    "yaw_omega0_rad_s": 1.2,
}
_ARDU_ATTITUDE = {
    **_ARDU,
    "dead_time_s": 0.1,
    "lag_s": 0.1,
    "yaw_dead_time_s": 0.2,
    "yaw_lag_s": 0.2,
    "yaw_omega0_rad_s": 1.0,
}

_ARDUCOPTER: dict[tuple[Depth, Measurements], Defaults] = {
    ("rate", "position_yaw"): Defaults(2.0, 4.0, **_ARDU_RATE),
    ("rate", "position_attitude"): Defaults(2.5, 3.0, **_ARDU_RATE),
    ("rate", "full"): Defaults(3.5, 2.5, 20.0, 10.0, **_ARDU_RATE),
    ("attitude", "position_yaw"): Defaults(1.5, 3.0, **_ARDU_ATTITUDE),
    ("attitude", "position_attitude"): Defaults(1.5, 3.0, **_ARDU_ATTITUDE),
    ("attitude", "full"): Defaults(2.5, 2.5, 14.0, **_ARDU_ATTITUDE),
}


def defaults(autopilot: Autopilot, depth: Depth, measurements: Measurements) -> Defaults:
    """The numbers behind "auto". ArduCopter takes no torque: asked for it, PX4's are given."""
    if autopilot == "arducopter" and depth != "torque":
        return _ARDUCOPTER[depth, measurements]
    return _PX4[depth, measurements]
