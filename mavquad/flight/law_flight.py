"""The law in flight: from a fresh pose to the controls on the wire, and the row that it leaves behind."""

from __future__ import annotations

import math

from mavquad.control.controller import ControllerState, StepResult, begin, observe_attitude, step
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.guards import tilt_rad
from mavquad.flight.mission import Mission, MissionParams
from mavquad.flight_record import TraceRow
from mavquad.protocol.firmware import px4
from mavquad.types import Attitude, Position, ReferencePoint, TorqueCommand, Vec3, Vec4

LEAST_THRUST_MARGIN = 1.05
"""A vehicle that hovers at nearly full thrust still gets this much to work with, as a share of its hover."""


class LawFlight:
    """Holds the law's state between poses.

    Until the vehicle takes our setpoints the law starts afresh at every pose: what goes out is its answer to the present
    pose, and no integrator winds up on commands that do not act.

    Attributes:
        in_control: whether the vehicle is believed to fly what we send.
    """

    def __init__(self, law: LawParams, airframe: AirframeParams, mission: MissionParams, hover: HoverThrust) -> None:
        self._configured_law = law
        self._law = law
        self._airframe = airframe
        self._mission_params = mission
        self._hover = hover
        self._state: ControllerState | None = None
        self._origin: Pose | None = None
        self._mission: Mission | None = None
        self.in_control = False

    @property
    def origin_nwu_m(self) -> Vec3:
        """Where the law took over."""
        return self._origin.position_nwu_m if self._origin else (0.0, 0.0, 0.0)

    def take_attitude(self, attitude: Attitude) -> None:
        """An attitude between two positions corrects the yaw channel."""
        if self._state is not None and self.in_control:
            self._state = observe_attitude(self._law, self._state, attitude)

    def start_mission(self, stamp_us: int) -> None:
        """Let the mission begin where the law took over, at this moment of the vehicle's clock."""
        assert self._origin is not None
        self._mission = Mission(self._mission_params, self._origin, stamp_us)

    def mission_over(self, stamp_us: int) -> bool:
        """Whether the mission's last moment has passed."""
        return self._mission is not None and self._mission.over(stamp_us)

    def progress_s(self, stamp_us: int) -> tuple[float, float]:
        """Time since the mission began, and its length; zeros before."""
        return (self._mission.elapsed_s(stamp_us), self._mission.duration_s) if self._mission else (0.0, 0.0)

    def step(self, position: Position, attitude: Attitude, now_us: int, phase: str) -> TraceRow:
        """One step on a fresh position. The row's `controls` are what must be sent now."""
        if self._state is None or not self.in_control:
            self._begin(position, attitude)
        assert self._state is not None and self._origin is not None
        reference = self._mission.reference(position.stamp_us) if self._mission else hold(self._origin)
        result = step(self._law, self._state, position, attitude, reference)
        self._state = result.state
        return self._row(result, now_us, phase, reference)

    def _begin(self, position: Position, attitude: Attitude) -> None:
        # The thrust that holds this hover: T cos(tilt) = g.
        trim_m_s2 = GRAVITY_M_S2 / math.cos(tilt_rad(attitude))
        self._law = within_controls(self._configured_law, self._airframe, self._hover.norm * trim_m_s2 / GRAVITY_M_S2)
        self._state = begin(self._law, position, attitude, trim_m_s2)
        self._origin = Pose(position.position_nwu_m, attitude.yaw_rad)

    def controls(self, command: TorqueCommand) -> Vec4:
        """A command of the law in the wire's units."""
        return px4.torque_controls(command, self._airframe.torque_scale_frd_rad_s2, self._hover.norm, GRAVITY_M_S2)

    def safe_controls(self) -> Vec4:
        """No rotation, hover thrust: what is held while a hand-back takes effect."""
        return (0.0, 0.0, 0.0, self._hover.norm)

    def _row(self, result: StepResult, now_us: int, phase: str, reference: ReferencePoint) -> TraceRow:
        trace = result.trace
        z, yaw, x, y = (channel[0] for channel in reference.channels())
        e_z, e_yaw, e_x, e_y = trace.error
        return TraceRow(
            stamp_us=now_us,
            vehicle_stamp_us=trace.stamp_us,
            phase=phase,
            measured=(z - e_z, yaw - e_yaw, x - e_x, y - e_y),
            reference=(z, yaw, x, y),
            zeta_hat=tuple((c[0], c[1], c[2], c[3]) for c in trace.zeta_hat),
            sigma=trace.sigma,
            demanded=trace.demanded,
            input=trace.inputs,
            controls=self.controls(result.command),
            limits=trace.limits_active,
        )


def within_controls(law: LawParams, airframe: AirframeParams, trim_thrust_norm: float) -> LawParams:
    """The law with its limits no wider than what the wire's controls can say (thrust 1, torque 1).

    A command cut behind the law's back would be one that its observer and its integrators never hear of.
    """
    roll, pitch, yaw = airframe.torque_scale_frd_rad_s2
    saturation, limits = law.saturation, law.limits
    full_share = max(1.0 / trim_thrust_norm, LEAST_THRUST_MARGIN)
    return law.model_copy(
        update={
            "saturation": saturation.model_copy(
                update={
                    "roll_rad_s2": min(saturation.roll_rad_s2, roll),
                    "pitch_rad_s2": min(saturation.pitch_rad_s2, pitch),
                }
            ),
            "limits": limits.model_copy(
                update={
                    "thrust_max_g": min(limits.thrust_max_g, full_share),
                    "yaw_acceleration_max_deg_s2": min(limits.yaw_acceleration_max_deg_s2, math.degrees(yaw)),
                }
            ),
        }
    )
