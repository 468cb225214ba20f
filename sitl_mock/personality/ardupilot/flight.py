"""What each of ArduCopter's modes asks of the attitude control and of the motors, tick by tick."""

from __future__ import annotations

import math
from dataclasses import replace

from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.personality.ardupilot.attitude import AttitudeInput, RatesInput
from sitl_mock.personality.ardupilot.auto import Auto
from sitl_mock.personality.ardupilot.demand import LIFT_COMPENSATION, Demand
from sitl_mock.personality.ardupilot.guided import AttitudeSetpoint, KinematicSetpoint, Rejected
from sitl_mock.personality.ardupilot.homeward import Homeward
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

_THRUST_AS_THRUST = 8
_REACHED_M = 0.03
_STICK_DEAD_ZONE = 0.1
_CM = 0.01
_BY_STICK = (Mode.ALT_HOLD, Mode.LOITER, Mode.POSHOLD)
_RETURNS = (Mode.RTL, Mode.SMART_RTL)


class Flight:
    """Flies the mode in force.

    Attributes:
        navigator: the position control.
        setpoint: what GUIDED follows.
        takeoff_us: when the last takeoff was asked for.
        throttle_stick: the pilot's, 0 (down, as SITL's is while nobody moves it) to 1.
    """

    def __init__(self, navigator: Navigator, params: Parameters, mission: Mission) -> None:
        self.navigator = navigator
        self._params = params
        self._homeward = Homeward(navigator, params)
        self._auto = Auto(navigator, params, mission, self._homeward)
        self.setpoint: AttitudeSetpoint | KinematicSetpoint | None = None
        self._setpoint_us = 0
        self._climb_to_m: float | None = None
        self._hold_ned_m: Vec3 = ZERO3
        self._is_deaf_to_positions = False
        self._is_adrift = False
        self.throttle_stick = 0.0
        self.takeoff_us = 0

    # --- orders ------------------------------------------------------------------------------------------------

    def enter(self, mode: Mode, estimate: Estimate, boot_us: int) -> None:
        """Begin a mode where the vehicle is."""
        self.setpoint, self._climb_to_m = None, None
        self._is_deaf_to_positions = self._is_adrift = False
        self.navigator.speed_m_s = None
        self.navigator.start(estimate)
        self._hold_ned_m = _stopping_place(estimate)
        self._homeward.begin("climb" if mode in _RETURNS else "none", self._hold_ned_m, boot_us)

    def begin_mission(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int) -> None:
        """Take up the mission in AUTO."""
        self.takeoff_us = boot_us
        self._auto.begin(estimate, home_ned_m, boot_us)

    def take_off(self, down_m: float, estimate: Estimate, boot_us: int) -> None:
        """Climb to this height, as z in NED."""
        self.setpoint, self._climb_to_m, self.takeoff_us = None, down_m, boot_us
        self._hold_ned_m = (*estimate.position_ned_m[:2], down_m)
        self.navigator.start(estimate)

    def take(self, setpoint: AttitudeSetpoint | KinematicSetpoint | Rejected, estimate: Estimate, boot_us: int) -> None:
        """Follow a setpoint from now on; one that is rejected stops the vehicle."""
        if isinstance(setpoint, Rejected):
            self._is_deaf_to_positions |= setpoint.is_lost
            setpoint = KinematicSetpoint(velocity_ned_m_s=ZERO3)
        elif isinstance(setpoint, KinematicSetpoint) and self._is_deaf_to_positions:
            return
        if type(setpoint) is not type(self.setpoint):
            self.navigator.start(estimate)
            self._is_adrift = False
        self._climb_to_m = None
        self.setpoint, self._setpoint_us = setpoint, boot_us

    def turn(self, yaw_rad: float, rate_rad_s: float, estimate: Estimate, boot_us: int) -> None:
        """Head there, at a rate (0: the fastest), while GUIDED goes on with what it does."""
        followed = self.setpoint if isinstance(self.setpoint, KinematicSetpoint) else None
        followed = followed or KinematicSetpoint(position_ned_m=self._hold_ned_m)
        self.take(replace(followed, yaw_rad=yaw_rad, yaw_rate_rad_s=rate_rad_s or None), estimate, boot_us)

    # --- what the commander asks -------------------------------------------------------------------------------

    def is_taking_off(self, mode: Mode) -> bool:
        """Whether a takeoff has been asked for and has not reached its height."""
        return self._auto.is_taking_off if mode is Mode.AUTO else self._climb_to_m is not None

    def is_landing(self, mode: Mode) -> bool:
        """Whether the mode brings the vehicle down, to disarm there."""
        return mode is Mode.LAND or self._homeward.stage == "land"

    def wants_lift(self, mode: Mode, boot_us: int) -> bool:
        """Whether a vehicle on the ground is to leave it."""
        if self.is_taking_off(mode):
            return True
        if mode.has_manual_throttle or mode in _BY_STICK:
            return self.throttle_stick > 0.5 + _STICK_DEAD_ZONE
        if not mode.is_guided or not isinstance(self.setpoint, AttitudeSetpoint) or self._has_timed_out(boot_us):
            return False
        return self.setpoint.thrust > (0.0 if self._thrust_is_thrust() else 0.5)

    def _thrust_is_thrust(self) -> bool:
        return bool(int(self._params["GUID_OPTIONS"]) & _THRUST_AS_THRUST)

    def _has_timed_out(self, boot_us: int) -> bool:
        return boot_us - self._setpoint_us > 1e6 * self._params["GUID_TIMEOUT"]

    # --- each tick ---------------------------------------------------------------------------------------------

    def demand(self, mode: Mode, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        """What the mode asks for now."""
        if mode is Mode.AUTO:
            return self._auto.demand(estimate, home_ned_m, boot_us, dt_s)
        if self._climb_to_m is not None:
            return self._takeoff(self._climb_to_m, estimate, dt_s)
        if mode.is_guided:
            return self._guided(estimate, boot_us, dt_s)
        if mode in _RETURNS:
            return self._homeward.demand(estimate, home_ned_m, boot_us, dt_s)
        if mode is Mode.LAND:
            return self._homeward.land(estimate, home_ned_m, dt_s)
        return self._by_stick(mode, estimate, dt_s)

    def _takeoff(self, climb_to_m: float, estimate: Estimate, dt_s: float) -> Demand:
        self.navigator.fly_to(self._hold_ned_m, dt_s)
        if estimate.position_ned_m[2] - climb_to_m < _REACHED_M:
            self._climb_to_m = None
            self.setpoint = KinematicSetpoint(position_ned_m=self._hold_ned_m)
        return Demand(*self.navigator.control(estimate, dt_s))

    def _by_stick(self, mode: Mode, estimate: Estimate, dt_s: float) -> Demand:
        """The pilot's modes, of whose sticks there is only the throttle; BRAKE and CIRCLE stay where they are."""
        navigator = self.navigator
        navigator.keep_heading()
        if mode.has_manual_throttle:
            lift = LIFT_COMPENSATION * self.throttle_stick
            return Demand(navigator.level(estimate, dt_s)[0], lift, is_position_control=False)
        if mode in _BY_STICK:
            navigator.descend(self._stick_sinks(), dt_s, _CM * self._params["PILOT_ACCEL_Z"])
        else:
            navigator.fly_to(self._hold_ned_m, dt_s)
        if mode is Mode.ALT_HOLD:
            return Demand(*navigator.level(estimate, dt_s), is_position_control=False)
        return Demand(*navigator.control(estimate, dt_s))

    def _stick_sinks(self) -> float:
        """The speed down that the throttle stick asks for: PILOT_SPEED_DN (0: as up) at its lowest, none in the middle."""
        up = _CM * self._params["PILOT_SPEED_UP"]
        down = _CM * self._params["PILOT_SPEED_DN"] or up
        away = self.throttle_stick - 0.5
        if abs(away) <= _STICK_DEAD_ZONE:
            return 0.0
        part = (abs(away) - _STICK_DEAD_ZONE) / (0.5 - _STICK_DEAD_ZONE)
        return -up * part if away > 0 else down * part

    # --- GUIDED ------------------------------------------------------------------------------------------------

    def _guided(self, estimate: Estimate, boot_us: int, dt_s: float) -> Demand:
        if isinstance(self.setpoint, AttitudeSetpoint):
            return self._attitude(self.setpoint, estimate, boot_us, dt_s)
        setpoint = self.setpoint or KinematicSetpoint(position_ned_m=self._hold_ned_m)
        if setpoint.moves and self._has_timed_out(boot_us):
            place = setpoint.position_ned_m
            setpoint = KinematicSetpoint(place, ZERO3 if place is None else None, yaw_rad=setpoint.yaw_rad)
        self.navigator.follow(setpoint, dt_s)
        self._head(setpoint, dt_s)
        return Demand(*self.navigator.control(estimate, dt_s))

    def _head(self, setpoint: KinematicSetpoint, dt_s: float) -> None:
        navigator = self.navigator
        if setpoint.yaw_rad is not None:
            navigator.turn_to(setpoint.yaw_rad, dt_s, setpoint.yaw_rate_rad_s)
        elif setpoint.yaw_rate_rad_s is not None:
            navigator.turn(setpoint.yaw_rate_rad_s, dt_s)
        elif self._params["WP_YAW_BEHAVIOR"]:
            navigator.look_ahead(dt_s)

    def _attitude(self, setpoint: AttitudeSetpoint, estimate: Estimate, boot_us: int, dt_s: float) -> Demand:
        """Rates, an attitude or both; the thrust is one, or a climb rate. Too old: level, and the height is kept."""
        navigator, is_old = self.navigator, self._has_timed_out(boot_us)
        if self._thrust_is_thrust() and not is_old:
            self._is_adrift = True
            return Demand(_wanted(setpoint), LIFT_COMPENSATION * max(0.0, min(1.0, setpoint.thrust)), False)
        if self._is_adrift:
            self._is_adrift = False
            navigator.start(estimate)
        if is_old:
            navigator.keep_heading()
            navigator.descend(0.0, dt_s)
            return Demand(*navigator.level(estimate, dt_s), is_position_control=False)
        navigator.yaw_rad = estimate.euler_rad[2]
        navigator.descend(-self._climb_rate(setpoint.thrust), dt_s)
        return Demand(_wanted(setpoint), navigator.level(estimate, dt_s)[1], is_position_control=False)

    def _climb_rate(self, thrust: float) -> float:
        part = 2.0 * (max(0.0, min(1.0, thrust)) - 0.5)
        return part * _CM * self._params["WPNAV_SPEED_UP" if part > 0 else "WPNAV_SPEED_DN"]


def _wanted(setpoint: AttitudeSetpoint) -> AttitudeInput | RatesInput:
    if setpoint.quaternion is None:
        return RatesInput(setpoint.rates_frd_rad_s)
    return AttitudeInput(setpoint.quaternion, setpoint.rates_frd_rad_s)


def _stopping_place(estimate: Estimate) -> Vec3:
    """Where the vehicle stands when it has braked with 2.5 m/s^2 sideways and 1 m/s^2 up or down."""
    n, e, d = estimate.position_ned_m
    vn, ve, vd = estimate.velocity_ned_m_s
    ahead_s = math.hypot(vn, ve) / 5.0
    return (n + ahead_s * vn, e + ahead_s * ve, d + abs(vd) * vd / 2.0)
