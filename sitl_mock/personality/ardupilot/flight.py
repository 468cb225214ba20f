"""What each of ArduCopter's modes asks of the attitude control and of the motors, tick by tick."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from sitl_mock.geometry import ZERO3, Vec3, tilt_rad
from sitl_mock.personality.ardupilot.attitude import AttitudeInput, RatesInput
from sitl_mock.personality.ardupilot.guided import AttitudeSetpoint, KinematicSetpoint, Rejected
from sitl_mock.personality.ardupilot.missions import (
    CHANGE_SPEED,
    LAND,
    LOITER_TIME,
    LOITER_UNLIMITED,
    RTL,
    TAKEOFF,
    Mission,
    place_of,
)
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.sensors import Estimate

LIFT_COMPENSATION = 1.072
"""Thrust over the field `thrust`: what ArduCopter adds for thin air and a battery below its full voltage.

SITL hovers at a field of 0.363 (recorded) with 0.389 of its thrust (its model).
"""
_THRUST_AS_THRUST = 8
_REACHED_M = 0.3
_STICK_DEAD_ZONE = 0.1
_CM = 0.01
_BY_STICK = (Mode.ALT_HOLD, Mode.LOITER, Mode.POSHOLD)


@dataclass(frozen=True, slots=True)
class Demand:
    """What a mode asks for: the attitude's input, thrust as a share of all motors' full one, and how it came about."""

    attitude: AttitudeInput | RatesInput
    thrust_norm: float
    is_position_control: bool = True


class Flight:
    """Flies the mode in force.

    Attributes:
        setpoint: what GUIDED follows.
        takeoff_us: when the last takeoff was asked for.
        throttle_stick: the pilot's, 0 (down, as SITL's is while nobody moves it) to 1.
    """

    def __init__(self, navigator: Navigator, params: Parameters, mission: Mission) -> None:
        self.navigator = navigator
        self._mission = mission
        self._params = params
        self.setpoint: AttitudeSetpoint | KinematicSetpoint | None = None
        self._setpoint_us = 0
        self._climb_to_m: float | None = None
        self._stage = ""
        self._stage_us = 0
        self._hold_ned_m: Vec3 = ZERO3
        self._is_deaf_to_positions = False
        self.throttle_stick = 0.0
        self.takeoff_us = 0

    # --- orders ------------------------------------------------------------------------------------------------

    def enter(self, mode: Mode, estimate: Estimate, boot_us: int) -> None:
        """Begin a mode where the vehicle is."""
        self.setpoint, self._climb_to_m = None, None
        self._is_deaf_to_positions = False
        self.navigator.speed_m_s = None
        self._stage, self._stage_us = "climb" if mode in (Mode.RTL, Mode.SMART_RTL) else "", boot_us
        self.navigator.start(estimate)
        self._hold_ned_m = _stopping_place(estimate)

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
        self._climb_to_m = None
        self.setpoint, self._setpoint_us = setpoint, boot_us

    def turn(self, yaw_rad: float, estimate: Estimate, boot_us: int) -> None:
        """Head there while GUIDED goes on with what it does."""
        followed = self.kinematic or KinematicSetpoint(position_ned_m=self._hold_ned_m)
        self.take(replace(followed, yaw_rad=yaw_rad, yaw_rate_rad_s=None), estimate, boot_us)

    @property
    def is_taking_off(self) -> bool:
        """Whether a takeoff has been asked for and has not reached its height."""
        return self._climb_to_m is not None

    @property
    def is_landing(self) -> bool:
        """Whether a return has come to its landing."""
        return self._stage == "land"

    @property
    def kinematic(self) -> KinematicSetpoint | None:
        """The position or velocity that GUIDED follows, if it does."""
        return self.setpoint if isinstance(self.setpoint, KinematicSetpoint) else None

    def wants_lift(self, mode: Mode, boot_us: int) -> bool:
        """Whether a vehicle on the ground is to leave it."""
        if self.is_taking_off:
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
        if self.is_taking_off and mode is not Mode.AUTO:
            return self._takeoff(estimate, dt_s)
        if mode.is_guided:
            return self._guided(estimate, boot_us, dt_s)
        if mode in (Mode.RTL, Mode.SMART_RTL):
            return self._return(estimate, home_ned_m, boot_us, dt_s)
        if mode is Mode.AUTO:
            return self._auto(estimate, home_ned_m, boot_us, dt_s)
        if mode is Mode.LAND:
            return self._land(estimate, home_ned_m, dt_s)
        if mode.has_manual_throttle:
            lift = LIFT_COMPENSATION * self.throttle_stick
            return Demand(self.navigator.level(estimate, dt_s)[0], lift, is_position_control=False)
        self.navigator.keep_heading()
        if mode in _BY_STICK:
            self.navigator.descend(self._stick_sinks(), dt_s, _CM * self._params["PILOT_ACCEL_Z"])
            is_level = mode is Mode.ALT_HOLD
            control = self.navigator.level if is_level else self.navigator.control
            return Demand(*control(estimate, dt_s), is_position_control=not is_level)
        self.navigator.fly_to(self._hold_ned_m, dt_s)
        return Demand(*self.navigator.control(estimate, dt_s))

    def _takeoff(self, estimate: Estimate, dt_s: float) -> Demand:
        navigator, (_, _, down_m) = self.navigator, estimate.position_ned_m
        navigator.fly_to(self._hold_ned_m, dt_s)
        if self._climb_to_m is not None and down_m - self._climb_to_m < _REACHED_M / 10:
            self._climb_to_m = None
            self.setpoint = KinematicSetpoint(position_ned_m=self._hold_ned_m)
        return Demand(*navigator.control(estimate, dt_s))

    def _guided(self, estimate: Estimate, boot_us: int, dt_s: float) -> Demand:
        if isinstance(self.setpoint, AttitudeSetpoint):
            return self._attitude(self.setpoint, estimate, boot_us, dt_s)
        setpoint = self.setpoint or KinematicSetpoint(position_ned_m=self._hold_ned_m)
        if setpoint.position_ned_m is None and self._has_timed_out(boot_us):
            setpoint = KinematicSetpoint(velocity_ned_m_s=ZERO3)
        elif setpoint.velocity_ned_m_s is not None and self._has_timed_out(boot_us):
            setpoint = KinematicSetpoint(position_ned_m=setpoint.position_ned_m, yaw_rad=setpoint.yaw_rad)
        self.navigator.follow(setpoint, dt_s)
        self._head(setpoint, dt_s)
        return Demand(*self.navigator.control(estimate, dt_s))

    def _head(self, setpoint: KinematicSetpoint, dt_s: float) -> None:
        navigator = self.navigator
        if setpoint.yaw_rad is not None:
            navigator.turn_to(setpoint.yaw_rad, dt_s)
        elif setpoint.yaw_rate_rad_s is not None:
            navigator.turn(setpoint.yaw_rate_rad_s, dt_s)
        elif self._params["WP_YAW_BEHAVIOR"]:
            navigator.look_ahead(dt_s)

    def _attitude(self, setpoint: AttitudeSetpoint, estimate: Estimate, boot_us: int, dt_s: float) -> Demand:
        navigator = self.navigator
        if self._has_timed_out(boot_us):
            navigator.keep_heading()
            navigator.descend(0.0, dt_s)
            return Demand(*navigator.level(estimate, dt_s), is_position_control=False)
        wanted: AttitudeInput | RatesInput = RatesInput(setpoint.rates_frd_rad_s)
        if setpoint.quaternion is not None:
            wanted = AttitudeInput(setpoint.quaternion, setpoint.rates_frd_rad_s)
        if self._thrust_is_thrust():
            navigator.start(estimate)
            lift = LIFT_COMPENSATION * max(0.0, min(1.0, setpoint.thrust))
            return Demand(wanted, lift, is_position_control=False)
        navigator.yaw_rad = estimate.euler_rad[2]
        navigator.descend(-self._climb_rate(setpoint.thrust), dt_s)
        _, lift = navigator.level(estimate, dt_s)
        return Demand(wanted, lift, is_position_control=False)

    def _climb_rate(self, thrust: float) -> float:
        part = 2.0 * (max(0.0, min(1.0, thrust)) - 0.5)
        return part * _CM * self._params["WPNAV_SPEED_UP" if part > 0 else "WPNAV_SPEED_DN"]

    # --- the mission -------------------------------------------------------------------------------------------

    def begin_mission(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int) -> None:
        """Take up the mission at its current item, or at its first."""
        self._mission.current = max(0, self._mission.current - 1)
        self._next_item(estimate, home_ned_m, boot_us)

    def _next_item(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int) -> None:
        item = self._mission.go_on()
        while item is not None and item.command == CHANGE_SPEED:
            if item.params[1] > 0:
                self.navigator.speed_m_s = item.params[1]
            item = self._mission.go_on()
        self._stage, self._stage_us, self._climb_to_m = "", boot_us, None
        if item is None:
            self._hold_ned_m = self.navigator.target_ned_m
        elif item.command == RTL:
            self._stage = "climb"
        else:
            here = (*self._hold_ned_m[:2], estimate.position_ned_m[2])
            self._hold_ned_m = place_of(item, here, home_ned_m)
            if item.command == TAKEOFF:
                self._hold_ned_m = (*estimate.position_ned_m[:2], self._hold_ned_m[2])
                self._climb_to_m, self.takeoff_us = self._hold_ned_m[2], boot_us
            elif item.command == LAND:
                self._hold_ned_m = (*self._hold_ned_m[:2], estimate.position_ned_m[2])

    def _auto(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        if self._stage:
            return self._return(estimate, home_ned_m, boot_us, dt_s)
        navigator, item = self.navigator, self._mission.item
        navigator.fly_to(self._hold_ned_m, dt_s)
        navigator.look_ahead(dt_s)
        if item is not None and self._is_there(item.command, estimate):
            waits_s = item.params[0] if item.params[0] > 0 else 0.0
            if item.command == LAND:
                self._stage = "land"
            elif item.command != LOITER_UNLIMITED and boot_us - self._stage_us >= 1e6 * waits_s:
                self._mission.reach()
                self._next_item(estimate, home_ned_m, boot_us)
        else:
            self._stage_us = boot_us
        return Demand(*navigator.control(estimate, dt_s))

    def _is_there(self, command: int, estimate: Estimate) -> bool:
        n, e, d = (there - here for there, here in zip(self._hold_ned_m, estimate.position_ned_m, strict=True))
        if command == TAKEOFF:
            return d > -_REACHED_M
        radius_m = _REACHED_M if command in (LAND, LOITER_TIME) else _CM * self._params["WPNAV_RADIUS"]
        return math.sqrt(n * n + e * e + d * d) < radius_m

    # --- coming home -------------------------------------------------------------------------------------------

    def _return(self, estimate: Estimate, home_ned_m: Vec3, boot_us: int, dt_s: float) -> Demand:
        """Climb to RTL_ALT, go home, wait RTL_LOIT_TIME, come down."""
        navigator, (n, e, d) = self.navigator, estimate.position_ned_m
        if self._stage == "land":
            return self._land(estimate, home_ned_m, dt_s)
        height_m = min(self._hold_ned_m[2], home_ned_m[2] - _CM * self._params["RTL_ALT"])
        if self._stage == "climb":
            navigator.fly_to((*self._hold_ned_m[:2], height_m), dt_s)
            self._go_on(d - height_m < _REACHED_M, "home", boot_us)
        else:
            navigator.fly_to((*home_ned_m[:2], height_m), dt_s)
            is_home = math.hypot(n - home_ned_m[0], e - home_ned_m[1]) < _REACHED_M
            if self._stage == "home":
                navigator.look_ahead(dt_s)
                self._go_on(is_home, "wait", boot_us)
            else:
                navigator.keep_heading()
                self._go_on(boot_us - self._stage_us >= 1e3 * self._params["RTL_LOIT_TIME"], "land", boot_us)
        return Demand(*navigator.control(estimate, dt_s))

    def _go_on(self, is_over: bool, stage: str, boot_us: int) -> None:
        if is_over:
            self._stage, self._stage_us = stage, boot_us

    def _land(self, estimate: Estimate, home_ned_m: Vec3, dt_s: float) -> Demand:
        """WPNAV_SPEED_DN (or LAND_SPEED_HIGH) down to LAND_ALT_LOW above home, then LAND_SPEED."""
        params, height_m = self._params, home_ned_m[2] - estimate.position_ned_m[2]
        fast = params["LAND_SPEED_HIGH"] or params["WPNAV_SPEED_DN"]
        is_high = height_m > _CM * params["LAND_ALT_LOW"]
        self.navigator.keep_heading()
        self.navigator.descend(_CM * (fast if is_high else params["LAND_SPEED"]), dt_s)
        return Demand(*self.navigator.control(estimate, dt_s))

    def _stick_sinks(self) -> float:
        """The speed down that the throttle stick asks for: PILOT_SPEED_DN (0: as up) at its lowest, none in the middle."""
        up = _CM * self._params["PILOT_SPEED_UP"]
        down = _CM * self._params["PILOT_SPEED_DN"] or up
        away = self.throttle_stick - 0.5
        if abs(away) <= _STICK_DEAD_ZONE:
            return 0.0
        part = (abs(away) - _STICK_DEAD_ZONE) / (0.5 - _STICK_DEAD_ZONE)
        return -up * part if away > 0 else down * part


def boosted(lift_norm: float, target: tuple[float, float, float, float], is_on: bool) -> float:
    """ATC_ANGLE_BOOST: thrust over the cosine of the tilt asked for, none upside down, within full thrust."""
    if is_on:
        cosine = math.cos(tilt_rad(target))
        lift_norm *= max(0.0, min(1.0, 10.0 * cosine)) / max(0.1, min(1.0, cosine))
    return max(0.0, min(1.0, lift_norm))


def _stopping_place(estimate: Estimate) -> Vec3:
    """Where the vehicle stands when it has braked with 2.5 m/s^2 sideways and 1 m/s^2 up or down."""
    n, e, d = estimate.position_ned_m
    vn, ve, vd = estimate.velocity_ned_m_s
    ahead_s = math.hypot(vn, ve) / 5.0
    return (n + ahead_s * vn, e + ahead_s * ve, d + abs(vd) * vd / 2.0)
