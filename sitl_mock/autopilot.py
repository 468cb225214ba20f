"""The mock autopilot as an Endpoint: the world and the autopilot's software, stepped every 4 ms of virtual time.

Times are the world's, from its start; those of the software count from its last boot.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mavquad.endpoint import NEVER_US, floor_to_grid_us
from mavquad.protocol.codec import Message, decode, frame_source, mavlink, message_id
from sitl_mock.battery import Battery
from sitl_mock.config import MockConfig
from sitl_mock.config.faults import Deaf, Fault
from sitl_mock.config.vehicle_faults import Die, Reboot
from sitl_mock.geometry import Quaternion, Vec3, Vec4, to_euler
from sitl_mock.mishaps import MISHAPS
from sitl_mock.personality import Personality
from sitl_mock.personality.ardupilot.personality import ArduCopter
from sitl_mock.personality.px4.personality import Px4
from sitl_mock.plant import TICK_US
from sitl_mock.port import Port, PortKind
from sitl_mock.script import Script
from sitl_mock.sensors import Estimate
from sitl_mock.signatures import signatures_of, signatures_set_up
from sitl_mock.spoiler import Spoiler, Strangers
from sitl_mock.vehicle_clock import VehicleClock
from sitl_mock.world import TICK_S, World

_OFF: Vec4 = (0.0, 0.0, 0.0, 0.0)
_CRASH_SPEED_M_S = 3.0
_SETUP_SIGNING = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
_AUTOPILOT_IDS: dict[str, int] = {"px4": mavlink.MAV_AUTOPILOT_PX4, "ardupilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA}


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happens, for tests and summaries; `quaternion` turns FRD into NED, `euler_rad` is roll, pitch, yaw.

    Attributes:
        boot_us: time since the first boot.
        motor_commands: of each motor, 0 to 1.
    """

    boot_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    quaternion: Quaternion
    euler_rad: Vec3
    rates_frd_rad_s: Vec3
    armed: bool
    landed: bool
    crashed: bool
    mode: str
    motor_commands: Vec4
    battery: Battery

    @property
    def time_s(self) -> float:
        """Time since the first boot in s."""
        return self.boot_us * 1e-6


class MockAutopilot:
    """A simulated vehicle with its autopilot. Boot is at `start_us`; the same inputs and seed give the same bytes.

    As an `Endpoint` it is what its first port shows; the others are reached by their number.
    """

    def __init__(self, config: MockConfig, seed: int, start_us: int, ports: Sequence[PortKind] = ("onboard",)) -> None:
        self._start_us = floor_to_grid_us(start_us)
        self._tick_us = self._start_us
        self._clock = VehicleClock(self._start_us, config.clock_drift)
        self._config = config
        self._world = World(config, seed)
        self.script = Script(config.faults, self._start_us)
        signatures = signatures_of(config.signing, len(ports))
        self.ports = tuple(
            Port(kind, config.system_id, signs, self._start_us, config.mavlink == "in_kind")
            for kind, signs in zip(ports, signatures, strict=True)
        )
        self._motor_commands = _OFF
        self._wakes_us = self._start_us
        self._crashed_alone = False
        self._boot_us = self._start_us
        self._boot({})

    def _boot(self, parameters: Mapping[str, Any]) -> None:
        """The software starts: it knows nothing of what was before but its parameters."""
        self._is_down = False
        for port in self.ports:
            port.restart()
        self._personality: Personality = _personality(self._config, self.script, self.ports, self._world.estimate)
        self._personality.stored_parameters.update(parameters)
        strangers = Strangers(self._config.system_id, _AUTOPILOT_IDS[self._config.autopilot])
        self._spoiler = Spoiler(self.script, self.ports, strangers)
        if self.script.has_faults:
            self._spoiler.install()

    def fail(self, fault: Fault, from_now: bool = True) -> None:
        """One more fault; its times count from now, or from its own moment."""
        self.script.add(fault, self._tick_us if from_now else None)
        self._spoiler.install()

    @property
    def mode(self) -> str:
        """The autopilot's name of the mode in force, e.g. AUTO.LOITER."""
        return self._personality.mode

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._personality.armed and not self._is_down

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground; without software, whether it does."""
        return self._world.state.on_ground if self._is_down else self._personality.landed

    @property
    def crashed(self) -> bool:
        """Whether it came down hard or on its back."""
        return self._personality.crashed or self._crashed_alone

    @property
    def time_us(self) -> int:
        """Time since the first boot, of the last tick."""
        return self._tick_us - self._start_us

    @property
    def position_ned_m(self) -> Vec3:
        """The true position; `truth` has all the rest."""
        return self._world.state.position_ned_m

    @property
    def rejected(self) -> Counter[str]:
        """Frames not taken for their signature, by what was wrong with it, of all ports."""
        return sum((Counter(port.signatures.rejected) for port in self.ports if port.signatures), Counter())

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """Take in one whole, valid frame."""
        now_us = self._clock.vehicle_us(now_us)
        at = self.ports[port]
        if self._is_down or not at.lets_in(data, now_us):
            return
        if self.script.has_faults:
            self.script.now_us = now_us
            if any(self.script.acting(Deaf)):
                return
        message = decode(data)
        if message_id(data) == _SETUP_SIGNING:
            self._set_up_signing(message)
        else:
            self._personality.handle(message, frame_source(data), at, now_us - self._boot_us)
            if self.script.has_faults:
                self._observe()

    def _set_up_signing(self, message: Message) -> None:
        """SETUP_SIGNING: ArduPilot takes it, PX4 does not know it."""
        config = self._config
        if config.autopilot == "ardupilot" and message.target_system == config.system_id and not self.armed:
            for port, signs in zip(
                self.ports, signatures_set_up(config.signing, len(self.ports), message), strict=True
            ):
                port.signatures = signs

    def next_deadline_us(self) -> int:
        """The next tick of the physics."""
        if self._wakes_us == NEVER_US and self._world.state.on_ground:
            return NEVER_US
        return self._clock.wall_us(self._tick_us + TICK_US)

    def on_deadline(self, now_us: int) -> None:
        """One tick: the vehicle moves under the last motor commands, then is measured, controlled and reported."""
        self._tick_us = now_us = self._tick_us + TICK_US  # `now_us` by the vehicle's own clock
        world, has_faults = self._world, self.script.has_faults
        for port in self.ports:
            port.now_us = now_us
        world.step(self._motor_commands, now_us - self._start_us)
        if has_faults:
            self._go_wrong(now_us)
        if now_us < self._wakes_us:
            self._notice_impact()
            return
        if self._is_down:
            self._boot_us = now_us
        if self._boot_us != self._start_us:
            self._restamp()
        if self._is_down:
            self._boot(self._personality.stored_parameters)
        personality, boot_us = self._personality, now_us - self._boot_us
        self._motor_commands = personality.fly(world.state, world.estimate, boot_us, TICK_S)
        if has_faults:
            self._observe()
        personality.report(boot_us)

    def _go_wrong(self, now_us: int) -> None:
        """Let the faults of the script happen whose moment has come."""
        self.script.now_us = now_us
        for fault in self.script.happening():
            if isinstance(fault, Die | Reboot):
                self._go_down(now_us, None if isinstance(fault, Die) else fault.down_s)
            elif not self._is_down:
                MISHAPS[type(fault)](fault, self._world, self._personality, self._spoiler)
        if not self._is_down:
            self._spoiler.step()

    def _go_down(self, now_us: int, down_s: float | None) -> None:
        """The software stops, for ever or for a while; the motors with it."""
        self._motor_commands = _OFF
        self._is_down = True
        self._wakes_us = NEVER_US if down_s is None else now_us + round(down_s * 1e6)

    def _notice_impact(self) -> None:
        impact = self._world.state.impact
        if impact is not None and impact.speed_m_s > _CRASH_SPEED_M_S:
            self._crashed_alone = True

    def _observe(self) -> None:
        personality = self._personality
        self.script.observe(personality.mode, personality.armed, personality.landed)

    def _restamp(self) -> None:
        """Stamp this tick's estimate in the software's time, which began later than the world's."""
        estimate = self._world.estimate
        estimate.stamp_us = max(0, estimate.stamp_us - (self._boot_us - self._start_us))

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """The frames made since the last call, each a datagram."""
        return self.ports[port].take()

    def truth(self) -> Truth:
        """The true state now."""
        state = self._world.state
        return Truth(
            self.time_us,
            state.position_ned_m,
            state.velocity_ned_m_s,
            state.quaternion,
            to_euler(state.quaternion),
            state.rates_frd_rad_s,
            self.armed,
            self.landed,
            self.crashed,
            self.mode,
            self._motor_commands,
            self._world.estimate.battery,
        )


def _personality(config: MockConfig, script: Script, ports: tuple[Port, ...], estimate: Estimate) -> Personality:
    kind = ArduCopter if config.autopilot == "ardupilot" else Px4
    return kind(config, script, ports, estimate)
