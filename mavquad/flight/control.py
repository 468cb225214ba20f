"""The law in force: pose messages in, setpoints out, under guards; and the safe setpoints after a guard has tripped."""

from __future__ import annotations

from mavquad.control.params import LawParams
from mavquad.endpoint import NEVER_US
from mavquad.flight.echo import Echo
from mavquad.flight.guard_set import GuardSet
from mavquad.flight.guards import GuardParams, Tripped, check
from mavquad.flight.law_flight import LawFlight
from mavquad.flight.pose import PoseIntake
from mavquad.flight_record import TraceRow
from mavquad.protocol.codec import Message
from mavquad.protocol.firmware import setpoints
from mavquad.protocol.timesync import TimeSync
from mavquad.types import Attitude, Depth, Position

SAFE_US = 20_000
"""Between two safe setpoints."""

Target = tuple[int, int]


class Control:
    """What flies the vehicle while the law may.

    Attributes:
        law: from measurements to controls.
        pose: what was measured.
        guards: those that watch more than the latest pose; fed from the first message on.
        echo: what the autopilot shows of our setpoints while it is not yet sure that it follows them.
        on: whether the law answers measurements with setpoints.
        last_row: of the law's last step; None before the first.
        sent: setpoints of the law.
        safe_sent: setpoints that ask for hover thrust and no rotation.
    """

    def __init__(self, guards: GuardParams, law: LawFlight, sync: TimeSync) -> None:
        self._guards = guards
        self._trace: list[TraceRow] = []
        self._safe_us = NEVER_US
        self.law = law
        self.pose = PoseIntake(guards, sync.age_us)
        self.guards = GuardSet(guards)
        self.echo = Echo()
        self.on = False
        self.last_row: TraceRow | None = None
        self.sent = 0
        self.safe_sent = 0

    def take_trace(self) -> list[TraceRow]:
        """The rows since the last call."""
        trace, self._trace = self._trace, []
        return trace

    # ------------------------------------------------------------------ deadlines

    def next_deadline_us(self) -> int:
        """When the pose becomes too old, or the next safe setpoint is due."""
        if not self.on:
            return self._safe_us
        return min(self.pose.stale_deadline_us(), self.guards.next_deadline_us())

    def silence(self, now_us: int) -> Tripped | None:
        """The guard that trips because something did not come in time, while the law is on."""
        if not self.on:
            return None
        stale = self.pose.stale(now_us) if now_us >= self.pose.stale_deadline_us() else None
        return stale or self.guards.on_deadline(now_us)

    # ------------------------------------------------------------------ the law

    def take_attitude(self, message: Message, now_us: int) -> Attitude | Tripped | None:
        """An ATTITUDE; None if it is old."""
        attitude = self.pose.take_attitude(message, now_us)
        if isinstance(attitude, Attitude):
            self.law.take_attitude(attitude)
        return attitude

    def take_position(self, message: Message, now_us: int) -> Position | Tripped | None:
        """A LOCAL_POSITION_NED; None if it is old."""
        return self.pose.take_position(message, now_us)

    def start(self, attitude_hz: float, position_hz: float, now_us: int, round_trip_s: float | None) -> None:
        """The law answers measurements from now on, which go on coming at these rates, over a link of this round trip."""
        self.on = True
        self.echo.restart(wanted=not self.law.in_control)
        self.guards.begin(attitude_hz, position_hz, now_us, round_trip_s)

    def checked(self, ground_m: float) -> Tripped | None:
        """The first guard that the latest pose trips."""
        attitude, position = self.pose.attitude, self.pose.position
        if not self.on or not self.law.in_control or attitude is None or position is None:
            return None
        return check(self._guards, attitude, position, self.law.origin_nwu_m, ground_m)

    def choose(self, law: LawParams, depth: Depth) -> None:
        """The law as it is for the vehicle that was met, and what it will command."""
        self.law.choose(law, depth)
        self.pose.choose(depth)

    def step(self, target: Target, phase: str, now_us: int) -> Message | Tripped | None:
        """The law's answer to the latest pose, or the guard that it trips; None while it is off, or the pose is not whole."""
        attitude, position = self.pose.attitude, self.pose.position
        if not self.on or attitude is None or position is None:
            return None
        row = self.law.step(position, attitude, now_us, phase, self.pose.authority(now_us))
        self.last_row = row
        self._trace.append(row)
        tripped = self.guards.on_row(row)
        if tripped is not None:
            return tripped
        self.sent += 1
        setpoint = setpoints.setpoint(now_us, self.law.depth, row.controls, *target)
        self.echo.sent(setpoint)
        return setpoint

    # ------------------------------------------------------------------ after the law

    def stop(self) -> None:
        """Nothing is sent any more."""
        self.on = False
        self._safe_us = NEVER_US

    def make_safe(self, now_us: int) -> None:
        """The law is off; safe setpoints are due from now on, since the firmwares hold the last command."""
        self.on = False
        self._safe_us = min(self._safe_us, now_us + SAFE_US) if self._safe_us != NEVER_US else now_us

    def safe_due(self, target: Target, now_us: int) -> Message | None:
        """The safe setpoint, when it is due."""
        if now_us < self._safe_us:
            return None
        self._safe_us = now_us + SAFE_US
        self.safe_sent += 1
        return self.safe(target, now_us)

    def safe(self, target: Target, now_us: int) -> Message:
        """No rotation, hover thrust."""
        controls = self.law.safe_controls(self.pose.attitude)
        return setpoints.setpoint(now_us, self.law.depth, controls, *target)
