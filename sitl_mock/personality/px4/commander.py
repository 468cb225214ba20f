"""PX4's commander: the mode in force, arming, failsafes, the ends of modes.

What the pilot chose (`intended`) and what flies (`mode`) differ during a failsafe. Texts and results are PX4's, seen
on 1.13.3 and 1.16.2 or read in its source; only the texts about a crash are the mock's own.
"""

from __future__ import annotations

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.geodesy import Origin
from sitl_mock.geometry import ZERO3, Vec3
from sitl_mock.inner_loops import PositionSetpoint, Setpoint, TorqueSetpoint
from sitl_mock.personality.params import ParameterServer
from sitl_mock.personality.px4.arming import Arming
from sitl_mock.personality.px4.command import Params
from sitl_mock.personality.px4.failsafe import Failsafe, Situation, battery_level
from sitl_mock.personality.px4.failsafe_1_13 import Failsafe113
from sitl_mock.personality.px4.failsafe_1_14 import Failsafe114
from sitl_mock.personality.px4.guidance import Guidance
from sitl_mock.personality.px4.landing_detector import LandingDetector
from sitl_mock.personality.px4.links import Links
from sitl_mock.personality.px4.manual import Sticks, sticks_of
from sitl_mock.personality.px4.mission_plan import MissionPlan
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.offboard import OffboardInput
from sitl_mock.personality.px4.settings import Settings
from sitl_mock.personality.px4.view import IDLE, View
from sitl_mock.plant import VehicleState
from sitl_mock.sensors import Estimate

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
INFO: int = mavlink.MAV_SEVERITY_INFO
CRITICAL: int = mavlink.MAV_SEVERITY_CRITICAL

_UNFIT: int = mavlink.MAV_STATE_UNINIT
_STANDBY: int = mavlink.MAV_STATE_STANDBY
_ACTIVE: int = mavlink.MAV_STATE_ACTIVE
_FAILSAFE: int = mavlink.MAV_STATE_CRITICAL
_TERMINATED: int = mavlink.MAV_STATE_FLIGHT_TERMINATION

_OFFBOARD = Mode.OFFBOARD
_SPOOL_UP_US = 1_000_000
_TICK_S = 0.004
_OVERRIDES_AUTO, _OVERRIDES_OFFBOARD = 1, 2


class Commander:
    """Armed or not, which mode, landed or not: `arming` and `ground` know more of the first and the last.

    `texts` collects (severity, STATUSTEXT) until they are sent, `broadcasts` commands to other components.
    """

    def __init__(
        self,
        firmware: Px4Release,
        params: ParameterServer,
        offboard: OffboardInput,
        hover_thrust_norm: float,
        ready_us: int,
        origin: Origin,
        estimate: Estimate,
    ) -> None:
        self.firmware = firmware
        self.is_113 = firmware == "1.13"
        self._params = params
        self._offboard = offboard
        self.texts: list[tuple[int, str]] = []
        self.broadcasts: list[tuple[int, Params]] = []
        self.settings = Settings.read(params)
        self.ground = LandingDetector(hover_thrust_norm)
        self.arming = Arming(self.is_113, self.ground, ready_us)
        self._failsafe: Failsafe = Failsafe113(self.say) if self.is_113 else Failsafe114(self.say, firmware == "1.17")
        self.links = Links(self.say, self.is_113)
        self.mission = MissionPlan(self.say)
        self.guidance = Guidance(hover_thrust_norm, self.mission, origin, self.say)
        self.mode = Mode.LOITER
        self.intended = Mode.LOITER
        self.failsafe = False
        self.terminated = False
        self.home_ned_m: Vec3 = ZERO3
        self.is_fence_breached = False
        self._after_flight = Mode.LOITER
        self._weighs_now = False
        self._estimate = estimate
        self._truth = VehicleState()

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self.arming.armed

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self.ground.landed

    @property
    def crashed(self) -> bool:
        """Whether it came down hard or on its back."""
        return self.ground.crashed

    @property
    def position_ned_m(self) -> Vec3:
        """Where it believes to be."""
        return self._estimate.position_ned_m

    def is_ready(self, boot_us: int) -> bool:
        """Whether the preflight checks pass (SYS_STATUS PREARM_CHECK); they run while disarmed."""
        can_run = self.armed or self._can_arm_in(self.intended, boot_us)
        return self.arming.is_ready(self.mode, can_run, boot_us)

    def is_torque_control(self) -> bool:
        """Whether SET_ACTUATOR_CONTROL_TARGET is in force, past the attitude and the rate controller."""
        return self.mode is Mode.OFFBOARD and isinstance(self._offboard.setpoint, TorqueSetpoint)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT."""
        self.texts.append((severity, text))

    def reread_parameters(self) -> None:
        """A parameter has been set."""
        self.settings = Settings.read(self._params)

    # --- what commands ask -------------------------------------------------------------------------------------

    def arm(self, boot_us: int, by: str = "external command") -> int:
        """MAV_RESULT of an arming request."""
        if self.armed:
            return ACCEPTED
        is_unmanned = self.is_113 and self.mode.needs_sticks and not self.links.has_sticks
        reason = self.arming.denied(self.mode, self._can_arm_in(self.intended, boot_us), boot_us)
        reason = reason or ("Arming denied! manual control lost" if is_unmanned else "")
        if reason:
            self.say(CRITICAL, reason)
            return TEMPORARILY_REJECTED
        self.arming.arm(boot_us)
        self.home_ned_m = self._estimate.position_ned_m
        self._enter(self.mode, boot_us)
        self.say(INFO, f"Armed by {by}")
        return ACCEPTED

    def disarm(self, forced: bool) -> int:
        """MAV_RESULT of a disarming request; in the air only by force."""
        if self.armed and not self.landed and not forced:
            self.say(CRITICAL, f"Disarming denied{'! Not' if self.is_113 else ': not'} landed")
            return TEMPORARILY_REJECTED
        if self.armed:
            self._disarm("Disarmed by external command")
        return ACCEPTED

    def request(self, mode: Mode, boot_us: int, explain: bool = True) -> int:
        """MAV_RESULT of a mode request; `explain` whether 1.14 and later say what they refuse."""
        may_wait = not self.is_113 and not self.armed
        if not may_wait and not self._may_switch_to(mode, boot_us):
            if not self.is_113 and explain:
                self.say(CRITICAL, f"Switching to {mode.spoken} is currently not available")
            return TEMPORARILY_REJECTED
        self.select(mode, boot_us)
        return ACCEPTED

    def select(self, mode: Mode, boot_us: int) -> None:
        """Fly this mode from now on, as the pilot's choice."""
        self._failsafe.pilot_chose()
        self.failsafe = self.failsafe and self.is_113
        self.intended = mode
        if not mode.prevents_arming:
            self._after_flight = mode
        self._enter(mode, boot_us)

    def can_run(self, mode: Mode, boot_us: int) -> bool:
        """Whether there is what the mode needs: setpoints, a mission, a pilot."""
        if mode is Mode.OFFBOARD:
            return self._has_stream(boot_us)
        if mode is Mode.MISSION:
            return self.mission.is_valid
        return self.links.has_sticks or not mode.needs_sticks

    def _may_switch_to(self, mode: Mode, boot_us: int) -> bool:
        """1.13 lets a pilot's mode begin without a pilot, and its failsafe takes over at once."""
        return (self.is_113 and mode.needs_sticks) or self.can_run(mode, boot_us)

    def _can_arm_in(self, mode: Mode, boot_us: int) -> bool:
        has_link = self.links.has_ground_station or self.settings.nav_dll_act == 0
        return has_link and self.can_run(mode, boot_us)

    def system_status(self, boot_us: int) -> int:
        """HEARTBEAT.system_status (MAV_STATE)."""
        if self.terminated:
            return _TERMINATED
        if self.armed:
            return _FAILSAFE if self.failsafe else _ACTIVE
        return _STANDBY if self.is_113 or self.is_ready(boot_us) else _UNFIT

    def breach_geofence(self) -> None:
        """It is found outside its geofence, and stays so until it is disarmed."""
        if self.armed and not self.is_fence_breached:
            self.say(CRITICAL, "Geofence exceeded")
            self.is_fence_breached = True

    def terminate(self) -> None:
        """Stop the motors for good."""
        self.terminated = True
        self.say(CRITICAL, "Flight termination active")

    def restore(self) -> None:
        """End a termination, as 1.13 allows."""
        self.terminated = False

    def take_sticks(self, message: Message, boot_us: int) -> None:
        """MANUAL_CONTROL: the pilot's sticks; moved far enough they take over from the autopilot's own modes."""
        self.links.sticks_heard(boot_us)
        sticks = self.guidance.sticks = sticks_of(message)
        overrides = self.settings.com_rc_override
        bit = _OVERRIDES_OFFBOARD if self.intended is Mode.OFFBOARD else _OVERRIDES_AUTO
        if sticks.wants_control and overrides & bit and not self.intended.needs_sticks and not self.landed:
            self.say(INFO, f"Pilot took over{' position control' if self.is_113 else ''} using sticks")
            self.select(Mode.POSCTL, boot_us)

    def pilot_selects(self, mode: Mode, boot_us: int) -> None:
        """A pilot with a transmitter moves its mode switch; his sticks are centred."""
        self.links.transmitter_found()
        self.guidance.sticks = self.guidance.sticks or Sticks()
        self.select(mode, boot_us)

    def view(self, boot_us: int, dt_s: float = _TICK_S) -> View:
        """What the modes see now."""
        truth = self._truth
        return View(
            self._estimate,
            truth.on_ground,
            self.landed,
            -truth.position_ned_m[2],
            self.home_ned_m,
            self.settings,
            self.arming.armed_us,
            boot_us,
            dt_s,
        )

    # --- each tick ---------------------------------------------------------------------------------------------

    def step(self, truth: VehicleState, estimate: Estimate, thrust_norm: float, boot_us: int) -> None:
        """Watch the ground, the links and the ends of the modes; `thrust_norm` is the thrust in force."""
        self._truth, self._estimate = truth, estimate
        arming, ground = self.arming, self.ground
        was_crashed = ground.crashed
        text = ground.step(truth, arming.armed, thrust_norm, boot_us)
        if text:
            self.say(INFO, text)
        if ground.crashed and not was_crashed:
            self._crash()
        self.links.step(self.settings, boot_us)
        if not self.links.has_sticks:
            self.guidance.sticks = None
        if arming.armed and ground.landed:
            reason = arming.disarms_itself(self.settings, boot_us)
            if reason:
                self._disarm(f"Disarmed by {reason}")
        self._weighs_now = not self._weighs_now
        if self._weighs_now and (arming.armed or self.failsafe or self.mode is _OFFBOARD):
            self._weigh(boot_us)
        if arming.armed and self.mode is not _OFFBOARD:
            self._end_mode(boot_us)

    def setpoint(self, boot_us: int, dt_s: float) -> Setpoint:
        """What the inner loops are to follow until the next tick."""
        if not self.arming.armed or self.terminated:
            return IDLE
        if self.mode is not _OFFBOARD:
            return self.guidance.setpoint(self.view(boot_us, dt_s))
        given = self._offboard.next_setpoint()
        if self.ground.landed and isinstance(given, PositionSetpoint) and boot_us - self.arming.armed_us < _SPOOL_UP_US:
            return IDLE
        return given or IDLE

    def _weigh(self, boot_us: int) -> None:
        """Decide what is flown, every other tick."""
        decision = self._failsafe.step(self._situation(boot_us))
        self.failsafe = decision.is_failsafe
        self.intended = decision.intended
        if decision.terminate and not self.terminated:
            self.terminate()
        if decision.disarm and self.armed:
            self._disarm("Disarmed by failsafe")
        elif decision.mode is not self.mode:
            self._enter(decision.mode, boot_us)

    def _situation(self, boot_us: int) -> Situation:
        links = self.links
        return Situation(
            self.intended,
            self.mode,
            self.arming.armed,
            self.ground.landed,
            self._has_stream(boot_us),
            links.has_sticks,
            links.had_sticks,
            links.has_ground_station,
            battery_level(self._estimate.battery, self.settings),
            self.is_fence_breached,
            self.guidance.mission.is_over,
            self.settings,
            boot_us,
        )

    def _end_mode(self, boot_us: int) -> None:
        """What comes after a takeoff, and what a mission asks for."""
        if self.mode in (Mode.TAKEOFF, Mode.VTOL_TAKEOFF) and self.guidance.takeoff.done:
            self.mode = self.intended = self._after_flight = Mode.LOITER
            view, takeoff = self.view(boot_us), self.guidance.takeoff
            self.guidance.enter(Mode.LOITER, view)
            self.guidance.hold.go_to(takeoff.target_ned_m, takeoff.target_yaw_rad, view)
        elif self.mode is Mode.MISSION:
            mission = self.guidance.mission
            if mission.home_ned_m is not None:
                self.home_ned_m, mission.home_ned_m = mission.home_ned_m, None
            if mission.asks_return:
                self.say(INFO, "Returning to launch")
                self.select(Mode.RTL, boot_us)

    def _has_stream(self, boot_us: int) -> bool:
        return self._offboard.is_alive(boot_us, self.settings.com_of_loss_t)

    def _enter(self, mode: Mode, boot_us: int) -> None:
        self.mode = mode
        if self.armed or mode is not Mode.MISSION:  # a mission begins once it is armed
            self.guidance.enter(mode, self.view(boot_us))

    def _disarm(self, text: str) -> None:
        self.arming.armed = False
        self.terminated = self.is_fence_breached = False
        self.say(INFO, text)
        if not self.is_113:
            self.intended = self.mode = self._after_flight
            self.failsafe = False

    def _crash(self) -> None:
        self.say(CRITICAL, "Crash detected: motors stopped")
        if self.armed:
            self._disarm("Disarmed by crash")
