"""What happens from boot until the vehicle can be armed, in the moments recorded, scaled to the configured `ready_s`.

The real SITL can be armed in GUIDED 42.5 s after boot (`ready_s = 42.5` is the real thing); a shorter `ready_s`
shrinks every moment in the same proportion.
"""

from __future__ import annotations

from dataclasses import dataclass

REAL_READY_S = 42.5

_INFO, _DEBUG = 6, 7

# fmt: off
_TEXTS: tuple[tuple[float, int, str], ...] = (
    (0.195, _DEBUG, "RCInput: decoding UDP (Pulses)"),
    (0.309, _INFO, "Calibrating barometer"),
    (1.905, _INFO, "Barometer 1 calibration complete"),
    (1.905, _INFO, "Barometer 2 calibration complete"),
    (2.434, _INFO, "ArduPilot Ready"),
    (2.434, _INFO, "AHRS: DCM active"),
    (2.730, _INFO, "RC7: SaveWaypoint LOW"),
    (4.435, _INFO, "EKF3 IMU0 initialised"),
    (4.435, _INFO, "EKF3 IMU1 initialised"),
    (4.440, _INFO, "AHRS: EKF3 active"),
    (5.783, _INFO, "EKF3 IMU0 tilt alignment complete"),
    (5.783, _INFO, "EKF3 IMU1 tilt alignment complete"),
    (5.882, _INFO, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (5.882, _INFO, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    (9.793, _INFO, "GPS 1: probing for u-blox at 230400 baud"),
    (9.811, _INFO, "GPS 1: detected u-blox"),
    (20.003, _INFO, "EKF3 IMU0 origin set"),
    (20.035, _INFO, "Field Elevation Set: 584m"),
    (20.197, _INFO, "EKF3 IMU1 origin set"),
    (41.603, _INFO, "EKF3 IMU0 is using GPS"),
    (41.608, _INFO, "EKF3 IMU1 is using GPS"),
)
_PARAMETERS: tuple[tuple[float, str], ...] = (
    (0.195, "RELAY1_FUNCTION"),
    (0.203, "COMPASS_DEV_ID"), (0.203, "COMPASS_DEV_ID2"), (0.203, "COMPASS_DEV_ID3"), (0.203, "COMPASS_EXTERNAL"),
    (0.309, "CAM1_TYPE"), (0.309, "BARO_ALT_OFFSET"),
    (1.906, "BARO1_GND_PRESS"), (1.906, "BARO2_GND_PRESS"), (1.906, "INS_GYR_ID"), (1.906, "INS_ACC_ID"),
    (2.434, "INS_GYROFFS_X"), (2.434, "INS_GYROFFS_Y"), (2.434, "INS_GYROFFS_Z"), (2.434, "INS_GYR1_CALTEMP"),
    (3.437, "EK3_SRC1_POSXY"), (20.003, "MIS_TOTAL"), (20.035, "BARO1_GND_PRESS"), (20.035, "BARO2_GND_PRESS"),
)
"""Parameters that the autopilot sets while it starts, and tells everybody."""
# fmt: on


@dataclass(frozen=True, slots=True)
class Moments:
    """When, in us since boot, the autopilot has come so far."""

    heartbeat_us: int
    ready_us: int
    switch_us: int
    ekf_us: int
    yaw_us: int
    gps_us: int
    origin_us: int
    settled_us: int
    position_us: int
    armable_us: int


_REAL_S = (1.0, 2.434, 2.6, 4.435, 5.9, 9.82, 20.0, 23.1, 41.6, REAL_READY_S)


class Boot:
    """The timeline of one boot."""

    def __init__(self, ready_s: float) -> None:
        self._scale_us = 1e6 * ready_s / REAL_READY_S
        self.at = Moments(*(self._us(moment) for moment in _REAL_S))
        self._texts = [(self._us(moment), severity, text) for moment, severity, text in _TEXTS]
        self._parameters = [(self._us(moment), name) for moment, name in _PARAMETERS]

    def _us(self, real_s: float) -> int:
        return round(real_s * self._scale_us)

    @property
    def is_told(self) -> bool:
        """Whether everything has been handed out."""
        return not self._texts and not self._parameters

    def texts(self, boot_us: int) -> list[tuple[int, str]]:
        """(severity, text) of what has been passed since the last call."""
        due = []
        while self._texts and self._texts[0][0] <= boot_us:
            due.append(self._texts.pop(0)[1:])
        return due

    def parameters(self, boot_us: int) -> list[str]:
        """Names of the parameters that have been set since the last call."""
        due = []
        while self._parameters and self._parameters[0][0] <= boot_us:
            due.append(self._parameters.pop(0)[1])
        return due
