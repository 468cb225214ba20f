"""The ArduCopter personality: ArduPilot's dialogue, modes and telemetry around a vehicle."""

from __future__ import annotations

from typing import Any

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import MockConfig
from sitl_mock.geometry import Vec4
from sitl_mock.personality import Sender
from sitl_mock.personality.ardupilot.boot import Boot
from sitl_mock.personality.ardupilot.commands import Commands
from sitl_mock.personality.ardupilot.control import Control
from sitl_mock.personality.ardupilot.copter import Copter
from sitl_mock.personality.ardupilot.demand import Demand
from sitl_mock.personality.ardupilot.failsafe import Failsafes
from sitl_mock.personality.ardupilot.flight import Flight
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.news import INFO, WARNING, News
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.ardupilot.picture import Picture
from sitl_mock.personality.ardupilot.reporter import Reporter
from sitl_mock.personality.ardupilot.setpoints import PLACES, SETPOINTS, Setpoints
from sitl_mock.personality.mission import MissionServer
from sitl_mock.plant import VehicleState
from sitl_mock.port import Port
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate

_COMMANDS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE")
_PARAMETERS = ("PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET")
_ITEMS = ("MISSION_ITEM", "MISSION_ITEM_INT")
_ADDRESSED = (*SETPOINTS, *_PARAMETERS, "REQUEST_DATA_STREAM", "RC_CHANNELS_OVERRIDE")
"""Messages that are looked at only if they are for this system, or for all."""
_OLD_KINDS = {
    "MISSION_ITEM": "got MISSION_ITEM; GCS should send MISSION_ITEM_INT",
    "MISSION_REQUEST": "got MISSION_REQUEST; use MISSION_REQUEST_INT!",
}
_ASK_FOR_INT_EVERY_US = 60_000_000
_BANNER = ("ArduCopter V4.7.0-dev (8fdb6a37)", "3d1219c7c4c5404aaa1f6d2a48adfda4", "Frame: QUAD/{frame}")


class ArduCopter:
    """ArduCopter's software: takes messages in, flies the vehicle's motors, and reports on its ports."""

    def __init__(self, config: MockConfig, script: Script, ports: tuple[Port, ...], estimate: Estimate) -> None:
        vehicle = config.vehicle.params()
        self._frame = vehicle.frame
        self._system_id = config.system_id
        self._boot = Boot(config.ready_s)
        self._params = params = Parameters({"MAV_SYSID": float(config.system_id)})
        mission, hover = Mission(), 1.0 / vehicle.thrust_to_weight
        self._flight = Flight(Navigator(hover, vehicle.gravity_m_s2, params), params, mission)
        news = News(self._boot, params)
        self.copter = Copter(self._boot, params, self._flight, mission, news, hover)
        self._setpoints = Setpoints(self.copter)
        self._missions = MissionServer(config.system_id, mission, in_order=False)
        self._failsafes = Failsafes(self.copter, params)
        self._reporter = Reporter(ports, params, self._boot.at.heartbeat_us, self._picture)
        self._commands = Commands(config.system_id, self.copter, params, script, self._reporter)
        self._control = Control(vehicle, params)
        self._demand: Demand | None = None
        self._was_position_control = False
        self._truth, self._estimate = VehicleState(), estimate
        self._now_us = 0
        self._ask_for_int_us: dict[str, int] = {}

    @property
    def mode(self) -> str:
        """ArduCopter's name of the mode in force, e.g. GUIDED."""
        return self.copter.mode.name

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self.copter.armed

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self.copter.landed

    @property
    def crashed(self) -> bool:
        """Whether it came down hard or on its back."""
        return self.copter.ground.crashed

    @property
    def stored_parameters(self) -> dict[str, Any]:
        """The values of its parameters, by name; they outlive a reboot."""
        return self._params.stored

    def pilot_selects(self, mode: str) -> None:
        """The pilot moves the mode switch; `mode` is one of ArduCopter's names."""
        self.copter.select(Mode[mode], self._now_us)

    def breach_geofence(self) -> None:
        """The vehicle is found outside its geofence."""
        self._failsafes.breach(self._now_us)

    # --- messages in -------------------------------------------------------------------------------------------

    def handle(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """React to one message from `sender` (system, component)."""
        self._now_us = boot_us
        kind = message.get_type()
        if kind in _ADDRESSED:
            if message.target_system in (self._system_id, 0):
                self._take(kind, message, port, boot_us)
        elif kind in _COMMANDS:
            for ack in self._commands.answer(message, sender, port, boot_us):
                port.send(ack)
            self._reporter.send_requested(boot_us)
        elif kind in _ITEMS and message.current in PLACES:
            if message.target_system in (self._system_id, 0):
                is_taken = self._setpoints.take_place(message, self._estimate, boot_us)
                result = mavlink.MAV_MISSION_ACCEPTED if is_taken else mavlink.MAV_MISSION_ERROR
                port.send(mavlink.MAVLink_mission_ack_message(*sender, result, 0))
        elif self._missions.handles(kind):
            self._missions.handle(message, sender, port, boot_us)
            self._ask_for_int(kind, boot_us)
            if kind == "MISSION_SET_CURRENT":
                self._reporter.request(port, mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
                self._reporter.send_requested(boot_us)
        elif kind == "TIMESYNC":
            if message.tc1 == 0:
                port.send(mavlink.MAVLink_timesync_message(boot_us * 1000, message.ts1))
        elif kind == "HEARTBEAT":
            self._failsafes.heard(sender, boot_us)
            if message.type == mavlink.MAV_TYPE_GCS:
                port.ground_station_us = boot_us
        self._send_news(boot_us)

    def _ask_for_int(self, kind: str, boot_us: int) -> None:
        """Once in a while: that the kinds with whole numbers are the better ones."""
        text = _OLD_KINDS.get(kind)
        if text is not None and boot_us >= self._ask_for_int_us.get(kind, 0):
            self._ask_for_int_us[kind] = boot_us + _ASK_FOR_INT_EVERY_US
            self.copter.news.say(WARNING, text)

    def _take(self, kind: str, message: Message, port: Port, boot_us: int) -> None:
        if kind in SETPOINTS:
            self._setpoints.take(message, self._estimate, boot_us)
        elif kind == "RC_CHANNELS_OVERRIDE":
            self._setpoints.take_sticks(message, boot_us)
        elif kind == "REQUEST_DATA_STREAM":
            rate_hz = message.req_message_rate if message.start_stop else 0
            self._reporter.set_group(port, message.req_stream_id, rate_hz, boot_us)
        elif kind == "PARAM_REQUEST_LIST":
            self._params.request_list(port, boot_us)
            for text in _BANNER:
                self.copter.news.say(INFO, text.format(frame=self._frame.upper()))
        elif kind == "PARAM_REQUEST_READ":
            self._params.request(message, port, boot_us)
        else:
            name = self._params.obey_set(message)
            if name is not None:
                self._reporter.parameter_set(name, boot_us)
                self._reporter.send_everywhere(self._params.message(name))

    # --- each tick ---------------------------------------------------------------------------------------------

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of modes and control; the motor commands until the next one."""
        self._now_us = boot_us
        self._truth, self._estimate = truth, estimate
        copter, control = self.copter, self._control
        self._setpoints.step(boot_us)
        copter.step(truth, estimate, control.lift_norm, boot_us)
        self._failsafes.step(estimate, boot_us)
        self._demand = demand = copter.demand(estimate, boot_us, dt_s)
        if demand is None:
            return control.stand_idle((boot_us - copter.armed_us) / 1e6 if copter.armed else None, estimate)
        share = copter.ground.thrust_share(boot_us) if copter.is_landing else 1.0
        return control.drive(demand, share, truth.on_ground, estimate, dt_s)

    # --- messages out ------------------------------------------------------------------------------------------

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due."""
        self._missions.step(boot_us)
        self._reporter.send_due(boot_us)
        self._send_news(boot_us)
        demand = self._demand
        self._was_position_control = self._holds_on_ground() if demand is None else demand.is_position_control

    def _send_news(self, boot_us: int) -> None:
        copter = self.copter
        self._was_position_control |= copter.news.mode_changed and copter.mode.holds_position
        self._reporter.send_news(copter.news, copter.mission, boot_us)

    def _picture(self, boot_us: int) -> Picture:
        copter, control, navigator = self.copter, self._control, self._flight.navigator
        is_position = self._was_position_control or boot_us < self._boot.at.ready_us
        is_steered = is_position and self._demand is not None
        return Picture(
            boot_us,
            self._boot.at,
            self._truth,
            self._estimate,
            copter.mode,
            copter.armed,
            not copter.complaints(boot_us),
            self._landed_state(),
            self._status(boot_us),
            copter.home_ned_m,
            control.target,
            control.rates_target_rad_s,
            control.thrust_norm,
            control.outputs_us,
            navigator.target_ned_m if is_steered else None,
            navigator.velocity_ned_m_s,
            is_position,
            is_position or copter.mode is Mode.ALT_HOLD,
            self._failsafes.breaches,
            self._failsafes.is_outside,
            round(1000 + 1000 * self._flight.throttle_stick),
            (copter.mission.current, len(copter.mission.items), copter.mission.state, int(copter.mode is Mode.AUTO)),
        )

    def _holds_on_ground(self) -> bool:
        """As seen: a vehicle that has returned and is disarmed steers to nowhere any more."""
        copter = self.copter
        has_returned = copter.mode is Mode.RTL or (copter.mode is Mode.AUTO and copter.mission.is_over)
        return copter.mode.holds_position and (copter.armed or not has_returned)

    def _landed_state(self) -> int:
        copter = self.copter
        if copter.landed or not copter.armed:
            return int(mavlink.MAV_LANDED_STATE_ON_GROUND)
        if self._flight.is_taking_off(copter.mode):
            return int(mavlink.MAV_LANDED_STATE_TAKEOFF)
        return int(mavlink.MAV_LANDED_STATE_LANDING if copter.is_landing else mavlink.MAV_LANDED_STATE_IN_AIR)

    def _status(self, boot_us: int) -> int:
        if boot_us < self._boot.at.ready_us:
            return int(mavlink.MAV_STATE_BOOT)
        if self.copter.in_failsafe:
            return int(mavlink.MAV_STATE_CRITICAL)
        is_idle = self.copter.landed or not self.copter.armed
        return int(mavlink.MAV_STATE_STANDBY if is_idle else mavlink.MAV_STATE_ACTIVE)
