"""The PX4 personality: PX4's dialogue, modes and telemetry around a vehicle."""

from __future__ import annotations

from functools import partial
from typing import Any

from mavquad.protocol.codec import Message, mavlink
from sitl_mock import inner_loops
from sitl_mock.config import MockConfig
from sitl_mock.geometry import ZERO3, Vec4
from sitl_mock.mixer import mix
from sitl_mock.personality import Sender
from sitl_mock.personality.params import ParameterServer
from sitl_mock.personality.px4 import telemetry
from sitl_mock.personality.px4.commander import Commander
from sitl_mock.personality.px4.commands import Commands
from sitl_mock.personality.px4.defaults import burst_us, px4_parameters
from sitl_mock.personality.px4.modes import Mode
from sitl_mock.personality.px4.offboard import OffboardInput
from sitl_mock.personality.px4.picture import Home, Picture
from sitl_mock.personality.px4.readings import Readings
from sitl_mock.personality.px4.reporter import Reporter
from sitl_mock.personality.px4.sites import ORIGINS
from sitl_mock.plant import VehicleState
from sitl_mock.port import AUTOPILOT_COMPONENT, Port
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate

_GCS_LOST_US = 5_000_000
_TEXT_BACKLOG = 16
_COMMANDS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE")
_PARAMETERS = ("PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET")
_SETPOINTS = ("SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_LOCAL_NED", "SET_ACTUATOR_CONTROL_TARGET")


class Px4:
    """PX4's software: takes messages in, flies the vehicle's motors, and reports on its ports."""

    def __init__(self, config: MockConfig, script: Script, ports: tuple[Port, ...], estimate: Estimate) -> None:
        vehicle = config.vehicle.params()
        self._frame = vehicle.frame
        self._config = config
        self._script = script
        self._gains = inner_loops.Gains(vehicle.hover_thrust_norm, vehicle.gravity_m_s2)
        self._loops = inner_loops.LoopState()
        release = config.px4_release
        self._ports = ports
        self._origin = ORIGINS[release]
        parameters = px4_parameters(release, config.system_id, config.com_rcl_except, vehicle)
        self._params = ParameterServer(parameters, ports, burst_us(release))
        self._reporter = Reporter(release, ports, config.streams, estimate)
        self._readings = Readings(release, self._origin, estimate, config.sensors.accelerometer_noise_m_s2)
        self._home = Home(ZERO3, estimate.euler_rad[2], 0)
        self._setpoint: inner_loops.Setpoint | None = None
        self._offboard = OffboardInput(release)
        self.commander = Commander(
            release, self._params, self._offboard, vehicle.hover_thrust_norm, round(config.ready_s * 1e6)
        )
        self._commands = Commands(
            release,
            config.system_id,
            self.commander,
            self._params,
            script,
            self._origin.altitude_m,
            self._send_by_id,
            self._reporter.set_interval,
            self._reporter.send_interval,
        )
        self._estimate = estimate
        self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
        self._attitude_thrust_norm = 0.0
        self._motors: Vec4 = (0.0, 0.0, 0.0, 0.0)

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
        return self._params.stored

    def pilot_selects(self, mode: str) -> None:
        """The pilot moves the mode switch."""
        self.commander.select(Mode(mode))

    def breach_geofence(self) -> None:
        """Nothing yet."""

    def handle(self, message: Message, sender: Sender, port: Port, boot_us: int) -> None:
        """React to one message from `sender` (system, component)."""
        kind = message.get_type()
        if kind in _SETPOINTS:
            self._take_setpoint(message, boot_us)
        elif kind in _COMMANDS:
            for ack in self._commands.answer(message, sender, port, boot_us):
                self._send(port, ack, boot_us)
        elif kind in _PARAMETERS:
            if self._is_for_us(message):
                for value in self._params.answer(message, port, boot_us):
                    self._send(port, value, boot_us)
        elif kind == "TIMESYNC":
            if message.tc1 == 0:
                self._send(port, mavlink.MAVLink_timesync_message(boot_us * 1000, message.ts1), boot_us)
        elif kind == "PING":
            if message.target_system == 0 and message.target_component == 0:
                self._send(port, mavlink.MAVLink_ping_message(message.time_usec, message.seq, *sender), boot_us)
        elif kind == "HEARTBEAT" and message.type == mavlink.MAV_TYPE_GCS:
            port.ground_station_us = boot_us
        self._send_texts(boot_us)

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of commander and inner loops; the motor commands until the next one."""
        self._estimate = estimate
        self.commander.step(truth, estimate, self._controls.thrust_norm, boot_us)
        if not self.commander.armed:
            self._loops = inner_loops.LoopState(attitude_target=estimate.quaternion)
            self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
            self._attitude_thrust_norm = 0.0
            self._motors = (0.0, 0.0, 0.0, 0.0)
            self._setpoint = None
            return self._motors
        if truth.on_ground:
            self._loops = inner_loops.LoopState(attitude_target=self._loops.attitude_target)
        setpoint = self._setpoint = self.commander.setpoint(estimate, truth.on_ground, boot_us, dt_s)
        self._controls, self._loops = inner_loops.step(self._gains, self._loops, setpoint, estimate, dt_s)
        if not isinstance(setpoint, inner_loops.RatesSetpoint):
            self._attitude_thrust_norm = self._controls.thrust_norm
        self._motors = mix(*self._controls.torque_frd_norm, self._controls.thrust_norm, self._frame)
        return self._motors

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due."""
        self._reporter.publish(self._estimate, boot_us)
        self._reporter.report(boot_us, partial(self._picture, boot_us))
        self._params.send_due(boot_us)
        self._send_texts(boot_us)

    def _take_setpoint(self, message: Message, boot_us: int) -> None:
        if not self._is_for_us(message, allow_broadcast=True):
            return
        self._offboard.take(message, self._estimate.euler_rad[2], boot_us)
        if self._offboard.warning:
            self.commander.texts.append((mavlink.MAV_SEVERITY_CRITICAL, self._offboard.warning))

    def _is_for_us(self, message: Message, allow_broadcast: bool = False) -> bool:
        systems = (self._config.system_id, 0) if allow_broadcast else (self._config.system_id,)
        return message.target_system in systems and message.target_component in (0, AUTOPILOT_COMPONENT)

    def _picture(self, boot_us: int) -> Picture:
        commander, estimate = self.commander, self._estimate
        if commander.home_ned_m != self._home.position_ned_m:
            self._home = Home(commander.home_ned_m, estimate.euler_rad[2], boot_us)
        setpoint = self._setpoint
        return Picture(
            firmware=self._config.px4_release,
            boot_us=boot_us,
            unix_us=self._ports[0].now_us,
            estimate=estimate,
            position=self._reporter.position,
            mode=commander.mode,
            armed=commander.armed,
            failsafe=commander.failsafe,
            ready=commander.is_ready(boot_us),
            landed=commander.landed,
            home=self._home,
            origin=self._origin,
            readings=self._readings,
            attitude_target=self._loops.attitude_target,
            rates_target_rad_s=self._loops.rates_target_rad_s,
            attitude_thrust_norm=self._attitude_thrust_norm,
            motor_commands=self._motors if commander.armed else None,
            gains=self._gains,
            controls=self._controls,
            followed=setpoint if isinstance(setpoint, inner_loops.PositionSetpoint) else None,
            is_torque_control=commander.is_torque_control(),
        )

    def _send_by_id(self, port: Port, message_id: int, boot_us: int) -> bool:
        return self._reporter.send(port, message_id, self._picture(boot_us))

    def _send_texts(self, boot_us: int) -> None:
        """STATUSTEXT goes out only where a ground station is heard; while there is none the latest ones wait."""
        texts = self.commander.texts
        if not texts:
            return
        ports = [port for port in self._ports if _hears_ground_station(port, boot_us)]
        if not ports:
            del texts[:-_TEXT_BACKLOG]
            return
        for severity, text in texts:
            for port in ports:
                self._send(port, telemetry.statustext(severity, text), boot_us)
        texts.clear()

    def _send(self, port: Port, message: Message, boot_us: int) -> None:
        port.send(message)


def _hears_ground_station(port: Port, boot_us: int) -> bool:
    return port.ground_station_us is not None and boot_us - port.ground_station_us <= _GCS_LOST_US
