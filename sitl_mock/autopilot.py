"""The mock autopilot as an Endpoint: the world and the autopilot's software, stepped every 4 ms of virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mavquad.endpoint import NEVER_US, floor_to_grid_us
from mavquad.protocol.codec import decode, frame_source
from sitl_mock.config import MockConfig
from sitl_mock.geometry import Quaternion, Vec3, Vec4, to_euler
from sitl_mock.personality import Personality
from sitl_mock.personality.px4.personality import Px4
from sitl_mock.plant import TICK_US
from sitl_mock.port import Port, PortKind
from sitl_mock.script import Script
from sitl_mock.world import TICK_S, World


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happens, for tests and summaries; `quaternion` turns FRD into NED, `euler_rad` is roll, pitch, yaw."""

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


class MockAutopilot:
    """A simulated vehicle with its autopilot. Boot is at `start_us`; the same inputs and seed give the same bytes.

    As an `Endpoint` it is what its first port shows; the others are reached by their number.
    """

    def __init__(self, config: MockConfig, seed: int, start_us: int, ports: Sequence[PortKind] = ("onboard",)) -> None:
        self._start_us = floor_to_grid_us(start_us)
        self._tick_us = self._start_us
        self._world = World(config, seed)
        self._script = Script(config.faults)
        self.ports = tuple(Port(kind, config.system_id) for kind in ports)
        self._personality = _personality(config, self._script, self.ports, self._world)
        self._motor_commands: Vec4 = (0.0, 0.0, 0.0, 0.0)
        self._is_dead = False

    @property
    def mode(self) -> str:
        """The autopilot's name of the mode in force, e.g. AUTO.LOITER."""
        return self._personality.mode

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._personality.armed

    def receive(self, data: bytes, now_us: int, port: int = 0) -> None:
        """Take in one whole, valid frame."""
        if not self._is_dead:
            boot_us = now_us - self._start_us
            self._personality.handle(decode(data), frame_source(data), self.ports[port], boot_us)

    def next_deadline_us(self) -> int:
        """The next tick of the physics."""
        return NEVER_US if self._is_dead else self._tick_us + TICK_US

    def on_deadline(self, now_us: int) -> None:
        """One tick: the vehicle moves under the last motor commands, then is measured, controlled and reported."""
        self._tick_us = now_us
        boot_us = now_us - self._start_us
        if self._script.is_dead(boot_us):
            self._is_dead = True
            return
        world = self._world
        world.step(self._motor_commands, boot_us)
        pilot = self._script.mode_change(boot_us)
        if pilot is not None:
            self._personality.pilot_selects(pilot)
        self._motor_commands = self._personality.fly(world.state, world.estimate, boot_us, TICK_S)
        self._personality.report(boot_us)

    def datagrams_to_send(self, port: int = 0) -> list[bytes]:
        """The frames made since the last call, each a datagram."""
        return self.ports[port].take()

    def truth(self) -> Truth:
        """The true state now."""
        state, personality = self._world.state, self._personality
        return Truth(
            self._tick_us - self._start_us,
            state.position_ned_m,
            state.velocity_ned_m_s,
            state.quaternion,
            to_euler(state.quaternion),
            state.rates_frd_rad_s,
            personality.armed,
            personality.landed,
            personality.crashed,
            personality.mode,
            self._motor_commands,
        )


def _personality(config: MockConfig, script: Script, ports: tuple[Port, ...], world: World) -> Personality:
    return Px4(config, script, ports, world.estimate)
