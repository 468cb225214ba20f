"""The PX4 personality: PX4's dialogue, modes and telemetry around a vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mavquad.protocol.codec import Message, mavlink
from sitl_mock import inner_loops
from sitl_mock.config import MockConfig
from sitl_mock.geometry import ZERO3, Vec4
from sitl_mock.mixer import mix
from sitl_mock.personality import Sender
from sitl_mock.personality.mission import MissionServer
from sitl_mock.personality.params import ParameterServer
from sitl_mock.personality.px4.commander import Commander
from sitl_mock.personality.px4.commands import Commands
from sitl_mock.personality.px4.defaults import burst_us, px4_parameters
from sitl_mock.personality.px4.mission_reports import MissionReports
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.offboard import OffboardInput
from sitl_mock.personality.px4.picture import Home, Picture
from sitl_mock.personality.px4.readings import Readings
from sitl_mock.personality.px4.reporter import Reporter
from sitl_mock.personality.px4.sites import ORIGINS
from sitl_mock.personality.px4.texts import Texts
from sitl_mock.plant import VehicleState
from sitl_mock.port import AUTOPILOT_COMPONENT, Port
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate

_OFF: Vec4 = (0.0, 0.0, 0.0, 0.0)
_MISSION = Mode.MISSION


class Px4:
    """PX4's software: takes messages in, flies the vehicle's motors, and reports on its ports."""

    def __init__(self, config: MockConfig, script: Script, ports: tuple[Port, ...], estimate: Estimate) -> None:
        vehicle = config.vehicle.params()
        self._frame = vehicle.frame
        self._config = config
        self._hover = (vehicle.hover_thrust_norm, vehicle.gravity_m_s2)
        self._loops = inner_loops.LoopState()
        release = config.px4_release
        self._ports = ports
        self._origin = ORIGINS[release]
        parameters = px4_parameters(release, config.system_id, config.com_rcl_except, vehicle)
        self._params = ParameterServer(parameters, ports, burst_us(release))
        if not self._params["MAV_PROTO_VER"]:
            for port in ports:
                port.begin_with(1)
        self._reporter = Reporter(release, ports, config.streams, estimate)
        self._setpoint: inner_loops.Setpoint | None = None
        self._offboard = OffboardInput(release, self._origin, is_lockstep_build=config.lockstep_build)
        commander = self.commander = Commander(
            release,
            self._params,
            self._offboard,
            vehicle.hover_thrust_norm,
            round(config.ready_s * 1e6),
            self._origin,
            estimate,
        )
        self._gains = self._read_gains()
        self._reads_parameters = False
        self._commands = Commands(
            release,
            config.system_id,
            commander,
            script,
            self._origin,
            self._send_by_id,
            self._reporter.set_interval,
            self._reporter.send_interval,
        )
        self._missions = MissionServer(config.system_id, commander.mission)
        self._mission_reports = MissionReports(commander.mission, commander.guidance.mission, ports, commander.is_113)
        self._texts = Texts(ports, commander.texts)
        self._boot_us = 0
        self._handlers = self._all_handlers()
        self._estimate = estimate
        self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
        self._attitude_thrust_norm = 0.0
        self._motors = _OFF
        self._picture = self._first_picture()

    @property
    def mode(self) -> str:
        """PX4's name of the mode in force, e.g. AUTO.LOITER."""
        return self.commander.mode.value

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self.commander.armed

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self.commander.landed

    @property
    def crashed(self) -> bool:
        """Whether it came down hard or on its back."""
        return self.commander.crashed

    @property
    def stored_parameters(self) -> dict[str, Any]:
        """The values of its parameters, by name; they outlive a reboot."""
        self._reads_parameters = True
        return self._params.stored

    def pilot_selects(self, mode: str) -> None:
        """The pilot moves the mode switch."""
        self.commander.pilot_selects(Mode(mode), self._boot_us)

    def breach_geofence(self) -> None:
        """It is found outside its geofence; GF_ACTION says what it does."""
        self.commander.breach_geofence()

    # --- messages --------------------------------------------------------------------------------------------------

    def handle(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """React to one message from `sender` (system, component)."""
        handler = self._handlers.get(message.get_type())
        if handler is not None:
            handler(message, sender, port, boot_us)
            self._texts.send(boot_us)

    def _all_handlers(self) -> dict[str, Callable[[Message, Sender, Port, int], None]]:
        """What is done with each kind of message; the others are ignored."""
        return {
            **dict.fromkeys(OffboardInput.MESSAGES, self._take_setpoint),
            **dict.fromkeys(("COMMAND_LONG", "COMMAND_INT", "SET_MODE"), self._take_command),
            **dict.fromkeys(("PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET"), self._take_parameter),
            **dict.fromkeys(MissionServer.MESSAGES, self._missions.handle),
            "MANUAL_CONTROL": self._take_sticks,
            "TIMESYNC": self._answer_timesync,
            "PING": self._answer_ping,
            "HEARTBEAT": self._take_heartbeat,
        }

    def _take_command(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        for ack in self._commands.answer(message, sender, port, boot_us):
            port.send(ack)

    def _take_parameter(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if not self._is_for_us(message):
            return
        for value in self._params.answer(message, port, boot_us):
            port.send(value)
        if message.get_type() == "PARAM_SET":
            self._read_parameters()

    def _take_setpoint(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if not self._is_for_us(message, allow_broadcast=True):
            return
        self._offboard.home_altitude_m = self._origin.altitude_m - self.commander.home_ned_m[2]
        self._offboard.take(message, self._estimate.euler_rad[2], boot_us)
        if self._offboard.warning:
            self.commander.say(mavlink.MAV_SEVERITY_CRITICAL, self._offboard.warning)

    def _take_sticks(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if message.target == self._config.system_id:
            self.commander.take_sticks(message, boot_us)

    def _take_heartbeat(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if message.type == mavlink.MAV_TYPE_GCS:
            port.ground_station_us = boot_us
            self.commander.links.ground_station_heard(boot_us)

    def _answer_timesync(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if message.tc1 == 0:
            port.send(mavlink.MAVLink_timesync_message(boot_us * 1000, message.ts1))

    def _answer_ping(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        if message.target_system == 0 and message.target_component == 0:
            port.send(mavlink.MAVLink_ping_message(message.time_usec, message.seq, *sender))

    def _is_for_us(self, message: Message, allow_broadcast: bool = False) -> bool:
        systems = (self._config.system_id, 0) if allow_broadcast else (self._config.system_id,)
        return message.target_system in systems and message.target_component in (0, AUTOPILOT_COMPONENT)

    # --- each tick -------------------------------------------------------------------------------------------------

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of commander and inner loops; the motor commands until the next one."""
        self._estimate, self._boot_us = estimate, boot_us
        if self._reads_parameters:
            self._read_parameters()
        commander = self.commander
        commander.step(truth, estimate, self._controls.thrust_norm, boot_us)
        if not commander.arming.armed or commander.terminated:
            self._loops = inner_loops.LoopState(attitude_target=estimate.quaternion)
            self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
            self._attitude_thrust_norm = 0.0
            self._motors = _OFF
            self._setpoint = None
            return self._motors
        if truth.on_ground:
            self._loops = inner_loops.LoopState(attitude_target=self._loops.attitude_target)
        setpoint = self._setpoint = commander.setpoint(boot_us, dt_s)
        before = self._controls
        controls, self._loops = inner_loops.step(self._gains, self._loops, setpoint, estimate, dt_s)
        self._controls = controls
        if not isinstance(setpoint, inner_loops.RatesSetpoint):
            self._attitude_thrust_norm = controls.thrust_norm
        if controls is not before:
            self._motors = mix(*controls.torque_frd_norm, controls.thrust_norm, self._frame)
        return self._motors

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due."""
        commander, reporter = self.commander, self._reporter
        if boot_us >= reporter.publishes_us:
            reporter.publish(self._estimate, boot_us)
        if boot_us >= reporter.next_us:
            reporter.report(boot_us, self._draw)
        if boot_us >= self._params.next_us:
            self._params.send_due(boot_us)
        if self._missions.transfers:
            self._missions.step(boot_us)
        if commander.broadcasts:
            self._broadcast()
        self._mission_reports.step(commander.mode is _MISSION, boot_us)
        if commander.texts:
            self._texts.send(boot_us)

    def _broadcast(self) -> None:
        for command, params in self.commander.broadcasts:
            for port in self._ports:
                port.send(mavlink.MAVLink_command_long_message(self._config.system_id, 0, command, 0, *params))
        self.commander.broadcasts.clear()

    def _read_parameters(self) -> None:
        self._reads_parameters = False
        self.commander.reread_parameters()
        self._gains = self._read_gains()

    def _read_gains(self) -> inner_loops.Gains:
        """The inner loops' gains and limits, as the parameters have them."""
        settings = self.commander.settings
        rates = (settings.mc_rollrate_max, settings.mc_pitchrate_max, settings.mc_yawrate_max)
        roll, pitch, yaw = map(math.radians, rates)
        fastest = settings.mpc_xy_vel_max
        return inner_loops.Gains(
            *self._hover,
            speed_max_m_s=(fastest, fastest, settings.mpc_z_vel_max_dn),
            climb_max_m_s=settings.mpc_z_vel_max_up,
            rates_max_rad_s=(roll, pitch, yaw),
            tilt_max_rad=math.radians(settings.mpc_tiltmax_air),
        )

    def _first_picture(self) -> Picture:
        commander = self.commander
        return Picture(
            firmware=self._config.px4_release,
            boot_us=0,
            unix_us=0,
            estimate=self._estimate,
            position=self._estimate,
            mode=commander.mode,
            armed=False,
            landed=True,
            home=Home(ZERO3, self._estimate.euler_rad[2], 0),
            attitude_target=self._loops.attitude_target,
            rates_target_rad_s=ZERO3,
            attitude_thrust_norm=0.0,
            motor_commands=None,
            gains=self._gains,
            controls=self._controls,
            followed=None,
            origin=self._origin,
            readings=Readings(
                self._config.px4_release,
                self._origin,
                self._estimate,
                self._config.sensors.accelerometer_noise_m_s2,
            ),
            system_status=commander.system_status,
            is_ready=commander.is_ready,
            is_torque_control=commander.is_torque_control,
            mission_current=self._mission_reports.current,
        )

    def _draw(self, boot_us: int) -> Picture:
        """All that the telemetry of this tick tells."""
        picture, commander, loops, setpoint = self._picture, self.commander, self._loops, self._setpoint
        picture.boot_us = boot_us
        picture.unix_us = self._ports[0].now_us
        picture.estimate = self._estimate
        picture.position = self._reporter.position
        picture.mode = commander.mode
        picture.armed = armed = commander.arming.armed
        picture.landed = commander.ground.landed
        if commander.home_ned_m != picture.home.position_ned_m:
            picture.home = Home(commander.home_ned_m, self._estimate.euler_rad[2], boot_us)
        picture.attitude_target = loops.attitude_target
        picture.rates_target_rad_s = loops.rates_target_rad_s
        picture.attitude_thrust_norm = self._attitude_thrust_norm
        picture.motor_commands = self._motors if armed else None
        picture.gains = self._gains
        picture.controls = self._controls
        picture.followed = setpoint if isinstance(setpoint, inner_loops.PositionSetpoint) else None
        return picture

    def _send_by_id(self, port: Port, message_id: int, boot_us: int) -> bool:
        return self._reporter.send(port, message_id, self._draw(boot_us))
