"""What the estimator gets wrong, and what telemetry can deliver."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from mavquad.schema import Section
from sitl_mock.config.numbers import NotNegative, Positive


class SensorsConfig(Section):
    """Errors of the estimator's output. Every one may be 0."""

    position_noise_m: NotNegative = 0.003
    """Standard deviation of the white position noise per axis in m."""
    position_wander_m: NotNegative = 0.05
    """Standard deviation of the slow position wander per axis in m."""
    position_wander_time_s: Positive = 20.0
    """Correlation time of the wander in s."""
    velocity_noise_m_s: NotNegative = 0.01
    """Standard deviation of the white velocity noise per axis in m/s."""
    attitude_noise_deg: NotNegative = 0.1
    """Standard deviation of the white noise of each Euler angle in degrees."""
    rates_noise_rad_s: NotNegative = 0.01
    """Standard deviation of the white body-rate noise per axis in rad/s."""
    age_ms: Annotated[int, Field(ge=0, le=200)] = 5
    """Age of the sample in a telemetry message in ms; the message carries the sample's own time stamp."""


class StreamsConfig(Section):
    """What telemetry can deliver, whatever is asked for."""

    max_attitude_hz: Annotated[float, Field(gt=0, le=250)] = 250.0
    """Fastest ATTITUDE and ATTITUDE_QUATERNION in Hz."""
    max_position_hz: Annotated[float, Field(gt=0, le=250)] = 100.0
    """Fastest LOCAL_POSITION_NED in Hz (real PX4: 89 on 1.13, 125 on 1.16)."""
