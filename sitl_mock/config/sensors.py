"""What the estimator gets wrong."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mavquad.schema import Section
from sitl_mock.config.numbers import NotNegative, Positive


class SensorsConfig(Section):
    """Errors of the estimator's output. Every one may be 0."""

    position_noise_m: NotNegative = 0.003
    """Standard deviation of the white position noise per axis in m."""
    wander: Literal["own", "sih"] = "own"
    """The slow wander of the position. "own": the two keys below. "sih": as PX4's SIH with its GPS: smooth, 0.10 m
    north, 0.25 m east, 0.20 m down, forgotten in 4 s, and the velocity errs by 0.15, 0.34, 0.11 m/s: not its slope."""
    position_wander_m: NotNegative = 0.05
    """Standard deviation of the slow position wander per axis in m."""
    position_wander_time_s: Positive = 20.0
    """Correlation time of the wander in s."""
    velocity_noise_m_s: NotNegative = 0.01
    """Standard deviation of the white velocity noise per axis in m/s."""
    attitude_noise_deg: NotNegative = 0.1
    """Standard deviation of the white attitude noise about each axis of the body in degrees."""
    rates_noise_rad_s: NotNegative = 0.01
    """Standard deviation of the white body-rate noise per axis in rad/s."""
    accelerometer_noise_m_s2: NotNegative = 0.07
    """Standard deviation of the white accelerometer noise per axis in m/s^2 (real SIH: 0.07 at rest, 0.7 and more in
    flight)."""
    noise_time_s: NotNegative = 0.0
    """Correlation time of all this noise in s, which an estimator's filters give it; 0: white."""
    age_ms: Annotated[int, Field(ge=0, le=200)] = 5
    """Age of the sample in a telemetry message in ms; the message carries the sample's own time stamp. On PX4 1.15 and
    1.16, whose simulator runs in lockstep, whole ticks of 4 ms of it."""
