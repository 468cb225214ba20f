"""ArduCopter's commander: the mode in force, arming, takeoff and landing, and what it says about them.

Results and texts are ArduCopter's. That of a crash comes from its source, not from a recording.
"""

from __future__ import annotations

import math
from dataclasses import replace

from mavquad.protocol.codec import mavlink
from sitl_mock.geometry import ZERO3, Vec3, wrap_pi
from sitl_mock.personality.ardupilot import motors
from sitl_mock.personality.ardupilot.arming import complaints
from sitl_mock.personality.ardupilot.boot import Boot
from sitl_mock.personality.ardupilot.demand import Demand
from sitl_mock.personality.ardupilot.flight import Flight
from sitl_mock.personality.ardupilot.ground import Ground
from sitl_mock.personality.ardupilot.guided import KinematicSetpoint
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.modes import NOT_FLOWN, Mode
from sitl_mock.personality.ardupilot.news import CRITICAL, EMERGENCY, INFO, WARNING, News
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimate

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
DENIED: int = mavlink.MAV_RESULT_DENIED
FAILED: int = mavlink.MAV_RESULT_FAILED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED

_DISARM_AFTER_US = 508_000
"""From landing until the motors stop, as recorded."""
_CRASH_AFTER_US = 2_000_000
_IDLE_MORE_S = 0.4
"""DISARM_DELAY of 10 s took 10.4 s."""
_LIGHT_PART = 0.3
"""Part of the hover's thrust below which a vehicle on the ground lands."""
_TAKEOFF_SLEW_PER_S = 0.5
_SPOOL_UP_S, _TAKEOFF_WAITS_S = 0.5, 0.15
"""A takeoff's thrust grows so fast until the vehicle leaves the ground, so long after it was asked for or the motors
were ready, as recorded."""
_INIT_FAILED = "init failed"
_UNSAFE = {
    "gcs": ("GCS failsafe on",),
    "battery low": ("Battery 1 low voltage failsafe", "Battery failsafe"),
}
"""What keeps the vehicle from arming while a failsafe acts."""


class Copter:
    """Armed or not, which mode, landed or not.

    Attributes:
        flight: flies the mode.
        mission: that of AUTO.
        ground: watches the ground.
        news: what there is to be told.
        in_failsafe: names of the failsafes that act, for HEARTBEAT's system_status.
        home_ned_m: where home is; `has_home` from the moment that it is known.
        armed_us: when the vehicle was armed last.
    """

    def __init__(
        self, boot: Boot, params: Parameters, flight: Flight, mission: Mission, news: News, hover_thrust_norm: float
    ) -> None:
        self._boot = boot
        self._params = params
        self.flight = flight
        self.mission = mission
        self.news = news
        self.ground = Ground()
        self._light_norm = _LIGHT_PART * hover_thrust_norm
        self.in_failsafe: set[str] = set()
        self.mode = Mode.STABILIZE
        self.armed = False
        self.home_ned_m: Vec3 = ZERO3
        self.has_home = False
        self.armed_us = 0
        self._idle_since_us = 0
        self._lift_us: int | None = None
        self._has_switch = False
        self._estimate: Estimate | None = None

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self.ground.landed

    @property
    def is_landing(self) -> bool:
        """Whether the mode brings the vehicle down, to disarm there."""
        return self.flight.is_landing(self.mode)

    # --- modes -------------------------------------------------------------------------------------------------

    def request_mode(self, number: int, boot_us: int) -> int:
        """MAV_RESULT of a request for a mode by its number."""
        if number not in {mode.value for mode in Mode}:
            failed, *before = NOT_FLOWN.get(number, ("",))
            for text in (*before, f"Mode change to {failed}" if failed else f"No such mode {number & 0xFF}"):
                self.news.say(WARNING, text)
            return FAILED
        mode = Mode(number)
        reason = self._mode_refused(mode, boot_us)
        if not reason:
            self.select(mode, boot_us)
            return ACCEPTED
        if reason == _INIT_FAILED and self.mission.items:
            self.news.say(CRITICAL, "Auto: Missing Takeoff Cmd")
        self.news.say(WARNING, f"Mode change to {mode.text} failed: {reason}")
        return FAILED

    def _mode_refused(self, mode: Mode, boot_us: int) -> str:
        if mode is self.mode or not self.armed:
            return ""
        if mode.needs_position and boot_us < self._boot.at.position_us:
            return "requires position"
        can_begin = self.mission.items and (not self.landed or self.mission.starts_with_takeoff)
        return _INIT_FAILED if mode is Mode.AUTO and not can_begin else ""

    def select(self, mode: Mode, boot_us: int) -> None:
        """Fly this mode from now on; the one in force is not begun anew."""
        if mode is self.mode:
            return
        self.mode, self.news.mode_changed = mode, True
        self.mission.leave()
        self._idle_since_us = boot_us
        if self._estimate is not None:
            self.flight.enter(mode, self._estimate, boot_us)
            if mode is Mode.AUTO and (self.armed or not self.mission.items):
                self._begin_mission(boot_us)

    def start_mission(self, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_MISSION_START: AUTO from its first item; also disarmed, where nothing moves."""
        if self.mode is not Mode.AUTO:
            self.mission.current = 0
            if self.request_mode(Mode.AUTO, boot_us) != ACCEPTED:
                return FAILED
        self.mission.current = 0
        self._begin_mission(boot_us)
        return ACCEPTED

    def _begin_mission(self, boot_us: int) -> None:
        if self._estimate is not None:
            self._idle_since_us = boot_us
            self.flight.begin_mission(self._estimate, self.home_ned_m, boot_us)

    # --- arming ------------------------------------------------------------------------------------------------

    def complaints(self, boot_us: int) -> list[str]:
        """Why the vehicle may not be armed now; SYS_STATUS PREARM_CHECK says whether there is anything."""
        reasons = complaints(self._boot.at, self.mode, bool(self._params["ARMING_CHECK"]), boot_us)
        if self.mode is Mode.AUTO and not self.mission.items:
            reasons.append("Mode requires mission")
        for failsafe, told in _UNSAFE.items():
            reasons += told if failsafe in self.in_failsafe else ()
        return reasons

    def arm(self, boot_us: int, forced: bool) -> int:
        """MAV_RESULT of an arming request."""
        if self.armed:
            return ACCEPTED
        reasons = [] if forced else self.complaints(boot_us)
        if self.ground.flipped_us is not None:
            reasons = ["Vehicle is upside down"]
        elif not self.mode.can_be_armed and not reasons:
            reasons = [f"{self.mode.text} mode not armable"]
        if reasons:
            for reason in reasons:
                self.news.say(CRITICAL, f"Arm: {reason}")
            return FAILED
        self.armed, self.armed_us, self._idle_since_us = True, boot_us, boot_us
        self.move_home(None)
        self.news.say(INFO, "Arming motors")
        return ACCEPTED

    def check(self, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_RUN_PREARM_CHECKS; what they find is said, as by ArduPilot 4.7."""
        if self.armed:
            return TEMPORARILY_REJECTED
        self._complain(boot_us)
        return ACCEPTED

    def _complain(self, boot_us: int) -> None:
        for reason in self.complaints(boot_us):
            self.news.say(CRITICAL, f"PreArm: {reason}")

    def disarm(self, forced: bool) -> int:
        """MAV_RESULT of a disarming request; in the air only by force."""
        if self.armed and not self.landed and not forced:
            return FAILED
        self.stop_motors()
        return ACCEPTED

    def stop_motors(self) -> None:
        """Disarm, whatever the vehicle does."""
        if self.armed:
            self.armed = False
            self.mission.finish(is_flown=self.mode is Mode.AUTO and self.is_landing)
            self.flight.navigator.reset()
            self.news.disarmed()

    # --- other commands ----------------------------------------------------------------------------------------

    def take_off(self, height_m: float, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_NAV_TAKEOFF to this height above home."""
        if not (self.armed and self.landed and self.mode.takes_off_by_command) or self._estimate is None:
            return FAILED
        down_m = self.home_ned_m[2] - height_m
        if not math.isfinite(height_m) or down_m >= self._estimate.position_ned_m[2]:
            return FAILED
        since_us = self.flight.takeoff_us if self.flight.is_taking_off(self.mode) else boot_us
        self.flight.take_off(down_m, self._estimate, since_us)
        self._idle_since_us = boot_us
        return ACCEPTED

    def turn(self, degrees: float, rate: float, is_relative: bool, direction: float, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_CONDITION_YAW, with a rate in degrees/s; 0: as fast as ATC_SLEW_YAW allows."""
        if self.mode is not Mode.GUIDED or self.landed or self._estimate is None or not 0 <= degrees <= 360:
            return FAILED
        angle = math.radians(degrees)
        yaw_rad = self.flight.navigator.yaw_rad + math.copysign(angle, direction or 1.0) if is_relative else angle
        self.flight.turn(wrap_pi(yaw_rad), math.radians(abs(rate)), self._estimate, boot_us)
        return ACCEPTED

    def go_to_item(self, index: int) -> int:
        """MAV_RESULT of MAV_CMD_DO_SET_MISSION_CURRENT."""
        return ACCEPTED if self.mission.set_current(index) else FAILED

    def pause(self, is_pause: bool) -> int:
        """MAV_RESULT of MAV_CMD_DO_PAUSE_CONTINUE: stop on the way of AUTO, or go on."""
        if self.mode is not Mode.AUTO:
            return FAILED
        self.mission.pause(is_pause)
        return ACCEPTED

    def look_at(self, place_ned_m: Vec3, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_DO_SET_ROI_LOCATION: GUIDED turns its nose there (and does not follow the place)."""
        if self._estimate is not None and self.mode is Mode.GUIDED and not self.landed:
            n, e, _ = (there - here for there, here in zip(place_ned_m, self._estimate.position_ned_m, strict=True))
            self.flight.turn(math.atan2(e, n), 0.0, self._estimate, boot_us)
        return ACCEPTED

    def change_speed(self, speed_m_s: float) -> int:
        """MAV_RESULT of MAV_CMD_DO_CHANGE_SPEED."""
        if not 0 < speed_m_s < math.inf:
            return FAILED
        self.flight.navigator.speed_m_s = speed_m_s
        return ACCEPTED

    def reposition(self, place_ned_m: Vec3, may_change_mode: bool, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_DO_REPOSITION."""
        if self.mode is not Mode.GUIDED:
            if not may_change_mode:
                return DENIED
            if self.request_mode(Mode.GUIDED, boot_us) != ACCEPTED:
                return DENIED
        if self.landed or self._estimate is None:
            return FAILED
        self.flight.take(KinematicSetpoint(position_ned_m=place_ned_m), self._estimate, boot_us)
        return ACCEPTED

    def move_home(self, place_ned_m: Vec3 | None) -> int:
        """MAV_RESULT of MAV_CMD_DO_SET_HOME; None: to where the vehicle is."""
        if not self.has_home or self._estimate is None:
            return FAILED
        self.home_ned_m = self.mission.home_ned_m = place_ned_m or self._estimate.position_ned_m
        self.news.home_changed = True
        return ACCEPTED

    # --- each tick ---------------------------------------------------------------------------------------------

    def step(self, truth: VehicleState, estimate: Estimate, thrust_norm: float, boot_us: int) -> None:
        """Watch the boot, the ground and what disarms; `thrust_norm` is the thrust in force."""
        if self._estimate is None:
            self.flight.enter(self.mode, estimate, boot_us)
        self._estimate = estimate
        self._watch_boot(boot_us)
        if truth.impact is not None:
            text = self.ground.hit(truth.impact, boot_us)
            if text:
                self.news.say(INFO, text)
        if self.ground.step(truth.on_ground, thrust_norm <= self._light_norm or self.is_landing, boot_us):
            self._idle_since_us = boot_us
            self.flight.navigator.reset()
            self.news.landed(self.ground.flown_us(boot_us), boot_us)
        if self.armed and not self.landed:
            self.news.flies_at(self.home_ned_m[2] - estimate.position_ned_m[2])
        self.news.step(self.ground.flown_us(boot_us), boot_us)
        if self.armed:
            self._watch_disarm(boot_us)

    def _watch_boot(self, boot_us: int) -> None:
        at = self._boot.at
        if not self._has_switch and boot_us >= at.switch_us:
            self._has_switch = True
            self.select(Mode.STABILIZE, boot_us)  # as the mode switch stands; a mode set before is lost
        if not self.has_home and boot_us >= at.origin_us:
            self.has_home = self.news.home_changed = True
        if self.news.complains(boot_us) and not self.armed:
            self._complain(boot_us)

    def _watch_disarm(self, boot_us: int) -> None:
        ground = self.ground
        if ground.flipped_us is not None:
            if boot_us - ground.flipped_us >= _CRASH_AFTER_US:
                self.news.say(EMERGENCY, "Crash: Disarming: AngErr=90>30, Accel=0.0<3.0")
                self.stop_motors()
            return
        if not ground.landed:
            return
        delay_s = self._params["DISARM_DELAY"]
        if self.mode is Mode.LAND or (self.is_landing and ground.landed_us > self.armed_us):
            if boot_us - ground.landed_us >= _DISARM_AFTER_US:
                self.stop_motors()
        elif delay_s > 0 and boot_us - self._idle_since_us >= (delay_s + _IDLE_MORE_S) * 1e6:
            self.stop_motors()

    def demand(self, estimate: Estimate, boot_us: int, dt_s: float) -> Demand | None:
        """What the motors are to do; None: stand idle."""
        since_s = (boot_us - self.armed_us) / 1e6
        if not self.armed or since_s < motors.SPOOLED_S or self.ground.flipped_us is not None:
            return None
        if not self.landed:
            demand = self.flight.demand(self.mode, estimate, self.home_ned_m, boot_us, dt_s)
            return self._spooling(demand, boot_us)
        if not self.flight.wants_lift(self.mode, boot_us):
            self._lift_us = None
            return None
        self._idle_since_us = boot_us
        self._lift_us = boot_us if self._lift_us is None else self._lift_us
        demand = self.flight.demand(self.mode, estimate, self.home_ned_m, boot_us, dt_s)
        if not self.flight.is_taking_off(self.mode):
            self.ground.leave()
            return self._spooling(replace(demand, is_position_control=False), boot_us)
        self._lift_us = None
        self.flight.navigator.start(estimate)
        self.flight.navigator.reset()
        asked_s = (self.flight.takeoff_us - self.armed_us) / 1e6
        from_s = max(motors.SPOOLED_S + _TAKEOFF_WAITS_S, asked_s + _SPOOL_UP_S)
        return Demand(demand.attitude, _TAKEOFF_SLEW_PER_S * (since_s - from_s)) if since_s > from_s else None

    def _spooling(self, demand: Demand, boot_us: int) -> Demand:
        """The demand with no more thrust than motors give that have begun to lift a moment ago."""
        if self._lift_us is None:
            return demand
        allowed = motors.allowed_thrust((boot_us - self._lift_us) / 1e6)
        if allowed >= 1.0:
            self._lift_us = None
        return replace(demand, thrust_norm=min(demand.thrust_norm, allowed))
