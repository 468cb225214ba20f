"""All guards but those of the pose itself (age, tilt, volume), as one thing to feed: each input says which guard it trips.

The guards are fed from the first message on, so that they know what was before the law took over; what trips while the law
does not fly is for the caller to leave aside, or, on the ground, to take as a reason to wait (`not_ready`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from mavquad.flight.guard_battery import BatteryMonitor, BatteryParams
from mavquad.flight.guard_estimator import EstimatorMonitor, EstimatorParams
from mavquad.flight.guard_law import (
    InnovationMonitor,
    InnovationParams,
    NanParams,
    SigmaMonitor,
    SigmaParams,
    no_number,
)
from mavquad.flight.guard_link import GcsLossMonitor, GcsLossParams, LinkLossMonitor, LinkLossParams
from mavquad.flight.guard_motion import JumpMonitor, JumpParams, SpeedParams, fast
from mavquad.flight.guard_timing import LatenessMonitor, LatenessParams, RateMonitor, RateParams
from mavquad.flight.guard_types import Tripped
from mavquad.flight_record import TraceRow
from mavquad.protocol.codec import Message, mavlink
from mavquad.schema import Section
from mavquad.types import Attitude, Position


class GuardSections(Section):
    """The tables of [guards]."""

    speed: SpeedParams = SpeedParams()
    """How fast it may fly."""
    jump: JumpParams = JumpParams()
    """An estimate that jumps: the autopilot's estimator was reset."""
    estimator: EstimatorParams = EstimatorParams()
    """What the autopilot says of its estimator."""
    sigma: SigmaParams = SigmaParams()
    """The disturbance that the law's observer estimates."""
    innovation: InnovationParams = InnovationParams()
    """How far what is measured is from what the observer expects."""
    battery: BatteryParams = BatteryParams()
    """The battery."""
    link_loss: LinkLossParams = LinkLossParams()
    """Frames lost, and the round trip."""
    gcs_loss: GcsLossParams = GcsLossParams()
    """A ground station that must be there."""
    rate: RateParams = RateParams()
    """How often the pose must come."""
    lateness: LatenessParams = LatenessParams()
    """How late our own setpoints may be."""
    nan: NanParams = NanParams()
    """An output of the law that is no number."""


class GuardSet:
    """The monitors of one flight.

    Attributes:
        gcs: the ground station's.
    """

    def __init__(self, params: GuardSections) -> None:
        self._params = params
        self._jump = JumpMonitor(params.jump)
        self._estimator = EstimatorMonitor(params.estimator)
        self._sigma = SigmaMonitor(params.sigma)
        self._innovation = InnovationMonitor(params.innovation)
        self._battery = BatteryMonitor(params.battery)
        self._link = LinkLossMonitor(params.link_loss)
        self._attitudes = RateMonitor(params.rate, "ATTITUDE")
        self._positions = RateMonitor(params.rate, "LOCAL_POSITION_NED")
        self._lateness = LatenessMonitor(params.lateness)
        self.gcs = GcsLossMonitor(params.gcs_loss)

    def begin(self, attitude_hz: float, position_hz: float, now_us: int, round_trip_s: float | None = None) -> None:
        """The law takes over; these rates are expected to go on, and a round trip over the link, where it was measured."""
        self._attitudes.start(attitude_hz, now_us)
        self._positions.start(position_hz, now_us)
        self.gcs.start(now_us)
        if round_trip_s is not None:
            self._link.start(round_trip_s)

    def not_ready(self) -> str:
        """Why the law should not be let fly, in words; empty where nothing speaks against it."""
        if self.gcs.is_missing:
            return "no HEARTBEAT of a ground station (guards.gcs_loss)"
        return next(iter(self._battery.low.values()), "")

    # ------------------------------------------------------------------ inputs: each says which guard it trips

    def on_position(self, position: Position, now_us: int) -> Tripped | None:
        """A fresh measurement."""
        return _first(
            fast(self._params.speed, position), self._jump.take_position(position), self._positions.take(now_us)
        )

    def on_attitude(self, attitude: Attitude, now_us: int) -> Tripped | None:
        """A fresh measurement."""
        return _first(self._jump.take_attitude(attitude), self._attitudes.take(now_us))

    def on_row(self, row: TraceRow) -> Tripped | None:
        """A step of the law, before it is sent."""
        return _first(no_number(self._params.nan, row.controls), self._sigma.take(row), self._innovation.take(row))

    def on_message(self, message: Message, now_us: int) -> Tripped | None:
        """One of `MESSAGES`."""
        return self.MESSAGES[message.get_msgId()](self, message, now_us)

    def on_frame(self, sequence: int, now_us: int) -> Tripped | None:
        """Any frame of the vehicle, by its sequence number."""
        return self._link.take(sequence, now_us)

    def on_round_trip(self, round_trip_us: int) -> Tripped | None:
        """An answer to a TIMESYNC of ours."""
        return self._link.take_round_trip(round_trip_us)

    def on_late(self, lateness_us: int, now_us: int) -> Tripped | None:
        """The driver tells that a setpoint left late."""
        return self._lateness.take(lateness_us, now_us)

    def next_deadline_us(self) -> int:
        """When a silence will trip a guard."""
        return self.gcs.next_deadline_us()

    def on_deadline(self, now_us: int) -> Tripped | None:
        """Whether one has."""
        return self.gcs.check(now_us)

    # ------------------------------------------------------------------ messages

    def _take_estimator(self, message: Message, now_us: int) -> Tripped | None:
        return self._estimator.take(message, now_us)

    def _take_battery(self, message: Message, now_us: int) -> Tripped | None:
        return self._battery.take_battery(message, now_us)

    def _take_sys_status(self, message: Message, now_us: int) -> Tripped | None:
        return self._battery.take_sys_status(message, now_us)

    MESSAGES: ClassVar[dict[int, Callable[[GuardSet, Message, int], Tripped | None]]] = {
        mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: _take_estimator,
        mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: _take_estimator,
        mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: _take_battery,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS: _take_sys_status,
    }
    """What the guards read, by message id."""


def _first(*tripped: Tripped | None) -> Tripped | None:
    """The first that tripped; all were asked, so that none misses an input."""
    return next((each for each in tripped if each is not None), None)
