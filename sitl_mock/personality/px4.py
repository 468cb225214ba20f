"""The PX4 personality: PX4's dialogue, modes and telemetry around a vehicle."""

from __future__ import annotations

from mavquad.protocol.codec import Encoder, Message, mavlink
from sitl_mock import inner_loops
from sitl_mock.config import MockConfig
from sitl_mock.geometry import ZERO3, Vec4
from sitl_mock.mixer import mix
from sitl_mock.personality import telemetry
from sitl_mock.personality.commander import Commander
from sitl_mock.personality.commands import Commands, Sender
from sitl_mock.personality.modes import Mode
from sitl_mock.personality.offboard import OffboardInput
from sitl_mock.personality.params import ParameterServer, px4_defaults
from sitl_mock.personality.streams import Streams
from sitl_mock.plant import VehicleState
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate

_AUTOPILOT_COMPONENT = 1
_GCS_LOST_US = 5_000_000
_TEXT_BACKLOG = 16
_COMMANDS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE")
_PARAMETERS = ("PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET")
_SETPOINTS = ("SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_LOCAL_NED", "SET_ACTUATOR_CONTROL_TARGET")


class Px4:
    """Takes messages in, flies the vehicle's motors, and fills `outbox` with frames."""

    def __init__(self, config: MockConfig, script: Script, estimate: Estimate) -> None:
        vehicle = config.vehicle.params()
        self._config = config
        self._script = script
        self._gains = inner_loops.Gains(vehicle.hover_thrust_norm, vehicle.gravity_m_s2)
        self._loops = inner_loops.LoopState()
        self._encoder = Encoder(config.system_id, _AUTOPILOT_COMPONENT)
        self._params = ParameterServer(px4_defaults(config.system_id, config.com_rcl_except, vehicle))
        self._streams = Streams(config.streams)
        self._offboard = OffboardInput(config.firmware)
        self.commander = Commander(
            config.firmware, self._params, self._offboard, vehicle.hover_thrust_norm, round(config.ready_s * 1e6)
        )
        self._commands = Commands(
            config.firmware,
            config.system_id,
            self.commander,
            self._streams,
            self._params,
            script,
            telemetry.HOME_ALTITUDE_M,
            self._send_by_id,
        )
        self._estimate = estimate
        self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
        self._attitude_thrust_norm = 0.0
        self._motors: Vec4 = (0.0, 0.0, 0.0, 0.0)
        self._gcs_us: int | None = None
        self.outbox: list[bytes] = []

    def handle(self, message: Message, sender: Sender, boot_us: int) -> None:
        """React to one message from `sender` (system, component)."""
        kind = message.get_type()
        if kind in _SETPOINTS:
            self._take_setpoint(message, boot_us)
        elif kind in _COMMANDS:
            for ack in self._commands.answer(message, sender, boot_us):
                self._send(ack, boot_us)
        elif kind in _PARAMETERS:
            if self._is_for_us(message):
                for value in self._params.answer(message):
                    self._send(value, boot_us)
        elif kind == "TIMESYNC":
            if message.tc1 == 0:
                self._send(mavlink.MAVLink_timesync_message(boot_us * 1000, message.ts1), boot_us)
        elif kind == "HEARTBEAT" and message.type == mavlink.MAV_TYPE_GCS:
            self._gcs_us = boot_us
        self._note_offboard(boot_us)
        self._send_texts(boot_us)

    def fly(self, truth: VehicleState, estimate: Estimate, boot_us: int, dt_s: float) -> Vec4:
        """One tick of commander and inner loops; the motor commands until the next one."""
        self._estimate = estimate
        pilot = self._script.mode_change(boot_us)
        if pilot is not None:
            self.commander.select(Mode(pilot))
        self.commander.step(truth, estimate, self._controls.thrust_norm, boot_us)
        self._note_offboard(boot_us)
        if not self.commander.armed:
            self._loops = inner_loops.LoopState(attitude_target=estimate.quaternion)
            self._controls = inner_loops.TorqueSetpoint(ZERO3, 0.0)
            self._attitude_thrust_norm = 0.0
            self._motors = (0.0, 0.0, 0.0, 0.0)
            return self._motors
        if truth.on_ground:
            self._loops = inner_loops.LoopState(attitude_target=self._loops.attitude_target)
        setpoint = self.commander.setpoint(estimate, truth.on_ground, boot_us, dt_s)
        self._controls, self._loops = inner_loops.step(self._gains, self._loops, setpoint, estimate, dt_s)
        if not isinstance(setpoint, inner_loops.RatesSetpoint):
            self._attitude_thrust_norm = self._controls.thrust_norm
        self._motors = mix(*self._controls.torque_frd_norm, self._controls.thrust_norm)
        return self._motors

    def report(self, boot_us: int) -> None:
        """Send the telemetry that is due."""
        due = self._streams.due(boot_us)
        if due:
            picture = self._picture(boot_us)
            for message_id in due:
                self._send_built(message_id, picture)
        value = self._params.next_of_list()
        if value is not None:
            self._send(value, boot_us)
        self._send_texts(boot_us)

    def _take_setpoint(self, message: Message, boot_us: int) -> None:
        if not self._is_for_us(message, allow_broadcast=True):
            return
        self._offboard.take(message, self._estimate.euler_rad[2], boot_us)
        if self._offboard.warning:
            self.commander.texts.append((mavlink.MAV_SEVERITY_CRITICAL, self._offboard.warning))

    def _is_for_us(self, message: Message, allow_broadcast: bool = False) -> bool:
        systems = (self._config.system_id, 0) if allow_broadcast else (self._config.system_id,)
        return message.target_system in systems and message.target_component in (0, _AUTOPILOT_COMPONENT)

    def _note_offboard(self, boot_us: int) -> None:
        if self.commander.mode is Mode.OFFBOARD:
            self._script.offboard_entered(boot_us)

    def _picture(self, boot_us: int) -> telemetry.Picture:
        commander = self.commander
        return telemetry.Picture(
            self._config.firmware,
            boot_us,
            self._estimate,
            commander.mode,
            commander.armed,
            commander.failsafe,
            commander.is_ready(boot_us),
            commander.landed,
            commander.home_ned_m,
            self._loops.attitude_target,
            self._loops.rates_target_rad_s,
            self._attitude_thrust_norm,
            self._motors if commander.armed else None,
            commander.is_torque_control(),
            self._script.has_nan_pose(boot_us),
        )

    def _send_by_id(self, message_id: int, boot_us: int) -> bool:
        if message_id == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            self._send(telemetry.autopilot_version(self._config.firmware), boot_us)
            return True
        return message_id in telemetry.BUILDERS and self._send_built(message_id, self._picture(boot_us))

    def _send_built(self, message_id: int, picture: telemetry.Picture) -> bool:
        message = telemetry.BUILDERS[message_id](picture)
        if message is None:
            return False
        self._send(message, picture.boot_us)
        return True

    def _send_texts(self, boot_us: int) -> None:
        """STATUSTEXT goes out only while a ground station is heard; until then the latest ones wait."""
        texts = self.commander.texts
        if not texts:
            return
        if self._gcs_us is None or boot_us - self._gcs_us > _GCS_LOST_US:
            del texts[:-_TEXT_BACKLOG]
            return
        for severity, text in texts:
            self._send(telemetry.statustext(severity, text), boot_us)
        texts.clear()

    def _send(self, message: Message, boot_us: int) -> None:
        if not self._script.is_silent(boot_us) and not self._script.is_stopped(message.get_type(), boot_us):
            self.outbox.append(self._encoder.encode(message))
