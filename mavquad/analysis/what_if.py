"""What another law would have commanded in a flight of ours, over the same measurements.

The other law is asked at the moments of the flown one's steps and told what acted instead (`mavquad.analysis.open_loop`):
where it commands the same thing, the flown inputs; at another depth, or where its inputs have another meaning, the motion
that was measured. Where it commands the same thing it also goes by the inner loop that its flown commands and their answers
show, as in flight. With the flown configuration every command is the flown one, to the bit.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from mavquad.analysis.metrics import root_mean_square
from mavquad.analysis.open_loop import Acted, Motion, OpenLoop
from mavquad.control.defaults import Autopilot
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import Tuning, tuning
from mavquad.flight.airframe import AirframeParams
from mavquad.flight.guards import tilt_rad
from mavquad.flight.inner_loop import InnerLoop
from mavquad.flight.law_flight import WATCHED_US, Watched, within_controls
from mavquad.flight.machine import Phase
from mavquad.flight_record import TraceRow
from mavquad.frames import wrap_pi
from mavquad.protocol.firmware import setpoints
from mavquad.types import Attitude, Depth, Position, ReferencePoint, Vec4

INPUTS = ("thrust", "yaw", "roll", "pitch")
"""Order of U."""


@dataclass(frozen=True, slots=True)
class FlownMeasurement:
    """A measurement that the agent took, and whether its law was in control by then."""

    measured: Attitude | Position
    in_control: bool


@dataclass(frozen=True, slots=True)
class FlownTarget:
    """A command of the autopilot's own that the observer was fed before the law was in control."""

    watched: Watched


@dataclass(frozen=True, slots=True)
class FlownStep:
    """A step of the flown law: its row, whether it was in control, the share of its limits that it might use
    (`Controller.command`), and the reference with its derivatives."""

    row: TraceRow
    in_control: bool
    authority: float
    reference: ReferencePoint


@dataclass(slots=True)
class Flown:
    """All that the law was given in a flight, in order, and by what it was flown."""

    airframe: AirframeParams
    autopilot: Autopilot = "px4"
    hover_thrust_norm: float = 0.0
    found: dict[str, Any] = field(default_factory=dict)
    """What the flight found out for keys of [law] that its configuration left open, e.g. the delay."""
    inputs: list[FlownMeasurement | FlownTarget | FlownStep] = field(default_factory=list)

    @property
    def steps(self) -> list[FlownStep]:
        """The steps alone."""
        return [item for item in self.inputs if isinstance(item, FlownStep)]


@dataclass(frozen=True, slots=True)
class Answer:
    """One step: the flown row, the row of the other law, and what acted, as inputs U of the other law."""

    flown: TraceRow
    other: TraceRow
    acted: Vec4
    in_control: bool

    @property
    def counts(self) -> bool:
        """Whether the flown law was in control; but for the handing back, where the autopilot may have taken over."""
        return self.in_control and self.flown.phase == Phase.FLYING.value


@dataclass(frozen=True, slots=True)
class Differences:
    """RMS and largest of the other law's inputs minus those that acted, in the order thrust, yaw, roll, pitch; in the
    units of the other law's depth. None without a step in control."""

    rms: tuple[float | None, ...]
    most: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class WhatIf:
    """The other law beside the flown one.

    Attributes:
        flown_depth: of the flight.
        depth: of the other law.
        same_inputs: whether both laws' inputs mean the same, so that what acted are the flown inputs themselves.
        answers: one a step.
    """

    flown_depth: Depth
    depth: Depth
    same_inputs: bool
    answers: tuple[Answer, ...]

    @property
    def counted(self) -> list[Answer]:
        """The steps that count."""
        return [answer for answer in self.answers if answer.counts]

    def differences(self) -> Differences:
        """Of all counted steps."""
        columns = [[answer.other.input[k] - answer.acted[k] for answer in self.counted] for k in range(len(INPUTS))]
        if self.depth == "attitude":
            columns[2:] = [[wrap_pi(value) for value in column] for column in columns[2:]]
        return Differences(
            tuple(root_mean_square(column) for column in columns),
            tuple(max(map(abs, column)) if column else None for column in columns),
        )

    def limits(self) -> tuple[dict[str, float], dict[str, float]]:
        """How large a share of the counted steps met each limit: as flown, and in the other law."""
        return _shares([a.flown for a in self.counted]), _shares([a.other for a in self.counted])

    def to_json(self) -> dict[str, Any]:
        """For --json; the units are those of `trace.csv` at the other law's depth."""
        differences = self.differences()
        flown, other = self.limits()
        return {
            "flown_depth": self.flown_depth,
            "depth": self.depth,
            "acted": "the flown inputs" if self.same_inputs else "the measured motion",
            "steps": len(self.answers),
            "steps_counted": len(self.counted),
            "input_units": dict(zip(INPUTS, units(self.depth, self._yaw_length()), strict=True)),
            "difference_rms": dict(zip(INPUTS, differences.rms, strict=True)),
            "difference_max": dict(zip(INPUTS, differences.most, strict=True)),
            "limits_flown": flown,
            "limits_other": other,
        }

    def _yaw_length(self) -> int:
        return len(self.answers[0].other.zeta_hat[1]) if self.answers else 1


def units(depth: Depth, yaw_length: int) -> tuple[str, str, str, str]:
    """Units of U at a depth, as the columns of `trace.csv` carry them."""
    thrust = {"attitude": "m/s²", "rate": "m/s³", "torque": "m/s⁴"}[depth]
    lean = {"attitude": "rad", "rate": "rad/s", "torque": "rad/s²"}[depth]
    yaw = {1: "rad/s", 2: "rad/s²", 3: "rad/s³", 4: "rad/s⁴"}[yaw_length]
    return thrust, yaw, lean, lean


def what_if(flown: Flown, law: LawParams, depth: Depth) -> WhatIf:
    """Put a law beside a flight.

    Args:
        flown: what the flown law was given.
        law: the other one.
        depth: where it commands.
    """
    steps = flown.steps
    if not steps:
        return WhatIf(depth, depth, True, ())
    return _Beside(flown, law, depth, steps).answers()


class _Beside:
    """The other law on its way through a flight."""

    def __init__(self, flown: Flown, law: LawParams, depth: Depth, steps: Sequence[FlownStep]) -> None:
        self._flown, self._own = flown, law
        found = {key: value for key, value in flown.found.items() if depth == steps[0].row.depth or key == "delay_s"}
        self._told = law.of(flown.autopilot).told(found)
        self._depth = depth
        self._tune = tuning(self._within(self._told, flown.hover_thrust_norm), depth)
        self._first = steps[0].row
        self._same = _means_the_same(self._tune, self._first)
        self._motion = None if self._same else _motion(flown, steps)
        self._controller: OpenLoop | None = None
        self._inner_loop: InnerLoop | None = None
        self._watched_us: int | None = None
        self._attitude: Attitude | None = None
        self._position: Position | None = None

    def answers(self) -> WhatIf:
        answers = [answer for item in self._flown.inputs if (answer := self._take(item)) is not None]
        return WhatIf(self._first.depth, self._depth, self._same, tuple(answers))

    def _within(self, law: LawParams, hover_thrust_norm: float) -> LawParams:
        return within_controls(law, self._flown.airframe, hover_thrust_norm)

    def _take(self, item: FlownMeasurement | FlownTarget | FlownStep) -> Answer | None:
        if isinstance(item, FlownStep):
            return self._step(item)
        if isinstance(item, FlownTarget):
            self._watch(item.watched)
            return None
        watches = item.in_control or self._watched_us is not None
        measured, controller = item.measured, self._controller if watches else None
        if isinstance(measured, Attitude):
            self._attitude = measured
            if controller is not None:
                controller.observe_attitude(measured)
            if controller is not None and item.in_control:
                self._heed(measured, controller)
        else:
            self._position = measured
            if controller is not None:
                controller.observe_position(measured)
        return None

    def _watch(self, watched: Watched) -> None:
        """As in flight: the observer is fed the autopilot's own command; at another depth it says nothing to it."""
        if not self._same:
            return
        if watched.starts:
            self._controller = self._started(watched.hover_thrust_norm)
        if self._controller is not None:
            self._controller.acted(watched.stamp_us, watched.command)
            self._watched_us = watched.stamp_us

    def _started(self, hover_thrust_norm: float) -> OpenLoop:
        assert self._position is not None and self._attitude is not None
        law = self._told
        if self._same:
            self._inner_loop = InnerLoop(self._own, law, self._depth)
            law = self._inner_loop.law
        within = self._within(law, hover_thrust_norm)
        return OpenLoop(within, self._depth, self._position, self._attitude, self._trim_m_s2())

    def _heed(self, attitude: Attitude, controller: OpenLoop) -> None:
        better = self._inner_loop.answer(attitude) if self._inner_loop is not None else None
        if better is not None:
            controller.retune(self._within(better, self._flown.hover_thrust_norm))

    def _trim_m_s2(self) -> float:
        assert self._attitude is not None
        return GRAVITY_M_S2 / math.cos(tilt_rad(self._attitude))

    def _begun(self, step: FlownStep) -> OpenLoop:
        """As in flight: until its commands act the law begins anew at each step; its observer too, unless it watched."""
        assert self._position is not None and self._attitude is not None
        controller, watched_us = self._controller, self._watched_us
        if controller is not None and watched_us is not None and self._position.stamp_us - watched_us <= WATCHED_US:
            controller.begin(self._attitude, self._trim_m_s2())
        elif controller is None or watched_us is not None or not step.in_control:
            controller, self._watched_us = self._started(self._flown.hover_thrust_norm), None
        if step.in_control:
            self._watched_us = None
        return controller

    def _step(self, step: FlownStep) -> Answer:
        self._controller = controller = self._begun(step)
        acts = self._watched_us is None
        command = controller.command(lambda _: step.reference, step.authority, acts)
        trace = controller.trace
        assert trace is not None
        acted = self._acted(step, controller)
        if acts:
            flown = controller.instead(acted)
            if self._inner_loop is not None:
                self._inner_loop.command(flown, controller.arrives_us)
        airframe = self._flown.airframe
        controls = setpoints.controls(
            command, airframe.torque_scale_frd_rad_s2, self._flown.hover_thrust_norm, GRAVITY_M_S2
        )
        row = step.row._replace(
            vehicle_stamp_us=trace.stamp_us,
            measured=trace.measured,
            reference=trace.reference,
            zeta_hat=trace.zeta_hat,
            sigma=trace.sigma,
            wind=trace.wind,
            demanded=trace.demanded,
            input=trace.inputs,
            controls=controls,
            limits=trace.limits_active,
        )
        return Answer(step.row, row, acted.inputs, step.in_control)

    def _acted(self, step: FlownStep, controller: OpenLoop) -> Acted:
        if self._motion is None:
            return Acted(step.row.input)
        return self._motion.acted(self._tune, controller.arrives_us)


def _means_the_same(tune: Tuning, row: TraceRow) -> bool:
    """Whether the inputs of a law are those of a flown row: as many integrators before them."""
    lengths = [len(chain) for chain in row.zeta_hat]
    return [tune.vertical.spec.length, tune.yaw.spec.length] == lengths[:2]


def _motion(flown: Flown, steps: Sequence[FlownStep]) -> Motion:
    attitudes = [
        item.measured
        for item in flown.inputs
        if isinstance(item, FlownMeasurement) and isinstance(item.measured, Attitude)
    ]
    scale = GRAVITY_M_S2 / flown.hover_thrust_norm
    return Motion(attitudes, [(step.row.vehicle_stamp_us, scale * step.row.controls[3]) for step in steps])


def _shares(rows: Sequence[TraceRow]) -> dict[str, float]:
    counts = Counter(name for row in rows for name in row.limits)
    return {name: count / len(rows) for name, count in sorted(counts.items())}
