"""The closed loop of one channel near hover as matrices, made by running the law's own code.

While no limit is met, observer, prediction and law are linear: what they do with numbers they do with vectors. So the code of
`mavquad.control` is run once over one beat, and every number that passes through it is the vector of its coefficients on

    the state at the beginning of the beat, a disturbance q of each command where it begins to act, and each sample's noise.

The plant is the ideal chain behind delay, dead time and first-order lag: level, no friction, no wind. As in the law itself,
thrust is a staircase: the integrators before it (depths torque and rate) belong to the law, and the vertical plant is the
double integrator behind them. The vertical rows of acceleration and jerk are not of the plant either, but of the law's own
replica of the thrust. Yaw at depth attitude is taken for a rate, not for the staircase of angles on the wire.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from mavquad.analysis.loop_spec import LoopSpec
from mavquad.control.actuation import Command
from mavquad.control.integrators import Integrator, advanced
from mavquad.control.observer import Chain, ChainSpec
from mavquad.control.thrust import ThrustReplica

Matrix = npt.NDArray[np.float64]
Vector = Any
"""Coefficients of one number: an array (columns,) that stands where the law's code has a float."""


@dataclass(frozen=True, slots=True)
class Loop:
    """x+ = a x + b q + e v over one beat; n states, c commands in a beat, m noises, t ticks.

    Attributes:
        spec: what it is the loop of.
        a: (n, n).
        b: (n, c). q is added to each command as it begins to act on the plant.
        e: (n, m). v has unit variance.
        inputs: (c, n + c + m), coefficients of each command that begins to act on the plant, without its q: w, or thrust
            where the law integrates w.
        commands: (c, n + c + m), the same of w.
        outputs: (t, n + c + m), the same of the plant's zeta_1 at every tick.
        echo: coefficient of a command on the one before it. The law predicts over the lag with its last command held, so
            that a command answers it; at -1 the commands alternate without end.
    """

    spec: LoopSpec
    a: Matrix
    b: Matrix
    e: Matrix
    inputs: Matrix
    commands: Matrix
    outputs: Matrix
    echo: float

    def with_gain(self, factor: float) -> Matrix:
        """`a` with the plant's input gain `factor` times what the law takes it for: q = (factor - 1) input."""
        n, count = len(self.a), self.b.shape[1]
        c, d = self.inputs[:, :n], self.inputs[:, n : n + count]
        more = factor - 1.0
        return self.a + self.b @ cast(Matrix, np.linalg.solve(np.eye(count) - more * d, more * c))


def closed_loop(spec: LoopSpec) -> Loop:
    """The loop of a channel."""
    run = _Run(spec)
    for tick in range(spec.beat.ticks):
        run.pass_tick(tick)
    return run.loop()


class _Run:
    """One beat. Unit vectors are handed out in the order of the columns: state, disturbances, noises."""

    def __init__(self, spec: LoopSpec) -> None:
        beat, chain, path = spec.beat, spec.tune.spec, spec.path
        self.spec = spec
        self.step_us = beat.command_every * beat.tick_us
        # What begins to act on the plant after a command's own stamp is the one so many commands before it, so much later.
        self.late, self.after_us = divmod(round((path.delay_s + path.dead_time_s) * 1e6), self.step_us)
        self.replicated = any(index >= spec.plant_length for index in spec.measured)
        past = max(self._past(spec.delay_us + chain.dead_us), 0 if spec.integrators else self.late)
        # One more: the slope of the thrust in force is that from the one before it.
        past_thrusts = max(self._past(spec.delay_us), self.late) + 1 if spec.integrators else 0
        states = spec.plant_length + 1 + chain.length + 2 + self._drifts() + past + 1 + past_thrusts
        self.columns = (
            states + (3 if spec.integrators else 0) + self.replicated,
            beat.ticks // beat.command_every,
            sum(beat.ticks // spec.every(index) for index in spec.measured),
        )
        self._basis = iter(np.eye(sum(self.columns)))
        self.zero = cast(Vector, np.zeros(sum(self.columns)))
        plant = ChainSpec(spec.plant_length, (), path.lag_s)
        self.plant = Chain(plant, (*self._new(spec.plant_length), self.zero), 0, self._one())
        self.observer = self._observer()
        self.past = self._new(past)
        self.last = int(np.argmax(self.past[-1]))
        self.before = self.acting = self._one()
        self.integrated = self._new(3) if spec.integrators else []
        self.past_thrusts = self._new(past_thrusts)
        self.thrust = self._one() if self.replicated else self.zero
        self._disturbances = iter(self._new(self.columns[1]))
        self.commands: list[Vector] = []
        self.inputs: list[Vector] = []
        self.outputs: list[Vector] = []

    def _past(self, back_us: int) -> int:
        """How many earlier commands may still matter to the law at any tick."""
        return max(1, math.ceil(back_us / self.step_us)) + (self.spec.beat.command_every > 1)

    def _drifts(self) -> int:
        """States of the disturbances of all stretches but the last."""
        chain = self.spec.tune.spec
        unused = self.spec.state_feedback
        return 0 if unused else sum(map(len, Chain(chain, (0.0,) * (chain.length + 1), 0).drifts))

    def _one(self) -> Vector:
        return next(self._basis).copy()

    def _new(self, count: int) -> list[Vector]:
        return [self._one() for _ in range(count)]

    def _observer(self) -> Chain:
        """As it is right before the first tick's measurement: every row was last measured its own spacing ago."""
        spec = self.spec
        chain = spec.tune.spec
        observer = Chain(chain, (0.0,) * (chain.length + 1), -spec.beat.ticks * spec.beat.tick_us)
        for number, row in enumerate(chain.rows):
            observer.correct(number, 0.0, -spec.every(row.index) * spec.beat.tick_us)
        observer.values = self._new(chain.length + 1)
        # State feedback has no use for them.
        observer.drifts = [] if spec.state_feedback else [self._new(len(drift)) for drift in observer.drifts]
        observer.lagged = self._one()
        return observer

    # ------------------------------------------------------------------ one tick

    def pass_tick(self, tick: int) -> None:
        """Measure, correct, command, and on to the next tick."""
        now_us = tick * self.spec.beat.tick_us
        until_us, since_us = now_us + self.spec.beat.tick_us, now_us % self.step_us
        stamp_us = now_us - (since_us or self.step_us)
        self.outputs.append(self.plant.values[0])
        self._measure(tick, now_us, self._replica(stamp_us, now_us))
        if since_us == 0:
            self._command(stamp_us, now_us)
            stamp_us = now_us
        self.observer.predict(self.observer.span(self._timed(self.past, stamp_us), now_us, until_us), 0)
        acting = ((stamp_us + self.after_us - self.step_us, self.before), (stamp_us + self.after_us, self.acting))
        self.plant.predict(self.plant.span(_first_of_four(acting), now_us, until_us), 0)
        if self.replicated:
            replica = self._replica(stamp_us, now_us)
            replica.advance(until_us)
            self.thrust = cast(Vector, replica.value_m_s2)
        if since_us == 0:
            del self.past[:1], self.past_thrusts[:1]

    def _timed(self, values: list[Vector], stamp_us: int) -> tuple[Command, ...]:
        """Commands and when they arrive as the law sees it, the last one computed at `stamp_us`."""
        first_us = stamp_us - (len(values) - 1) * self.step_us + self.spec.delay_us
        return _first_of_four((first_us + k * self.step_us, value) for k, value in enumerate(values))

    def _replica(self, stamp_us: int, now_us: int) -> ThrustReplica:
        """The law's thrust at this moment."""
        replica = ThrustReplica(self.spec.tune.spec.lag_s, cast(float, self.thrust), now_us)
        for arrive_us, (value, *_) in self._timed(self.past_thrusts, stamp_us):
            replica.command(arrive_us, value)
        replica.advance(now_us)
        return replica

    def _measure(self, tick: int, now_us: int, replica: ThrustReplica) -> None:
        spec, observer = self.spec, self.observer
        values = []
        for row, index in enumerate(spec.measured):
            if tick % spec.every(index):
                continue
            value = self._true(index, replica) + spec.noise[index] * self._one()
            if not spec.state_feedback:
                observer.correct(row, value - observer.predicted(row), now_us)
            values.append(value)
        if spec.state_feedback:
            observer.values = [*values, self.zero]

    def _true(self, index: int, replica: ThrustReplica) -> Vector:
        if index < self.spec.plant_length:
            return self.plant.values[index]
        return replica.value_m_s2 if index == self.spec.plant_length else replica.rate_m_s3

    def _command(self, stamp_us: int, now_us: int) -> None:
        """w = -sigma - sum gamma_i zeta_i where it will act, through the law's integrators, onto its way."""
        spec, observer = self.spec, self.observer
        until_us = now_us + spec.delay_us + spec.tune.ahead_us
        zeta = observer.ahead(observer.span(self._timed(self.past, stamp_us), now_us, until_us), 0)
        w: Vector = -1.0 * zeta[-1]
        for gamma, value in zip(spec.tune.gammas, zeta, strict=False):
            w = w - gamma * value
        self.past.append(w)
        self.commands.append(w)
        if spec.integrators:
            self.past_thrusts.append(self._integrate(w))
        sent = (self.past_thrusts if spec.integrators else self.past)[-1 - self.late]
        self.inputs.append(sent)
        self.before, self.acting = self.acting, sent + next(self._disturbances)

    def _integrate(self, w: Vector) -> Vector:
        """u at the arrival of this command; w drives it from there on."""
        order, dt_s = self.spec.integrators, self.step_us * 1e-6
        units = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        answers = [advanced(Integrator(order, *unit), dt_s, -math.inf, math.inf) for unit in units]
        value = sum(answer.value * part for answer, part in zip(answers, self.integrated, strict=True))
        rate = sum(answer.rate * part for answer, part in zip(answers, self.integrated, strict=True))
        self.integrated = [value, rate, w]
        return value

    # ------------------------------------------------------------------ the result

    def loop(self) -> Loop:
        """The matrices, after the last tick."""
        n, count, _ = self.columns
        end = np.array(
            [
                *self.plant.values[:-1],
                self.plant.lagged,
                *self.observer.values,
                *(part for drift in self.observer.drifts for part in drift),
                self.observer.lagged,
                *self.past,
                self.acting,
                *self.integrated,
                *self.past_thrusts,
                *([self.thrust] if self.replicated else []),
            ]
        )
        return Loop(
            self.spec,
            end[:, :n],
            end[:, n : n + count],
            end[:, n + count :],
            np.array(self.inputs),
            np.array(self.commands),
            np.array(self.outputs),
            float(self.commands[0][self.last]),
        )


def _first_of_four(timed: Iterable[tuple[int, Vector]]) -> tuple[Command, ...]:
    """Commands of one channel in the law's form, which has four."""
    return tuple((start_us, (value, 0.0, 0.0, 0.0)) for start_us, value in timed)
