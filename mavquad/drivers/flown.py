"""What the law was given in a flight of ours, gathered while the flight is replayed: for another law to be put beside it."""

from __future__ import annotations

from mavquad.agent import Agent
from mavquad.agent_params import AgentParams
from mavquad.analysis.what_if import Flown, FlownMeasurement, FlownStep, FlownTarget
from mavquad.flight.guards import Tripped
from mavquad.flight.law_flight import Watched
from mavquad.flight.pose import PoseIntake
from mavquad.flight_record import TraceRow
from mavquad.protocol.codec import decode, frame_source, mavlink, message_id
from mavquad.tlog import Record
from mavquad.types import Attitude, Position


class Witness:
    """Looks at the agent after each of its inputs.

    Attributes:
        flown: what was seen.
    """

    def __init__(self, agent: Agent, params: AgentParams) -> None:
        self._agent = agent
        self._pose = PoseIntake(params.guards, agent.sync.age_us)
        self._refused = 0
        self._watched: Watched | None = None
        self._configured = params.law
        self.flown = Flown(params.airframe)

    def __call__(self, record: Record) -> None:
        """An inbound frame was taken in."""
        if self._was_refused() or frame_source(record.frame) != self._agent.link.vehicle:
            return
        number, law = message_id(record.frame), self._agent.law
        self._pose.choose(law.depth)
        taken: Attitude | Position | Tripped | None = None
        if number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            taken = self._pose.take_attitude(decode(record.frame), record.stamp_us)
        elif number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            taken = self._pose.take_position(decode(record.frame), record.stamp_us)
        if taken is not None and not isinstance(taken, Tripped):
            self.flown.inputs.append(FlownMeasurement(taken, law.in_control))
        elif number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            is_px4 = decode(record.frame).autopilot == mavlink.MAV_AUTOPILOT_PX4
            self.flown.autopilot = "px4" if is_px4 else "arducopter"
        if law.watched is not None and law.watched is not self._watched:
            self._watched = law.watched
            self.flown.inputs.append(FlownTarget(law.watched))
        for row in self._agent.take_trace():
            self._step(row, self._pose.authority(record.stamp_us))

    def _was_refused(self) -> bool:
        """Whether the link did not take the last frame: forged, or wrongly signed."""
        before, link = self._refused, self._agent.link
        self._refused = link.forged + link.rejected.total()
        return self._refused > before

    def _step(self, row: TraceRow, authority: float) -> None:
        law = self._agent.law
        self._pose.may_restart = False
        if not self.flown.hover_thrust_norm:
            self.flown.hover_thrust_norm = self._agent.status().hover_thrust_norm
            self.flown.found = self._configured.found(law.params)
        reference = law.reference(row.vehicle_stamp_us)
        self.flown.inputs.append(FlownStep(row, law.in_control, authority, reference))
