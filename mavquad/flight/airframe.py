"""What the wire's numbers mean on one airframe: the scale of torque and thrust."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from mavquad.flight.guards import tilt_rad
from mavquad.schema import Section
from mavquad.types import Attitude

LEAST_THRUST_NORM = 0.05
LEAST_COUNT = 5
MEMORY_US = 400_000
"""In this time an earlier thrust is forgotten to 1/e."""
Scale = Annotated[float, Field(gt=0.1, le=10000.0)]


class AirframeParams(Section):
    """Scales between controls and motion."""

    torque_scale_frd_rad_s2: tuple[Scale, Scale, Scale] = (113.0, 113.0, 13.3)
    """Angular acceleration at a roll, pitch, yaw control of 1, in rad/s^2. The default is PX4's SIH quadrotor: four motors
    of 5 N on an arm of 0.2 m, mixed with 0.707, over 0.025 kg m^2; yaw four times 0.1 N m over 0.030 kg m^2."""
    hover_thrust_norm: float = Field(default=0.0, ge=0.0, le=1.0)
    """Thrust control that carries the weight when level; 0 learns it while the autopilot hovers."""


class HoverThrust:
    """Learns the thrust control that carries the weight, while the autopilot itself hovers.

    At hover T cos(tilt) = g, so the level hover thrust is ATTITUDE_TARGET.thrust times cos(tilt), smoothed: the mean at
    first, then the latest count most, since PX4 still brakes its climb when it begins to hold. What is still wrong with it
    goes into sigma.

    Attributes:
        parameter_norm: the autopilot's own figure (MPC_THR_HOVER), 0 where it has none: better than nothing.
    """

    def __init__(self, params: AirframeParams) -> None:
        self._fixed = params.hover_thrust_norm
        self._learned = 0.0
        self._count = 0
        self._stamp_us = 0
        self.parameter_norm = 0.0

    def restart(self) -> None:
        """Forget what was learned: the vehicle is not hovering."""
        self._learned, self._count = 0.0, 0

    def learn(self, thrust_norm: float, attitude: Attitude) -> None:
        """Take in the autopilot's own thrust command while it hovers."""
        if within_hover(thrust_norm):
            self._count += 1
            since_us = max(attitude.stamp_us - self._stamp_us, 0) if self._count > 1 else 0
            self._stamp_us = attitude.stamp_us
            share = max(1.0 / self._count, since_us / (since_us + MEMORY_US))
            self._learned += share * (thrust_norm * math.cos(tilt_rad(attitude)) - self._learned)

    @property
    def known(self) -> bool:
        """Whether the figure can be flown on: configured, or learned often enough."""
        return self._fixed > 0.0 or self._count >= LEAST_COUNT

    @property
    def norm(self) -> float:
        """The best figure at hand: from the config, else learned, else the autopilot's parameter, else 0.5."""
        if self._fixed > 0.0:
            return self._fixed
        return self._learned if self._count else self.parameter_norm or 0.5


def within_hover(thrust_norm: float) -> float:
    """A figure for the hover thrust, or 0 if no vehicle hovers with it (NaN included)."""
    return thrust_norm if LEAST_THRUST_NORM < thrust_norm < 1.0 - LEAST_THRUST_NORM else 0.0
