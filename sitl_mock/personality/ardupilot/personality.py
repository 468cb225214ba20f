"""The ArduCopter personality: ArduPilot's dialogue, modes and telemetry around a vehicle."""

from __future__ import annotations

import math
from typing import Any

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import MockConfig
from sitl_mock.geometry import ZERO3, Vec4
from sitl_mock.personality import Sender
from sitl_mock.personality.ardupilot import attitude, guided, motors, telemetry
from sitl_mock.personality.ardupilot.boot import Boot
from sitl_mock.personality.ardupilot.commands import Commands
from sitl_mock.personality.ardupilot.copter import CRITICAL, INFO, Copter
from sitl_mock.personality.ardupilot.failsafe import Failsafes
from sitl_mock.personality.ardupilot.flight import LIFT_COMPENSATION, Demand, Flight, boosted
from sitl_mock.personality.ardupilot.missions import Mission
from sitl_mock.personality.ardupilot.modes import Mode
from sitl_mock.personality.ardupilot.navigation import Navigator
from sitl_mock.personality.ardupilot.parameters import Parameters
from sitl_mock.personality.ardupilot.picture import HOME_ALTITUDE_M, Picture, north_east
from sitl_mock.personality.ardupilot.streams import Streams
from sitl_mock.personality.mission import MissionServer
from sitl_mock.plant import VehicleState
from sitl_mock.port import Port
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate

_COMMANDS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE")
_PARAMETERS = ("PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET")
_SETPOINTS = ("SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT")
_TIMESYNC_EVERY_US = 10_002_664
_TEXT_LENGTH = 50
_BANNER = ("ArduCopter V4.7.0-dev (8fdb6a37)", "3d1219c7c4c5404aaa1f6d2a48adfda4", "Frame: QUAD/{frame}")
_TOUCH_DOWN_S = 0.8
"""While it lands, thrust fades away in this time after touch-down, as recorded."""
_CENTI = 100.0
_STICK_KEPT_US = 3_000_000


class ArduCopter:
    """ArduCopter's software: takes messages in, flies the vehicle's motors, and reports on its ports."""

    def __init__(self, config: MockConfig, script: Script, ports: tuple[Port, ...], estimate: Estimate) -> None:
        self._vehicle = vehicle = config.vehicle.params()
        self._system_id = config.system_id
        self._boot = Boot(config.ready_s)
        self._params = Parameters({"MAV_SYSID": float(config.system_id)})
        hover = 1.0 / vehicle.thrust_to_weight
        mission = Mission()
        self._flight = Flight(Navigator(hover, vehicle.gravity_m_s2, self._params), self._params, mission)
        self.copter = Copter(self._boot, self._params, self._flight, mission, hover)
        self._missions = MissionServer(config.system_id, mission)
        self._failsafes = Failsafes(self.copter, self._params)
        self._commands = Commands(config.system_id, self.copter, self._params, script, self)
        self._streams = {port: Streams(self._boot.at.heartbeat_us) for port in ports}
        self._timesync_us = _TIMESYNC_EVERY_US
        self._gains = attitude.rate_gains(vehicle)
        self._attitude = attitude.AttitudeState()
        self._rates_target = ZERO3
        self._demand: Demand | None = None
        self._was_position_control = False
        self._thrust_norm = 0.0
        self._outputs_us = (1000, 1000, 1000, 1000)
        self._estimate = estimate
        self._truth = VehicleState()
        self._now_us = 0
        self._requested: list[tuple[Port, int]] = []
        self._text_id = 0
        self._stick_us = 0

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
        return self.copter.crashed

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
        if kind in _SETPOINTS:
            self._take_setpoint(kind, message, boot_us)
        elif kind in _COMMANDS:
            self._obey(message, sender, port, boot_us)
        elif kind in _PARAMETERS:
            if message.target_system in (self._system_id, 0):
                self._answer_parameter(kind, message, port, boot_us)
        elif self._missions.handles(kind):
            self._missions.handle(message, sender, port, boot_us)
            if kind == "MISSION_SET_CURRENT":
                self._send_built(port, mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, self._picture(boot_us))
        elif kind == "TIMESYNC":
            if message.tc1 == 0:
                port.send(mavlink.MAVLink_timesync_message(boot_us * 1000, message.ts1))
        elif kind == "HEARTBEAT":
            self._failsafes.heard(sender, boot_us)
            if message.type == mavlink.MAV_TYPE_GCS:
                port.ground_station_us = boot_us
        elif kind == "REQUEST_DATA_STREAM":
            if message.target_system in (self._system_id, 0):
                rate_hz = message.req_message_rate if message.start_stop else 0
                self._streams[port].set_group_hz(message.req_stream_id, rate_hz, boot_us)
        elif kind == "RC_CHANNELS_OVERRIDE":
            self._take_stick(message, boot_us)
        self._send_news(boot_us)

    def _obey(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """The ACK goes out before what the command asks to be sent."""
        self._requested = []
        for ack in self._commands.answer(message, sender, port, boot_us):
            port.send(ack)
        for asked, message_id in self._requested:
            self._send_built(asked, message_id, self._picture(boot_us))

    def streams(self, port: Port) -> Streams:
        """The intervals in force on a port."""
        return self._streams[port]

    def request(self, port: Port, message_id: int) -> bool:
        """Send a message once, after the ACK; False if the mock has none of that id."""
        if message_id not in telemetry.BUILDERS:
            return False
        self._requested.append((port, message_id))
        return True

    def _answer_parameter(self, kind: str, message: Message, port: Port, boot_us: int) -> None:
        if kind == "PARAM_REQUEST_LIST":
            self._params.request_list(port, boot_us)
            frame = self._vehicle.frame.upper()
            self.copter.texts += [(INFO, text.format(frame=frame)) for text in _BANNER]
        elif kind == "PARAM_REQUEST_READ":
            self._params.request(message, port, boot_us)
        else:
            name = self._params.obey_set(message)
            if name is not None:
                for each in self._streams:
                    each.send(self._params.message(name))

    def _take_setpoint(self, kind: str, message: Message, boot_us: int) -> None:
        mode = self.copter.mode
        if message.target_system not in (self._system_id, 0) or not mode.is_guided:
            return
        setpoint: guided.AttitudeSetpoint | guided.KinematicSetpoint | guided.Rejected | None
        if kind == "SET_ATTITUDE_TARGET":
            setpoint, is_error = guided.attitude_setpoint(message)
            if is_error:
                self._complain()
        elif mode is not Mode.GUIDED:
            return
        else:
            setpoint = self._kinematic(kind, message)
        if isinstance(setpoint, guided.Rejected) and setpoint.is_lost:
            self._complain()
        if setpoint is not None:
            self._flight.take(setpoint, self._estimate, boot_us)

    def _kinematic(self, kind: str, message: Message) -> guided.KinematicSetpoint | guided.Rejected | None:
        if kind == "SET_POSITION_TARGET_LOCAL_NED":
            return guided.local_setpoint(message, self._estimate.position_ned_m, self._estimate.euler_rad[2])
        reference = guided.height_reference(message.coordinate_frame)
        if reference is None:
            return guided.Rejected()
        home_down_m = self.copter.home_ned_m[2]
        down_m = HOME_ALTITUDE_M - message.alt if reference == "msl" else home_down_m - message.alt
        return guided.global_setpoint(message, north_east(message.lat_int, message.lon_int), down_m)

    def _complain(self) -> None:
        text = (CRITICAL, "Internal Errors 0x400")
        if text not in self.copter.texts:
            self.copter.texts.append(text)

    def _take_stick(self, message: Message, boot_us: int) -> None:
        """The throttle channel of RC_CHANNELS_OVERRIDE; the other sticks do nothing here."""
        pulse_us = message.chan3_raw
        if message.target_system in (self._system_id, 0) and 800 <= pulse_us <= 2200:
            self._flight.throttle_stick = max(0.0, min(1.0, (pulse_us - 1000) / 1000))
            self._stick_us = boot_us

    # --- each tick ---------------------------------------------------------------------------------------------

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of modes and control; the motor commands until the next one."""
        self._now_us = boot_us
        self._truth, self._estimate = truth, estimate
        copter = self.copter
        if boot_us - self._stick_us > _STICK_KEPT_US:
            self._flight.throttle_stick = 0.0
        copter.step(truth, estimate, self._thrust_norm, boot_us)
        self._failsafes.step(estimate, boot_us)
        self._demand = copter.demand(estimate, boot_us, dt_s)
        if self._demand is None:
            return self._stand_idle(estimate, boot_us)
        return self._drive(self._demand, estimate, boot_us, dt_s)

    def _stand_idle(self, estimate: Estimate, boot_us: int) -> Vec4:
        self._attitude = attitude.AttitudeState(estimate.quaternion)
        self._rates_target, self._thrust_norm = ZERO3, 0.0
        since_s = (boot_us - self.copter.armed_us) / 1e6
        idle = motors.idle_pwm(since_s) if self.copter.armed else 1000
        self._outputs_us = (idle, idle, idle, idle)
        return (0.0, 0.0, 0.0, 0.0)

    def _drive(self, demand: Demand, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        params = self._params
        roll, pitch, yaw = (math.radians(params[f"ATC_ACCEL_{axis}_MAX"] / _CENTI) for axis in "RPY")
        shape = attitude.Shape((roll, pitch, yaw), params["ATC_INPUT_TC"])
        self._attitude = attitude.move_target(shape, self._attitude, demand.attitude, dt_s)
        if self._truth.on_ground:
            self._attitude = attitude.AttitudeState(self._attitude.target, self._attitude.target_rates_rad_s)
        is_rates = isinstance(demand.attitude, attitude.RatesInput)
        torque, self._rates_target, self._attitude = attitude.follow(
            self._gains, self._attitude, is_rates, estimate, dt_s
        )
        self._thrust_norm = demand.thrust_norm * self._fading(boot_us)
        lift = boosted(self._thrust_norm, self._attitude.target, bool(params["ATC_ANGLE_BOOST"]))
        given = motors.commands(self._vehicle, motors.mix(self._vehicle.frame, torque, lift))
        a, b, c, d = (motors.pwm(command) for command in given)
        self._outputs_us = (a, b, c, d)
        return given

    def _fading(self, boot_us: int) -> float:
        since_us = self.copter.touched_down_us
        if since_us is None or not self.copter.is_landing:
            return 1.0
        return max(0.0, 1.0 - (boot_us - since_us) / 1e6 / _TOUCH_DOWN_S)

    # --- messages out ------------------------------------------------------------------------------------------

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due."""
        picture = None
        self._params.step(boot_us)
        self._missions.step(boot_us)
        for port, streams in self._streams.items():
            for message_id in streams.due(boot_us, self._params.is_listing(port)):
                picture = picture or self._picture(boot_us)
                self._send_built(port, message_id, picture)
        if boot_us >= self._timesync_us:
            self._timesync_us += _TIMESYNC_EVERY_US
            for port in self._streams:
                port.send(telemetry.timesync(picture or self._picture(boot_us)))
        self._send_news(boot_us)
        self._was_position_control = self._is_position_control()

    def _send_news(self, boot_us: int) -> None:
        """What happened: a HEARTBEAT when the mode changed, home when it was set, texts."""
        copter, mission = self.copter, self.copter.mission
        if copter.mode_changed or copter.home_changed:
            self._was_position_control |= copter.mode_changed and copter.mode.holds_position
            picture = self._picture(boot_us)
            ids = [mavlink.MAVLINK_MSG_ID_HEARTBEAT] if copter.mode_changed else []
            ids += [mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, _HOME] if copter.home_changed else []
            copter.mode_changed = copter.home_changed = False
            for port in self._streams:
                for message_id in ids:
                    self._send_built(port, message_id, picture)
        for severity, text in (*copter.texts, *mission.texts):
            self._send_text(severity, text)
        copter.texts.clear()
        mission.texts.clear()
        for number in mission.reached:
            for port in self._streams:
                port.send(mavlink.MAVLink_mission_item_reached_message(number))
        mission.reached.clear()
        for name in copter.told:
            for port in self._streams:
                port.send(self._params.message(name))
        copter.told.clear()

    def _send_text(self, severity: int, text: str) -> None:
        """A text of more than 50 characters goes out in chunks of one id."""
        pieces = [text[at : at + _TEXT_LENGTH] for at in range(0, len(text), _TEXT_LENGTH)]
        if len(pieces) > 1:
            self._text_id += 1
        for number, piece in enumerate(pieces):
            message = mavlink.MAVLink_statustext_message(
                severity, piece.encode(), self._text_id if len(pieces) > 1 else 0, number
            )
            for port in self._streams:
                port.send(message)

    def _send_built(self, port: Port, message_id: int, picture: Picture) -> None:
        build = telemetry.BUILDERS.get(message_id)
        message = build(picture) if build is not None else None
        if message is not None:
            port.send(message)

    def _is_position_control(self) -> bool:
        if self._demand is not None:
            return self._demand.is_position_control
        return self.copter.mode.holds_position

    def _picture(self, boot_us: int) -> Picture:
        copter, flight = self.copter, self._flight
        is_ready_time = boot_us >= self._boot.at.ready_us
        is_position = self._was_position_control or not is_ready_time
        is_flying = self._demand is not None
        return Picture(
            boot_us,
            self._boot.at,
            self._truth,
            self._estimate,
            copter.mode,
            copter.armed,
            copter.is_ready(boot_us),
            self._landed_state(),
            self._status(boot_us),
            copter.home_ned_m,
            self._attitude.target,
            self._rates_target,
            self._thrust_norm / LIFT_COMPENSATION,
            self._outputs_us,
            flight.navigator.target_ned_m if is_flying and is_position else None,
            flight.navigator.velocity_ned_m_s,
            is_position,
            is_position or copter.mode is Mode.ALT_HOLD,
            self._failsafes.breaches,
            self._failsafes.is_outside,
            round(1000 + 1000 * flight.throttle_stick),
            (copter.mission.current, len(copter.mission.items)),
        )

    def _landed_state(self) -> int:
        if self.copter.landed:
            return int(mavlink.MAV_LANDED_STATE_ON_GROUND)
        if self._flight.is_taking_off:
            return int(mavlink.MAV_LANDED_STATE_TAKEOFF)
        landing = self.copter.is_landing
        return int(mavlink.MAV_LANDED_STATE_LANDING if landing else mavlink.MAV_LANDED_STATE_IN_AIR)

    def _status(self, boot_us: int) -> int:
        if boot_us < self._boot.at.ready_us:
            return int(mavlink.MAV_STATE_BOOT)
        if self.copter.in_failsafe:
            return int(mavlink.MAV_STATE_CRITICAL)
        return int(mavlink.MAV_STATE_STANDBY if self.copter.landed else mavlink.MAV_STATE_ACTIVE)


_HOME: int = mavlink.MAVLINK_MSG_ID_HOME_POSITION
