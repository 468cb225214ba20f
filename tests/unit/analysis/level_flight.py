"""The real controller on a level vehicle in the small: an oracle for the linear analysis, written apart from it.

z, pitch and yaw of a vehicle near hover, integrated in steps of 0.5 ms; the wire's commands arrive after a delay, and act
after a dead time and a first-order lag. Motions of micrometres: no limit is met, nothing is curved.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

from mavquad.analysis.loop_spec import Path
from mavquad.control.controller import Controller
from mavquad.control.params import LawParams
from mavquad.types import Attitude, AttitudeCommand, Depth, LawCommand, Position, RateCommand, ReferencePoint

STEP_US = 500
SMALL = 1e-6
G = 9.81
HERE = ReferencePoint(*(((0.0,) * 5,) * 4))


@dataclass
class Axis:
    """One input behind its dead time and lag."""

    path: Path
    order: int
    states: list[float]
    lagged: float = 0.0

    def step(self, sent: list[tuple[int, float]], now_us: int) -> None:
        due_us = now_us - round(self.path.dead_time_s * 1e6)
        wanted = [value for arrive_us, value in sent if arrive_us <= due_us][-1:] or [0.0]
        h, before = STEP_US * 1e-6, self.lagged
        left = math.exp(-h / self.path.lag_s) if self.path.lag_s > 0.0 else 0.0
        self.lagged = wanted[0] + (before - wanted[0]) * left
        mean = 0.5 * (before + self.lagged) if self.path.lag_s > 0.0 else wanted[0]
        derivatives = [*self.states, mean]
        for i in range(self.order):
            self.states[i] += sum(h**k / math.factorial(k) * d for k, d in enumerate(derivatives[i + 1 :], start=1))


def response(
    law: LawParams,
    depth: Depth,
    paths: dict[str, Path],
    ticks: int,
    *,
    tick_us: int = 10_000,
    position_every: int = 1,
    gains: dict[str, float] | None = None,
    noise: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    start: float = SMALL,
    seed: int = 1,
) -> dict[str, list[float]]:
    """Position x and z in m and yaw in rad at every tick, from a start that is `start` off in each.

    Attitudes come with every tick, positions every n-th; the law answers every attitude, or, where it measures none, every
    position. `noise`: standard deviations of position, velocity, angles and rates.
    """
    rng, gains = random.Random(seed), gains or {}
    r = {"torque": 4, "rate": 3, "attitude": 2}[depth]
    x, z, yaw = (
        Axis(paths["horizontal"], r, [start] + [0.0] * (r - 1)),
        Axis(paths["vertical"], 2, [start, 0.0]),
        Axis(paths["yaw"], 2 if depth == "torque" else 1, [start, 0.0][: 2 if depth == "torque" else 1]),
    )
    axes = {"horizontal": x, "vertical": z, "yaw": yaw}
    sent: dict[str, list[tuple[int, float]]] = {name: [] for name in axes}
    steps_law_by_position = law.measured() == "position_yaw"
    controller: Controller | None = None
    yaw_sent = start
    found: dict[str, list[float]] = {name: [] for name in axes}
    for k in range(ticks * tick_us // STEP_US):
        now_us = k * STEP_US
        if now_us % tick_us == 0:
            number = now_us // tick_us
            for name, axis in axes.items():
                found[name].append(axis.states[0])
            position, attitude = _measured(now_us, x, z, yaw, r, noise, rng)
            if controller is None:
                controller = Controller(law, depth, position, attitude, G)
            controller.observe_attitude(attitude)
            if number % position_every == 0:
                controller.observe_position(position)
            if number % position_every == 0 or not steps_law_by_position:
                command = controller.command(lambda _: HERE)
                assert controller.trace is not None and controller.trace.limits_active == ()
                pitch, thrust, turn = _wire(
                    command, yaw_sent, position_every * tick_us if steps_law_by_position else tick_us
                )
                if isinstance(command, AttitudeCommand):
                    yaw_sent = command.yaw_rad
                for name, value in (("horizontal", G * pitch), ("vertical", thrust - G), ("yaw", turn)):
                    arrive_us = now_us + round(paths[name].delay_s * 1e6)
                    sent[name].append((arrive_us, gains.get(name, 1.0) * value))
                    del sent[name][:-200]
        for name, axis in axes.items():
            axis.step(sent[name], now_us)
    return found


def _wire(command: LawCommand, yaw_sent: float, since_us: int) -> tuple[float, float, float]:
    """Pitch input, thrust, yaw input."""
    if isinstance(command, AttitudeCommand):
        return command.pitch_rad, command.specific_thrust_m_s2, (command.yaw_rad - yaw_sent) / (since_us * 1e-6)
    body = command.rates_flu_rad_s if isinstance(command, RateCommand) else command.angular_acceleration_flu_rad_s2
    return body[1], command.specific_thrust_m_s2, body[2]


def _measured(
    now_us: int, x: Axis, z: Axis, yaw: Axis, r: int, noise: tuple[float, ...], rng: random.Random
) -> tuple[Position, Attitude]:
    position, velocity, angle, rate = noise
    gauss = rng.gauss
    lean = x.lagged if r == 2 else x.states[2]
    lean_rate = 0.0 if r == 2 else x.lagged if r == 3 else x.states[3]
    turn_rate = yaw.states[1] if yaw.order == 2 else yaw.lagged
    return (
        Position(
            now_us,
            (x.states[0] + gauss(0, position), 0.0, z.states[0] + gauss(0, position)),
            (x.states[1] + gauss(0, velocity), 0.0, z.states[1] + gauss(0, velocity)),
        ),
        Attitude(
            now_us,
            0.0,
            lean / G + gauss(0, angle),
            yaw.states[0] + gauss(0, angle),
            (0.0, lean_rate / G + gauss(0, rate), turn_rate + gauss(0, rate)),
        ),
    )
