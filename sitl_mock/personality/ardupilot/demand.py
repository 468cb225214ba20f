"""What a mode asks of the control, and what becomes of its thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl_mock.geometry import Quaternion, tilt_rad
from sitl_mock.personality.ardupilot.attitude import AttitudeInput, RatesInput

LIFT_COMPENSATION = 1.072
"""Thrust over the field `thrust`: what ArduCopter adds for thin air and a battery below its full voltage.

SITL hovers at a field of 0.363 (recorded) with 0.389 of its thrust (its model).
"""


@dataclass(frozen=True, slots=True)
class Demand:
    """An attitude's input, thrust as a share of all motors' full one, and whether the position control made them."""

    attitude: AttitudeInput | RatesInput
    thrust_norm: float
    is_position_control: bool = True


def boosted(thrust_norm: float, target: Quaternion) -> float:
    """ATC_ANGLE_BOOST: thrust over the cosine of the tilt asked for, none upside down."""
    cosine = math.cos(tilt_rad(target))
    return thrust_norm * max(0.0, min(1.0, 10.0 * cosine)) / max(0.1, min(1.0, cosine))
