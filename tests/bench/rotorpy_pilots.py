"""The pilots of `rotorpy_se3.py`: rotorpy's SE3 controller, and the law at its depths, flying the same plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.px4_sihsim_quadx_params import quad_params
from scipy.spatial.transform import Rotation

from mavquad.control.controller import Controller
from mavquad.control.params import LawParams
from mavquad.schema import parse_section
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    Depth,
    LawCommand,
    Position,
    RateCommand,
    ReferencePoint,
    TorqueCommand,
)
from tests.bench.rotorpy_plant import (
    MOTOR_LAG_S,
    TOLD_HOVER_N,
    TOLD_INERTIA_KG_M2,
    TOLD_MASS_KG,
    Control,
    Pilot,
    State,
    place,
)

Reference = Callable[[int], ReferencePoint]

ABSTRACTIONS: dict[Depth, str] = {"torque": "cmd_ctbm", "rate": "cmd_ctbr", "attitude": "cmd_ctatt"}


class SE3Pilot:
    """rotorpy's geometric controller with its own gains, told the nominal mass, from the full state."""

    def __init__(self, abstraction: str, period_us: int, reference: Reference) -> None:
        self.abstraction = abstraction
        self.period_us = period_us
        self._reference = reference
        self._controller = SE3Control(quad_params)

    def command(self, stamp_us: int, state: State) -> Control:
        """Its whole answer; the plant takes from it what its abstraction wants."""
        point = self._reference(stamp_us)
        flat = {f"x{name}": place(point, i) for i, name in enumerate(("", "_dot", "_ddot", "_dddot", "_ddddot"))}
        flat |= {"yaw": point.yaw_rad[0], "yaw_dot": point.yaw_rad[1]}
        return self._controller.update(stamp_us * 1e-6, state, flat)


def measured(stamp_us: int, state: State) -> tuple[Position, Attitude]:
    """The plant's true state as the law's measurements."""
    yaw, pitch, roll = Rotation.from_quat(state["q"]).as_euler("ZYX").tolist()
    x, v, w = (tuple(state[key].tolist()) for key in ("x", "v", "w"))
    return Position(stamp_us, x, v), Attitude(stamp_us, roll, pitch, yaw, w)


def control_of(command: LawCommand) -> Control:
    """A command of the law as rotorpy's, by way of the mass and inertia told."""
    control: Control = {"cmd_thrust": TOLD_MASS_KG * command.specific_thrust_m_s2}
    match command:
        case TorqueCommand():
            control["cmd_moment"] = TOLD_INERTIA_KG_M2 * np.array(command.angular_acceleration_flu_rad_s2)
        case RateCommand():
            control["cmd_w"] = np.array(command.rates_flu_rad_s)
        case AttitudeCommand():
            angles = (command.yaw_rad, command.pitch_rad, command.roll_rad)
            control["cmd_q"] = Rotation.from_euler("ZYX", angles).as_quat()
    return control


class LawPilot:
    """The law; all its measurements come at the rate of its commands. It takes over in the first of them."""

    def __init__(self, params: LawParams, depth: Depth, period_us: int, reference: Reference) -> None:
        self.abstraction = ABSTRACTIONS[depth]
        self.period_us = period_us
        self._params = params
        self._depth = depth
        self._reference = reference
        self._controller: Controller | None = None

    def command(self, stamp_us: int, state: State) -> Control:
        """From the state of this moment."""
        position, attitude = measured(stamp_us, state)
        if self._controller is None:
            hover_m_s2 = TOLD_HOVER_N / TOLD_MASS_KG
            self._controller = Controller(self._params, self._depth, position, attitude, hover_m_s2)
        else:
            self._controller.observe_attitude(attitude)
            self._controller.observe_position(position)
        return control_of(self._controller.command(self._reference))


@dataclass(frozen=True, slots=True)
class Column:
    """One column of the table.

    Attributes:
        title: its heading.
        depth: what the pilot commands.
        rate_hz: of measurements and commands.
        law: the keys of [law] that differ from its defaults; None for SE3.
    """

    title: str
    depth: Depth = "torque"
    rate_hz: int = 250
    law: dict[str, Any] | None = None


TOLD: dict[Depth, dict[str, float]] = {
    "torque": {"lag_s": MOTOR_LAG_S, "yaw_lag_s": MOTOR_LAG_S, "dead_time_s": 0.0, "yaw_dead_time_s": 0.0},
    "rate": {"lag_s": 0.03, "yaw_lag_s": 0.03, "dead_time_s": 0.02, "yaw_dead_time_s": 0.02},
    "attitude": {"lag_s": 0.17, "yaw_lag_s": 0.17, "dead_time_s": 0.014, "yaw_dead_time_s": 0.014},
}
"""How this plant answers at each depth: the motors' lag; rotorpy's inner loops with the gains of `rotorpy_plant`, behind it.
Drag is quadratic here, and none acts on the rotation: the law is told of no friction."""


def law(depth: Depth, measurements: str, **more: Any) -> dict[str, Any]:
    """[law] of a column: the gains are the depth's own defaults."""
    plant = {**TOLD[depth], "thrust_lag_s": MOTOR_LAG_S, "friction_1_s": 0.0, "angular_friction_1_s": 0.0}
    return {"depth": depth, "measurements": measurements, **plant, **more}


COLUMNS: dict[str, Column] = {
    "se3": Column("SE3"),
    "se3-attitude": Column("SE3, attitude", depth="attitude"),
    "torque-yaw": Column("torque, position + yaw", law=law("torque", "position_yaw")),
    "torque-attitude": Column("torque, + attitude", law=law("torque", "position_attitude")),
    "torque": Column("torque, full", law=law("torque", "full")),
    "torque-100": Column("torque, full, 100 Hz", rate_hz=100, law=law("torque", "full")),
    "rate": Column("rate, full", depth="rate", law=law("rate", "full")),
    "rate-100": Column("rate, full, 100 Hz", depth="rate", rate_hz=100, law=law("rate", "full")),
    "attitude": Column("attitude, full", depth="attitude", law=law("attitude", "full")),
}


def pilot_of(column: Column, reference: Reference, delay_us: int, overrides: dict[str, Any]) -> Pilot:
    """A pilot at the start of its flight; the law is told the delay unless an override tells it another."""
    period_us = round(1e6 / column.rate_hz)
    if column.law is None:
        return SE3Pilot(ABSTRACTIONS[column.depth], period_us, reference)
    table = {**column.law, "delay_s": delay_us * 1e-6, **overrides}
    return LawPilot(parse_section(LawParams, table, "the bench", "law"), column.depth, period_us, reference)
