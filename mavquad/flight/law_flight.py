"""The law in flight: from fresh measurements to the controls on the wire, and the row that each step leaves behind."""

from __future__ import annotations

import math
from typing import NamedTuple

from mavquad.control.controller import Controller, Trace
from mavquad.control.defaults import Measurements
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.control.tuning import ACCELERATION, tuning
from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.guards import tilt_rad
from mavquad.flight.inner_loop import InnerLoop
from mavquad.flight.mission import Mission, MissionParams
from mavquad.flight_record import TraceRow
from mavquad.frames import euler_flipped
from mavquad.protocol.firmware import setpoints
from mavquad.protocol.streams import StreamParams
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    AttitudeTarget,
    Depth,
    LawCommand,
    Position,
    RateCommand,
    ReferencePoint,
    Vec3,
    Vec4,
)

LEAST_THRUST_MARGIN = 1.05
"""A vehicle that hovers at nearly full thrust still gets this much to work with, as a share of its hover."""
MOST_COMMANDS_IN_FLIGHT = 50
"""The law remembers so many."""
WATCHED_US = 1_000_000
"""The autopilot's own command counts for so long (PX4 1.16 pauses ATTITUDE_TARGET for 0.5 s when OFFBOARD begins)."""
TORQUE_ROOM = 0.9
"""Share of full thrust that the law may ask for: the rest turns the vehicle."""


class Watched(NamedTuple):
    """A command of the autopilot's own that the observer was fed.

    Attributes:
        stamp_us: from when on, by the vehicle's clock.
        command: of the law's depth.
        starts: whether the observer started afresh just before.
        hover_thrust_norm: as known then.
    """

    stamp_us: int
    command: RateCommand | AttitudeCommand
    starts: bool
    hover_thrust_norm: float


class LawFlight:
    """Holds the law's state between measurements.

    Until the vehicle takes our setpoints its integrators start afresh at every step: they do not wind up on commands that
    do not act. The observer runs already while the autopilot hovers, fed with the autopilot's own command (`watch`); where
    that is not shown (ATTITUDE_TARGET; torque has none) it starts afresh at every step too.

    Attributes:
        in_control: whether the vehicle is believed to fly what we send.
        depth: what the law commands.
        watched: the last command of the autopilot's own that the observer was fed, if any.
        steps_on_attitude: whether each ATTITUDE is answered by a command, and not each position: where it is measured, and
            not slower.
    """

    def __init__(
        self,
        law: LawParams,
        airframe: AirframeParams,
        mission: MissionParams,
        streams: StreamParams,
        hover: HoverThrust,
    ) -> None:
        self._own = self._law = law
        self._airframe = airframe
        self._mission_params = mission
        self._streams = streams
        self._hover = hover
        self._controller: Controller | None = None
        self._inner_loop: InnerLoop | None = None
        self._watched_us: int | None = None
        self.watched: Watched | None = None
        self._origin: Pose | None = None
        self._mission: Mission | None = None
        self.in_control = False
        self.choose(law, law.depths[0])

    @property
    def origin_nwu_m(self) -> Vec3:
        """Where the law took over."""
        return self._origin.position_nwu_m if self._origin else (0.0, 0.0, 0.0)

    @property
    def measurements(self) -> Measurements:
        """What the observer is corrected by."""
        return self._law.measured()

    def choose(self, law: LawParams, depth: Depth) -> None:
        """The law as it is for the vehicle that was met, and what it will command."""
        self._law, self.depth = law, depth
        self._controller, self._watched_us = None, None
        measured = tuning(self._law, depth).horizontal.row(ACCELERATION) > 0
        self.steps_on_attitude = measured and self._streams.attitude_hz >= self._streams.position_hz

    def take_attitude(self, attitude: Attitude) -> None:
        """An attitude corrects what it measures."""
        if self._controller is not None:
            self._controller.observe_attitude(attitude)
            if self.in_control:
                self._heed(attitude)

    def take_position(self, position: Position) -> None:
        """A position likewise."""
        if self._controller is not None:
            self._controller.observe_position(position)

    def _heed(self, attitude: Attitude) -> None:
        """The law goes on as the autopilot's inner loop is found to be."""
        assert self._controller is not None and self._inner_loop is not None
        better = self._inner_loop.answer(attitude)
        if better is not None:
            self._law = better
            self._controller.retune(within_controls(better, self._airframe, self._hover.norm))

    def take_words(self) -> str:
        """What was found out in flight since the last call; "" where nothing was."""
        if self._inner_loop is None:
            return ""
        words, self._inner_loop.words = self._inner_loop.words, ""
        return words

    def start_mission(self, stamp_us: int) -> None:
        """Let the mission begin where the law took over, at this moment of the vehicle's clock."""
        assert self._origin is not None
        self._mission = Mission(self._mission_params, self._origin, stamp_us)

    def fly(self, params: MissionParams, stamp_us: int) -> None:
        """Let another mission begin where the reference is at this moment of the vehicle's clock."""
        here = self.reference(stamp_us)
        pose = Pose((here.x_m[0], here.y_m[0], here.z_m[0]), here.yaw_rad[0])
        self._mission = Mission(params, pose, stamp_us)

    @property
    def params(self) -> LawParams:
        """The law, for the vehicle that was met."""
        return self._law

    def mission_over(self, stamp_us: int) -> bool:
        """Whether the mission's last moment has passed."""
        return self._mission is not None and self._mission.over(stamp_us)

    def progress_s(self, stamp_us: int) -> tuple[float, float]:
        """Time since the mission began, and its length; zeros before."""
        return (self._mission.elapsed_s(stamp_us), self._mission.duration_s) if self._mission else (0.0, 0.0)

    def step(self, position: Position, attitude: Attitude, now_us: int, phase: str, authority: float = 1.0) -> TraceRow:
        """One step on what was measured so far. The row's `controls` are what must be sent now.

        Args:
            position: the latest.
            attitude: the latest.
            now_us: when.
            phase: for the row.
            authority: see `Controller.command`.
        """
        if self._controller is None or self.watches or not self.in_control:
            self._begin(position, attitude)
        assert self._controller is not None
        command = self._controller.command(self.reference, authority, acts=not self.watches)
        if self._inner_loop is not None and not self.watches:
            self._inner_loop.command(command, self._controller.arrives_us)
        assert self._controller.trace is not None
        return self._row(command, self._controller.trace, now_us, phase)

    def reference(self, stamp_us: int) -> ReferencePoint:
        """What is flown to, at a moment of the vehicle's clock; the law must have taken over."""
        assert self._origin is not None
        return self._mission.reference(stamp_us) if self._mission else hold(self._origin)

    def watch(self, target: AttitudeTarget, position: Position, attitude: Attitude) -> None:
        """The autopilot flies by a command of its own, as its ATTITUDE_TARGET shows: the observer is fed that."""
        if self.depth == "torque":
            return
        starts = self._controller is None or not self._is_watching(target.stamp_us)
        if self._controller is None or starts:
            self._controller = self._started(position, attitude)
        self._watched_us = target.stamp_us
        thrust_m_s2 = target.thrust_norm / self._hover.norm * GRAVITY_M_S2
        command: RateCommand | AttitudeCommand = RateCommand(target.rates_flu_rad_s, thrust_m_s2)
        if self.depth == "attitude":
            command = AttitudeCommand(*target.euler_rad, thrust_m_s2)
        self._controller.acted(target.stamp_us, command)
        self.watched = Watched(target.stamp_us, command, starts, self._hover.norm)

    @property
    def watches(self) -> bool:
        """Whether the observer runs on the autopilot's own command."""
        return self._watched_us is not None

    def _is_watching(self, stamp_us: int) -> bool:
        return self._watched_us is not None and stamp_us - self._watched_us <= WATCHED_US

    def _begin(self, position: Position, attitude: Attitude) -> None:
        """The law's answer to the present pose counts for the first time, or does not count yet."""
        if self._controller is not None and self._is_watching(position.stamp_us):
            self._controller.begin(attitude, _trim_m_s2(attitude))
        else:
            self._controller, self._watched_us = self._started(position, attitude), None
        if self.in_control:
            self._watched_us = None
        self._origin = Pose(position.position_nwu_m, attitude.yaw_rad)

    def _started(self, position: Position, attitude: Attitude) -> Controller:
        self._inner_loop = InnerLoop(self._own, self._law, self.depth)
        law = within_controls(self._inner_loop.law, self._airframe, self._hover.norm)
        return Controller(law, self.depth, position, attitude, _trim_m_s2(attitude))

    def controls(self, command: LawCommand) -> Vec4:
        """A command of the law in the wire's units."""
        return setpoints.controls(command, self._airframe.torque_scale_frd_rad_s2, self._hover.norm, GRAVITY_M_S2)

    def safe_controls(self, attitude: Attitude | None) -> Vec4:
        """No rotation, hover thrust: what is held while a hand-back takes effect."""
        yaw_ned_rad = 0.0
        if attitude is not None:
            _, _, yaw_ned_rad = euler_flipped(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
        return setpoints.safe_controls(self.depth, self._hover.norm, yaw_ned_rad)

    def _row(self, command: LawCommand, trace: Trace, now_us: int, phase: str) -> TraceRow:
        return TraceRow(
            now_us,
            trace.stamp_us,
            phase,
            trace.measured,
            trace.reference,
            trace.zeta_hat,
            trace.sigma,
            trace.wind,
            trace.demanded,
            trace.inputs,
            self.controls(command),
            trace.limits_active,
        )


def _trim_m_s2(attitude: Attitude) -> float:
    """The thrust that holds this hover: T cos(tilt) = g."""
    return GRAVITY_M_S2 / math.cos(tilt_rad(attitude))


def within_controls(law: LawParams, airframe: AirframeParams, hover_thrust_norm: float) -> LawParams:
    """The law with its limits no wider than what the wire's controls can say (thrust 1, torque 1).

    A command cut behind the law's back would be one that its observer and its integrators never hear of.
    """
    roll, pitch, yaw = airframe.torque_scale_frd_rad_s2
    saturation, limits = law.saturation, law.limits
    full_share = max(TORQUE_ROOM / hover_thrust_norm, LEAST_THRUST_MARGIN)
    return law.model_copy(
        update={
            "saturation": saturation.model_copy(
                update={"roll_pitch_rad_s2": min(saturation.roll_pitch_rad_s2, roll, pitch)}
            ),
            "limits": limits.model_copy(
                update={
                    "thrust_max_g": min(limits.thrust_max_g, full_share),
                    "yaw_acceleration_max_deg_s2": min(limits.yaw_acceleration_max_deg_s2, math.degrees(yaw)),
                }
            ),
        }
    )
