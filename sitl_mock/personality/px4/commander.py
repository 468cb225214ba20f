"""PX4's commander: arming, the mode in force, the loss of OFFBOARD setpoints, landing, crash.

What the pilot chose (`intended`) and what flies (`mode`) differ during a failsafe. Texts and results are PX4's, seen
on 1.13.3 and 1.16.2; only the texts about a crash are the mock's own.
"""

from __future__ import annotations

import math

from mavquad.protocol.codec import mavlink
from sitl_mock.config import Px4Release
from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.inner_loops import PositionSetpoint, Setpoint, TorqueSetpoint
from sitl_mock.personality.params import ParameterServer
from sitl_mock.personality.px4.guidance import IDLE, Guidance, Speeds
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.offboard import OffboardInput
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimate

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
INFO: int = mavlink.MAV_SEVERITY_INFO
CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL

_US_PER_S = 1_000_000
_SPOOL_UP_US = 1_000_000
_LANDED_AFTER_US = 500_000
_RC_LOSS_TO_RTL_US = 15_000_000
_CRASH_SPEED_M_S = 3.0
_CRASH_TILT_RAD = math.radians(60.0)
_RCL_EXCEPT_OFFBOARD = 4
_LOW_THRUST = 0.3
"""Part of the hover thrust below which a vehicle on the ground counts as landed."""


class Commander:
    """Armed or not, which mode, landed or not. `texts` collects (severity, STATUSTEXT) until they are sent."""

    def __init__(
        self,
        firmware: Px4Release,
        params: ParameterServer,
        offboard: OffboardInput,
        hover_thrust_norm: float,
        ready_us: int,
    ) -> None:
        self._is_113 = firmware == "1.13"
        self._params = params
        self._offboard = offboard
        self._guidance = Guidance()
        self._low_thrust_norm = _LOW_THRUST * hover_thrust_norm
        self._ready_us = ready_us
        self.texts: list[tuple[int, str]] = []
        self.mode = Mode.LOITER
        self.intended = Mode.LOITER
        self.failsafe = False
        self.armed = False
        self.landed = True
        self.crashed = False
        self.home_ned_m: Vec3 = ZERO3
        self._rc_lost_us: int | None = None
        self._armed_us = 0
        self._has_flown = False
        self._ground_contact_us: int | None = None
        self._landed_us = 0
        self._estimate: Estimate | None = None
        self._is_flipped = False

    def is_ready(self, boot_us: int) -> bool:
        """Whether the preflight checks pass (SYS_STATUS PREARM_CHECK); they run while disarmed."""
        return boot_us >= self._ready_us and not self.crashed and (self.armed or not self._mode_forbids_arming())

    def is_torque_control(self) -> bool:
        """Whether SET_ACTUATOR_CONTROL_TARGET is in force, past the attitude and the rate controller."""
        return self.mode is Mode.OFFBOARD and isinstance(self._offboard.setpoint, TorqueSetpoint)

    # --- what commands ask -------------------------------------------------------------------------------------

    def arm(self, boot_us: int) -> int:
        """MAV_RESULT of an arming request."""
        if self.armed:
            return ACCEPTED
        reason = self._arming_denied(boot_us)
        if reason:
            self.texts.append((CRITICAL, reason))
            return TEMPORARILY_REJECTED
        self.armed, self._has_flown, self._armed_us = True, False, boot_us
        if self._estimate is not None:
            self.home_ned_m = self._estimate.position_ned_m
            self._guidance.enter(self._estimate)
        self.texts.append((INFO, "Armed by external command"))
        return ACCEPTED

    def _arming_denied(self, boot_us: int) -> str:
        if self.crashed:
            return f"Preflight Fail: {'Roll failure detected' if self._is_flipped else 'crash detected'}"
        if boot_us < self._ready_us:
            return "Preflight Fail: ekf2 missing data" if self._is_113 else _HEALTH
        if self._mode_forbids_arming():
            return "Mode not suitable for takeoff"
        if self.mode is Mode.OFFBOARD and not self._has_stream(boot_us):
            return _HEALTH
        return ""

    def _mode_forbids_arming(self) -> bool:
        return self._is_113 and self.mode is Mode.RTL  # AUTO.LAND is allowed: modeCheck.cpp of 1.13.3

    def disarm(self, forced: bool) -> int:
        """MAV_RESULT of a disarming request; in the air only by force."""
        if self.armed and not self.landed and not forced:
            self.texts.append((CRITICAL, "Disarming denied: not landed"))
            return TEMPORARILY_REJECTED
        if self.armed:
            self._disarm("Disarmed by external command")
        return ACCEPTED

    def take_off(self, climb_m: float) -> None:
        """Climb to `climb_m` above home in AUTO.TAKEOFF (once armed)."""
        self.select(Mode.TAKEOFF)
        self._guidance.climb_to(self.home_ned_m[2] - climb_m)

    def request(self, mode: Mode, boot_us: int) -> int:
        """MAV_RESULT of a mode request: OFFBOARD wants a stream of setpoints (1.16 on the ground: not yet)."""
        may_wait = not self._is_113 and not self.armed
        if mode is Mode.OFFBOARD and not self._has_stream(boot_us) and not may_wait:
            return TEMPORARILY_REJECTED
        self.select(mode)
        return ACCEPTED

    def select(self, mode: Mode) -> None:
        """Fly this mode from now on, as the pilot's choice."""
        if self.failsafe and self._is_113:
            self.texts.append((INFO, "Failsafe mode deactivated"))
        self.intended, self.failsafe, self._rc_lost_us = mode, False, None
        self._enter(mode)

    # --- each tick ---------------------------------------------------------------------------------------------

    def step(self, truth: VehicleState, estimate: Estimate, thrust_norm: float, boot_us: int) -> None:
        """Watch the ground, the setpoint stream and the ends of the modes; `thrust_norm` is the thrust in force."""
        self._estimate = estimate
        if truth.impact is not None:
            self._check_crash(truth.impact.speed_m_s, truth.impact.tilt_rad)
        self._watch_ground(truth.on_ground, thrust_norm, boot_us)
        self._watch_disarm(boot_us)
        self._watch_offboard(boot_us)
        if self.armed and self._guidance.done:
            if self.mode is Mode.TAKEOFF:
                self.mode = self.intended = Mode.LOITER
                self._guidance.stay()
            elif self.mode is Mode.RTL:
                self._enter(Mode.LAND)

    def setpoint(self, estimate: Estimate, on_ground: bool, boot_us: int, dt_s: float) -> Setpoint:
        """What the inner loops are to follow until the next tick."""
        if not self.armed:
            return IDLE
        if self.mode is Mode.OFFBOARD:
            given = self._offboard.next_setpoint()
            if isinstance(given, PositionSetpoint) and self.landed and boot_us - self._armed_us < _SPOOL_UP_US:
                return IDLE
            return given or IDLE
        if self.landed and (self.mode is not Mode.TAKEOFF or boot_us - self._armed_us < _SPOOL_UP_US):
            return IDLE
        speeds = Speeds(self._params["MPC_TKO_SPEED"], self._params["MPC_LAND_SPEED"])
        return self._guidance.setpoint(self.mode, estimate, self.home_ned_m, on_ground, speeds, dt_s)

    def _has_stream(self, boot_us: int) -> bool:
        return self._offboard.is_alive(boot_us, self._params["COM_OF_LOSS_T"])

    def _enter(self, mode: Mode) -> None:
        self.mode = mode
        if self._estimate is not None:
            self._guidance.enter(self._estimate)

    def _disarm(self, text: str) -> None:
        self.armed = False
        self.texts.append((INFO, text))

    def _check_crash(self, speed_m_s: float, tilt_rad: float) -> None:
        self._is_flipped = tilt_rad > _CRASH_TILT_RAD
        if speed_m_s <= _CRASH_SPEED_M_S and not self._is_flipped:
            return
        self.crashed = True
        self.texts.append((CRITICAL, "Crash detected: motors stopped"))
        if self.armed:
            self._disarm("Disarmed by crash")

    def _watch_ground(self, on_ground: bool, thrust_norm: float, boot_us: int) -> None:
        if not on_ground:
            if self.landed:
                self.landed, self._has_flown = False, True
                self.texts.append((INFO, "Takeoff detected"))
            self._ground_contact_us = None
            return
        if self.landed:
            return
        if self.armed and thrust_norm > self._low_thrust_norm:
            self._ground_contact_us = None
        elif self._ground_contact_us is None:
            self._ground_contact_us = boot_us
        elif boot_us - self._ground_contact_us >= _LANDED_AFTER_US:
            self.landed, self._landed_us = True, boot_us
            self.texts.append((INFO, "Landing detected"))

    def _watch_disarm(self, boot_us: int) -> None:
        if not (self.armed and self.landed):
            return
        if self._has_flown:
            if boot_us - self._landed_us >= self._params["COM_DISARM_LAND"] * _US_PER_S:
                self._disarm("Disarmed by landing")
        elif boot_us - self._armed_us >= self._params["COM_DISARM_PRFLT"] * _US_PER_S:
            self._disarm("Disarmed by auto preflight disarming")

    def _watch_offboard(self, boot_us: int) -> None:
        if self.intended is not Mode.OFFBOARD:
            return
        if self._rc_lost_us is not None:
            if self.mode is Mode.LOITER and boot_us - self._rc_lost_us >= _RC_LOSS_TO_RTL_US:
                self._enter(Mode.RTL)
            return
        alive = self._has_stream(boot_us)
        if self.failsafe and alive:
            self.failsafe = False
            self._enter(Mode.OFFBOARD)
        elif self.mode is Mode.OFFBOARD and not alive and (self.armed or self._is_113):
            self._offboard_lost()
        elif self.mode is Mode.OFFBOARD and self.armed and self._needs_rc():
            self._rc_lost_us = boot_us
            self._start_failsafe(Mode.LOITER, "Failsafe enabled: No manual control stick input")

    def _needs_rc(self) -> bool:
        return self._is_113 and not int(self._params["COM_RCL_EXCEPT"]) & _RCL_EXCEPT_OFFBOARD

    def _offboard_lost(self) -> None:
        if self._is_113:
            mode = _LOSS_ACTION_113.get(int(self._params["COM_OBL_ACT"]), Mode.LAND)
            self._start_failsafe(mode, "Failsafe enabled: no RC and no offboard")
        else:
            mode = _LOSS_ACTION_116.get(int(self._params["COM_OBL_RC_ACT"]), Mode.POSCTL)
            self._start_failsafe(mode, "Failsafe activated")

    def _start_failsafe(self, mode: Mode, text: str) -> None:
        self.failsafe = True
        if self.armed:
            self.texts.append((CRITICAL, text))
        if self._is_113:
            self.texts.append((INFO, "Failsafe mode activated"))
        self._enter(mode)


_HEALTH = "Arming denied: Resolve system health failures first"
_LOSS_ACTION_113 = {0: Mode.LAND, 1: Mode.LOITER, 2: Mode.RTL}
_LOSS_ACTION_116 = {0: Mode.POSCTL, 3: Mode.RTL, 4: Mode.LAND, 5: Mode.LOITER}
