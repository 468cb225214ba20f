"""What ArduCopter tells by itself: texts, parameters that it has set, a change of mode or home."""

from __future__ import annotations

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.ardupilot.boot import Boot
from sitl_mock.personality.ardupilot.parameters import Parameters

EMERGENCY: int = mavlink.MAV_SEVERITY_EMERGENCY
CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
WARNING: int = mavlink.MAV_SEVERITY_WARNING
INFO: int = mavlink.MAV_SEVERITY_INFO

_COMPLAINS_FIRST_US, _EVERY_US = 30_440_000, 30_000_000
_ALIGNED_AT_M = 2.7
_ALIGNED = tuple(f"EKF3 IMU{unit} MAG0 in-flight yaw alignment complete" for unit in (0, 1))
_US_PER_S = 1_000_000


class News:
    """Collects what is to be told on every port.

    Attributes:
        texts: (severity, STATUSTEXT).
        parameters: names for PARAM_VALUE.
        mode_changed: a HEARTBEAT is due at once.
        home_changed: GPS_GLOBAL_ORIGIN and HOME_POSITION are due at once.
    """

    def __init__(self, boot: Boot, params: Parameters) -> None:
        self._boot = boot
        self._params = params
        self.texts: list[tuple[int, str]] = []
        self.parameters: list[str] = []
        self.mode_changed = False
        self.home_changed = False
        self._is_aligned = False
        self._complain_us = _COMPLAINS_FIRST_US
        self._times_us = _EVERY_US

    def say(self, severity: int, text: str) -> None:
        """A STATUSTEXT."""
        self.texts.append((severity, text))

    def step(self, flown_us: int, boot_us: int) -> None:
        """What belongs to the time since boot: the start's texts and parameters, the flight time every 30 s."""
        if not self._boot.is_told:
            self.texts += self._boot.texts(boot_us)
            self.parameters += self._boot.parameters(boot_us)
        if boot_us >= self._times_us:
            self._times_us += _EVERY_US
            self._tell_times(flown_us, boot_us)

    def complains(self, boot_us: int) -> bool:
        """Whether it is time again to say what keeps the vehicle from arming."""
        if boot_us < self._complain_us:
            return False
        self._complain_us += _EVERY_US
        return True

    def flies_at(self, height_m: float) -> None:
        """The estimator aligns itself once in a flight, above 2.7 m, as recorded."""
        if not self._is_aligned and height_m > _ALIGNED_AT_M:
            self._is_aligned = True
            self.texts += [(INFO, text) for text in _ALIGNED]

    def landed(self, flown_us: int, boot_us: int) -> None:
        """The vehicle has come down."""
        self._tell_times(flown_us, boot_us)

    def disarmed(self) -> None:
        """The motors stand still, and the learned thrust is stored."""
        self._is_aligned = False
        self.parameters.append("MOT_THST_HOVER")
        self.say(INFO, "Disarming motors")

    def _tell_times(self, flown_us: int, boot_us: int) -> None:
        self._params.set("STAT_RUNTIME", boot_us // _US_PER_S)
        self._params.set("STAT_FLTTIME", flown_us // _US_PER_S)
        self.parameters += ["STAT_FLTTIME", "STAT_RUNTIME"] if flown_us else ["STAT_RUNTIME"]
