"""The messages that steer the vehicle: setpoints and places for GUIDED, the throttle stick of RC_CHANNELS_OVERRIDE."""

from __future__ import annotations

from mavquad.protocol.codec import Message
from sitl_mock.personality.ardupilot import guided
from sitl_mock.personality.ardupilot.copter import Copter
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.news import CRITICAL
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, north_east
from sitl_mock.sensors import Estimate

SETPOINTS = ("SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT")
_INTERNAL_ERROR = (CRITICAL, "Internal Errors 0x400")
PLACES = (2, 3)
"""MISSION_ITEM's field "current" of an item that steers GUIDED."""
_HEIGHT_ALONE = 3
_FAR_M = 1e6
_STICK_KEPT_US = 3_000_000
_LOWEST_US, _SPAN_US = 1000, 1000


class Setpoints:
    """Hands setpoints on to the flight, when the mode takes them."""

    def __init__(self, copter: Copter) -> None:
        self._copter = copter
        self._stick_us = 0

    def take(self, message: Message, estimate: Estimate, boot_us: int) -> None:
        """Take a setpoint; outside of GUIDED (and, for attitudes, GUIDED_NOGPS) it is ignored."""
        kind, mode = message.get_type(), self._copter.mode
        setpoint: guided.AttitudeSetpoint | guided.KinematicSetpoint | guided.Rejected | None
        if kind == "SET_ATTITUDE_TARGET" and mode.is_guided:
            setpoint, is_error = guided.attitude_setpoint(message)
        elif kind != "SET_ATTITUDE_TARGET" and mode is Mode.GUIDED:
            setpoint, is_error = self._kinematic(message, estimate)
        else:
            return
        if is_error and _INTERNAL_ERROR not in self._copter.news.texts:
            self._copter.news.say(*_INTERNAL_ERROR)
        if setpoint is not None:
            self._copter.flight.take(setpoint, estimate, boot_us)

    def _kinematic(
        self, message: Message, estimate: Estimate
    ) -> tuple[guided.KinematicSetpoint | guided.Rejected | None, bool]:
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            setpoint = guided.local_setpoint(message, estimate.position_ned_m, estimate.euler_rad[2])
        else:
            setpoint = self._on_the_globe(message)
        return setpoint, isinstance(setpoint, guided.Rejected) and setpoint.is_lost

    def _on_the_globe(self, message: Message) -> guided.KinematicSetpoint | guided.Rejected | None:
        reference = guided.height_reference(message.coordinate_frame)
        if reference is None:
            return guided.Rejected()
        down_m = HOME_ALTITUDE_M if reference == "msl" else self._copter.home_ned_m[2]
        return guided.global_setpoint(message, north_east(message.lat_int, message.lon_int), down_m - message.alt)

    def take_place(self, message: Message, estimate: Estimate, boot_us: int) -> bool:
        """A mission item that is no part of a mission: "current" 2 is a place to go to in GUIDED, 3 a height alone.

        False for one that is not obeyed.
        """
        copter, reference = self._copter, guided.height_reference(message.frame)
        if copter.mode is not Mode.GUIDED or copter.landed or reference is None:
            return False
        scale = 1.0 if message.get_type() == "MISSION_ITEM_INT" else 1e7
        n, e = north_east(scale * message.x, scale * message.y)
        if message.current == _HEIGHT_ALONE:
            n, e, _ = copter.flight.navigator.target_ned_m
        place = (n, e, (HOME_ALTITUDE_M if reference == "msl" else copter.home_ned_m[2]) - message.z)
        if not all(abs(part) < _FAR_M for part in place):
            return False
        copter.flight.take(guided.KinematicSetpoint(position_ned_m=place), estimate, boot_us)
        return True

    def take_sticks(self, message: Message, boot_us: int) -> None:
        """The throttle channel of RC_CHANNELS_OVERRIDE; the other sticks do nothing here."""
        pulse_us = message.chan3_raw
        if 800 <= pulse_us <= 2200:
            self._copter.flight.throttle_stick = max(0.0, min(1.0, (pulse_us - _LOWEST_US) / _SPAN_US))
            self._stick_us = boot_us

    def step(self, boot_us: int) -> None:
        """An override that is not repeated ends after 3 s (RC_OVERRIDE_TIME)."""
        if boot_us - self._stick_us > _STICK_KEPT_US:
            self._copter.flight.throttle_stick = 0.0
