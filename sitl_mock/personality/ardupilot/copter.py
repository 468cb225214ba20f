"""ArduCopter's commander: the mode in force, arming, the ground, and what it says about them.

Results and texts are ArduCopter's. Those of a crash and of a fence come from its source, not from a recording.
"""

from __future__ import annotations

import math

from mavquad.protocol.codec import mavlink
from sitl_mock.geometry import ZERO3, Vec3, wrap_pi
from sitl_mock.personality.ardupilot import motors
from sitl_mock.personality.ardupilot.boot import Boot
from sitl_mock.personality.ardupilot.flight import Demand, Flight
from sitl_mock.personality.ardupilot.guided import KinematicSetpoint
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.modes import NOT_FLOWN, Mode
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimate

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
DENIED: int = mavlink.MAV_RESULT_DENIED
FAILED: int = mavlink.MAV_RESULT_FAILED
EMERGENCY: int = mavlink.MAV_SEVERITY_EMERGENCY
CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL
WARNING: int = mavlink.MAV_SEVERITY_WARNING
INFO: int = mavlink.MAV_SEVERITY_INFO

_PREARM_EVERY_US = 30_000_000
_PREARM_FIRST_US = 30_440_000
_LANDED_AFTER_US = 1_580_000
_DISARM_AFTER_US = 508_000
"""On the ground until it counts as landed, and from then until the motors stop, as recorded."""
_CRASH_SPEED_M_S = 3.0
_CRASH_TILT_RAD = math.radians(60.0)
_CRASH_AFTER_US = 2_000_000
_HIT_AFTER_US = 1_000_000
_LIGHT_PART = 0.3
"""Part of the hover's thrust below which a vehicle on the ground lands."""
_TAKEOFF_SLEW_PER_S = 0.5
"""A takeoff's thrust grows so fast until the vehicle leaves the ground, as recorded."""
_INIT_FAILED = "init failed"
_SPOOL_UP_S, _TAKEOFF_WAITS_S = 0.5, 0.15
_ALIGNED_AT_M = 2.7
_ALIGNED = tuple(f"EKF3 IMU{unit} MAG0 in-flight yaw alignment complete" for unit in (0, 1))
_TELL_EVERY_US = 30_000_000
"""How often the parameters STAT_RUNTIME and STAT_FLTTIME are set and told."""


class Copter:
    """Armed or not, which mode, landed or not.

    Attributes:
        texts: (severity, STATUSTEXT) to be sent.
        mode_changed: a HEARTBEAT is to be sent at once.
        told: names of parameters whose PARAM_VALUE is to be sent.
        home_changed: GPS_GLOBAL_ORIGIN and HOME_POSITION are to be sent at once.
        in_failsafe: names of the failsafes that act, for HEARTBEAT's system_status.
    """

    def __init__(
        self, boot: Boot, params: Parameters, flight: Flight, mission: Mission, hover_thrust_norm: float
    ) -> None:
        self._boot = boot
        self._params = params
        self.flight = flight
        self.mission = mission
        self._light_norm = _LIGHT_PART * hover_thrust_norm
        self.texts: list[tuple[int, str]] = []
        self.told: list[str] = []
        self.mode_changed = False
        self.home_changed = False
        self.in_failsafe: set[str] = set()
        self.mode = Mode.STABILIZE
        self.armed = False
        self.landed = True
        self.crashed = False
        self.home_ned_m: Vec3 = ZERO3
        self.has_home = False
        self.armed_us = 0
        self._idle_since_us = 0
        self._is_ready = False
        self._estimate: Estimate | None = None
        self._prearm_us = _PREARM_FIRST_US
        self._ground_us: int | None = None
        self._air_us: int | None = None
        self._landed_us = 0
        self._flipped_us: int | None = None
        self._is_aligned = False
        self._flown_us = 0
        self._tell_us = _TELL_EVERY_US

    # --- modes -------------------------------------------------------------------------------------------------

    def request_mode(self, number: int, boot_us: int) -> int:
        """MAV_RESULT of a request for a mode by its number."""
        if number not in {mode.value for mode in Mode}:
            name = NOT_FLOWN.get(number)
            text = f"No such mode {number}" if name is None else f"Mode change to {name} failed: not in this mock"
            self.texts.append((WARNING, text))
            return FAILED
        mode = Mode(number)
        reason = self._mode_refused(mode, boot_us)
        if reason:
            if reason == _INIT_FAILED and self.mission.items:
                self.texts.append((CRITICAL, "Auto: Missing Takeoff Cmd"))
            self.texts.append((WARNING, f"Mode change to {mode.name} failed: {reason}"))
            return FAILED
        self.select(mode, boot_us)
        return ACCEPTED

    def _mode_refused(self, mode: Mode, boot_us: int) -> str:
        if mode is self.mode or not self.armed:
            return ""
        if mode.needs_position and boot_us < self._boot.at.position_us:
            return "requires position"
        if mode is Mode.AUTO and not self._can_begin_mission():
            return _INIT_FAILED
        return ""

    def _can_begin_mission(self) -> bool:
        return bool(self.mission.items) and (not self.landed or self.mission.starts_with_takeoff)

    def start_mission(self, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_MISSION_START: AUTO from its first item."""
        if not self.armed:
            return FAILED
        self.mission.current = 0
        if self.mode is Mode.AUTO:
            self._begin_mission(boot_us)
            return ACCEPTED
        return self.request_mode(Mode.AUTO, boot_us)

    def _begin_mission(self, boot_us: int) -> None:
        if self._estimate is not None:
            self._idle_since_us = boot_us
            self.flight.begin_mission(self._estimate, self.home_ned_m, boot_us)

    def select(self, mode: Mode, boot_us: int) -> None:
        """Fly this mode from now on; the one in force is not begun anew."""
        if mode is self.mode:
            return
        self.mode, self.mode_changed = mode, True
        self._idle_since_us = boot_us
        if self._estimate is not None:
            self.flight.enter(mode, self._estimate, boot_us)
            if mode is Mode.AUTO and self.armed:
                self._begin_mission(boot_us)

    # --- arming ------------------------------------------------------------------------------------------------

    def is_ready(self, boot_us: int) -> bool:
        """Whether the prearm checks pass (SYS_STATUS PREARM_CHECK)."""
        return not self._complaints(boot_us)

    def _complaints(self, boot_us: int) -> list[str]:
        """Why the vehicle may not be armed now."""
        at, mode = self._boot.at, self.mode
        reasons = []
        if int(self._params["ARMING_CHECK"]):
            if boot_us < at.yaw_us and not mode.has_manual_throttle:
                reasons.append("Need Alt Estimate")
            if boot_us < at.settled_us:
                reasons.append("Accels inconsistent")
        if boot_us < at.yaw_us:
            reasons.append("EKF attitude is bad")
        if boot_us < at.origin_us and (mode.needs_position or int(self._params["ARMING_CHECK"])):
            reasons.append("AHRS: waiting for home")
        if mode.needs_position and boot_us < at.armable_us and not reasons:
            reasons.append("Need Position Estimate")
        return reasons

    def arm(self, boot_us: int, forced: bool) -> int:
        """MAV_RESULT of an arming request."""
        if self.armed:
            return ACCEPTED
        reasons = [] if forced else self._complaints(boot_us)
        if self._flipped_us is not None:
            reasons = ["Vehicle is upside down"]
        elif not self.mode.can_be_armed and not reasons:
            reasons = [f"{self.mode.name} mode not armable"]
        if reasons:
            self.texts += [(CRITICAL, f"Arm: {reason}") for reason in reasons]
            return FAILED
        self.armed, self.armed_us, self._idle_since_us = True, boot_us, boot_us
        self._set_home()
        self.texts.append((INFO, "Arming motors"))
        return ACCEPTED

    def _set_home(self) -> None:
        if self._estimate is not None and self.has_home:
            self.home_ned_m = self.mission.home_ned_m = self._estimate.position_ned_m
            self.home_changed = True

    def disarm(self, forced: bool) -> int:
        """MAV_RESULT of a disarming request; in the air only by force."""
        if self.armed and not self.landed and not forced:
            return FAILED
        self.stop_motors()
        return ACCEPTED

    def stop_motors(self) -> None:
        """Disarm, whatever the vehicle does."""
        if self.armed:
            self.armed = self._is_aligned = False
            self.flight.navigator.reset()
            self.told.append("MOT_THST_HOVER")
            self.texts.append((INFO, "Disarming motors"))

    def take_off(self, height_m: float, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_NAV_TAKEOFF to this height above home."""
        if not (self.armed and self.landed and self.mode.takes_off_by_command) or self._estimate is None:
            return FAILED
        down_m = self.home_ned_m[2] - height_m
        if not math.isfinite(height_m) or down_m >= self._estimate.position_ned_m[2]:
            return FAILED
        self.flight.take_off(down_m, self._estimate, boot_us)
        self._idle_since_us = boot_us
        return ACCEPTED

    def turn(self, degrees: float, is_relative: bool, direction: float, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_CONDITION_YAW."""
        if self.mode is not Mode.GUIDED or self.landed or self._estimate is None or not 0 <= degrees <= 360:
            return FAILED
        angle = math.radians(degrees)
        yaw_rad = self.flight.navigator.yaw_rad + math.copysign(angle, direction or 1.0) if is_relative else angle
        self.flight.turn(wrap_pi(yaw_rad), self._estimate, boot_us)
        return ACCEPTED

    def change_speed(self, speed_m_s: float) -> int:
        """MAV_RESULT of MAV_CMD_DO_CHANGE_SPEED."""
        if not 0 < speed_m_s < math.inf:
            return FAILED
        self.flight.navigator.speed_m_s = speed_m_s
        return ACCEPTED

    def reposition(self, place_ned_m: Vec3, may_change_mode: bool, boot_us: int) -> int:
        """MAV_RESULT of MAV_CMD_DO_REPOSITION."""
        if self.mode is not Mode.GUIDED and not (
            may_change_mode and self.request_mode(Mode.GUIDED, boot_us) == ACCEPTED
        ):
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
        self.home_changed = True
        return ACCEPTED

    # --- each tick ---------------------------------------------------------------------------------------------

    def step(self, truth: VehicleState, estimate: Estimate, thrust_norm: float, boot_us: int) -> None:
        """Watch the boot, the ground and what disarms; `thrust_norm` is the thrust in force."""
        if self._estimate is None:
            self.flight.enter(self.mode, estimate, boot_us)
        self._estimate = estimate
        self._watch_boot(boot_us)
        if truth.impact is not None:
            self._hit_ground(truth.impact.speed_m_s, truth.impact.tilt_rad, boot_us)
        self._watch_ground(truth.on_ground, thrust_norm, boot_us)
        self._watch_height(estimate)
        self._watch_disarm(boot_us)

    def _watch_height(self, estimate: Estimate) -> None:
        if not self._is_aligned and not self.landed and self.home_ned_m[2] - estimate.position_ned_m[2] > _ALIGNED_AT_M:
            self._is_aligned = True
            self.texts += [(INFO, text) for text in _ALIGNED]

    def _watch_boot(self, boot_us: int) -> None:
        at = self._boot.at
        if boot_us < at.armable_us + 1_000_000:
            self.texts += self._boot.texts(boot_us)
            self.told += self._boot.parameters(boot_us)
        if not self._is_ready and boot_us >= at.ready_us:
            self._is_ready = True
            self.select(Mode.STABILIZE, boot_us)  # the mode switch; a mode set before is lost
        if not self.has_home and boot_us >= at.origin_us:
            self.has_home = self.home_changed = True
        if boot_us >= self._prearm_us:
            self._prearm_us += _PREARM_EVERY_US
            if not self.armed:
                self.texts += [(CRITICAL, f"PreArm: {reason}") for reason in self._complaints(boot_us)]
        if boot_us >= self._tell_us:
            self._tell_us += _TELL_EVERY_US
            self._tell_times(boot_us)

    def _tell_times(self, boot_us: int) -> None:
        flown_us = self._flown_us + (0 if self.landed or self._air_us is None else boot_us - self._air_us)
        self._params.set("STAT_RUNTIME", boot_us // 1_000_000)
        self._params.set("STAT_FLTTIME", flown_us // 1_000_000)
        self.told += ["STAT_FLTTIME", "STAT_RUNTIME"] if flown_us else ["STAT_RUNTIME"]

    def _hit_ground(self, speed_m_s: float, tilt_rad: float, boot_us: int) -> None:
        if self._air_us is not None and boot_us - self._air_us >= _HIT_AFTER_US:
            self.texts.append((INFO, f"SIM Hit ground at {speed_m_s:.6f} m/s"))
        if tilt_rad > _CRASH_TILT_RAD:
            self._flipped_us = boot_us
        self.crashed |= speed_m_s > _CRASH_SPEED_M_S or self._flipped_us is not None

    def _watch_ground(self, on_ground: bool, thrust_norm: float, boot_us: int) -> None:
        if not on_ground:
            self._ground_us = None
            self._air_us = boot_us if self._air_us is None else self._air_us
            self.landed = False
            return
        if self._air_us is not None:
            self._flown_us += boot_us - self._air_us
            self._air_us = None
        is_light = thrust_norm <= self._light_norm or self.is_landing
        if self.landed or not is_light:
            self._ground_us = None
        elif self._ground_us is None:
            self._ground_us = boot_us
        elif boot_us - self._ground_us >= _LANDED_AFTER_US:
            self.landed, self._landed_us, self._idle_since_us = True, boot_us, boot_us
            self._tell_times(boot_us)
            self.flight.navigator.reset()

    @property
    def is_landing(self) -> bool:
        """Whether the mode brings the vehicle down, to disarm there."""
        return self.mode is Mode.LAND or self.flight.is_landing

    @property
    def touched_down_us(self) -> int | None:
        """Since when the vehicle stands on the ground and is about to count as landed."""
        return self._ground_us

    def _watch_disarm(self, boot_us: int) -> None:
        if not self.armed:
            return
        if self._flipped_us is not None:
            if boot_us - self._flipped_us >= _CRASH_AFTER_US:
                self.texts.append((EMERGENCY, "Crash: Disarming: AngErr=90>30, Accel=0.0<3.0"))
                self.stop_motors()
            return
        if not self.landed:
            return
        delay_s = self._params["DISARM_DELAY"]
        if self.is_landing and self._landed_us > self.armed_us:
            if boot_us - self._landed_us >= _DISARM_AFTER_US:
                self.stop_motors()
        elif delay_s > 0 and boot_us - self._idle_since_us >= (delay_s + 0.4) * 1e6:
            self.stop_motors()

    def demand(self, estimate: Estimate, boot_us: int, dt_s: float) -> Demand | None:
        """What the motors are to do; None: stand idle."""
        since_s = (boot_us - self.armed_us) / 1e6
        if not self.armed or since_s < motors.SPOOLED_S or self._flipped_us is not None:
            return None
        if not self.landed:
            return self.flight.demand(self.mode, estimate, self.home_ned_m, boot_us, dt_s)
        if not self.flight.wants_lift(self.mode, boot_us):
            return None
        self._idle_since_us = boot_us
        demand = self.flight.demand(self.mode, estimate, self.home_ned_m, boot_us, dt_s)
        if self.flight.is_taking_off:
            self.flight.navigator.start(estimate)
            self.flight.navigator.reset()
            asked_s = (self.flight.takeoff_us - self.armed_us) / 1e6
            from_s = max(motors.SPOOLED_S + _TAKEOFF_WAITS_S, asked_s + _SPOOL_UP_S)
            return Demand(demand.attitude, _TAKEOFF_SLEW_PER_S * (since_s - from_s)) if since_s > from_s else None
        return Demand(demand.attitude, min(demand.thrust_norm, motors.allowed_thrust(since_s)), False)
