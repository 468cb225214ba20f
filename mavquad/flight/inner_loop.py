"""The autopilot's inner loop as it is on this vehicle: the law counts on what its answers show.

The law is told how late the autopilot answers in roll and pitch, T_told = dead time + lag, and its gains were chosen for that.
Rotors, inertia and the autopilot's own gains make it another time T on another vehicle, and its answer may have a peak M.
Where T or M is found to be another one,

    dead time = lag = T / 2,    every gain (omega0 and all kappas) / c,    c = max(1, (T + d) / (T_told + d)) max(1, M / M_0)

with d the usual delay of the link: a loop all of whose times are c times as long and whose gains are c times as low is the
same loop, slower, with the same margins; and a loop that is lower by M where the answer has its peak bears it. Until the first
answers have told, about a second, c is `FIRST_SLOWER`. Gains above those that the law is told are never flown.
"""

from __future__ import annotations

from mavquad.control.euler import trig
from mavquad.control.inversion import to_world
from mavquad.control.params import LawParams
from mavquad.control.response import Late, ResponseMeter
from mavquad.control.tuning import Tuning, tuning
from mavquad.types import Attitude, AttitudeCommand, Depth, LawCommand, RateCommand

TOLERATED = 0.25
"""Part by which T + d, or c, may be another one."""
SURE = 3.0
"""Standard deviations of T must be less than that."""
UNEXPLAINED: dict[Depth, float] = {"rate": 0.4, "attitude": 0.15}
"""Of a motion that is less the commands' doing than this nothing is learned."""
LEAST_MOVED: dict[Depth, float] = {"rate": 0.02, "attitude": 0.005}
"""rad/s or rad: what the commands must do to teach anything. A real ArduCopter 4.6.3 in a calm hover moves by 0.002 rad/s, as
much by itself as by command: its answer of 30 ms then looks like one of 150."""
USUAL_PEAK = 1.2
MOST_SLOWER = 2.5
"""No quadcopter that flies at all wants more, but a poor excitation may say so."""
FIRST_SLOWER = 2.0
PATIENCE_US = 3_000_000
"""Where nothing is learned in this time, nothing moves: it goes on as it is told."""
LEAST_S = 0.02
_GAINS = ("omega0_rad_s", "kappa_rad_s", "velocity_kappa_rad_s", "attitude_kappa_rad_s", "rates_kappa_rad_s")


class InnerLoop:
    """Looks at commands and answers from the hand-over on.

    Attributes:
        law: what is flown.
        words: what was found and changed, to be told once; "" where there is nothing to tell.
    """

    def __init__(self, own: LawParams, law: LawParams, depth: Depth) -> None:
        """Args: the law as configured, whose open keys are ours to fill; as it is flown so far; what it commands."""
        self._own, self._law, self._depth = own, law, depth
        told = tuning(law, depth).horizontal.spec
        self._told_s = self._counted_s = told.dead_us * 1e-6 + told.lag_s
        self._slower, self._asked = 1.0, MOST_SLOWER
        self._since_us = 0
        self._first = self._may()
        self._meter = ResponseMeter(self._told_s) if self._first else None
        self.law = law.model_copy(update=self._gains(FIRST_SLOWER)) if self._first else law
        self.words = ""

    def _may(self) -> bool:
        is_open = self._own.dead_time_s is None and self._own.lag_s is None
        observes = self._own.form == "output_feedback" and self._depth != "torque"
        return is_open and observes and self._own.inner_loop == "measured"

    def command(self, command: LawCommand, arrive_us: int) -> None:
        """What was sent, and when it acts."""
        if self._meter is None:
            return
        if isinstance(command, RateCommand):
            roll, pitch, _ = command.rates_flu_rad_s
            self._meter.command(arrive_us, roll, pitch)
        elif isinstance(command, AttitudeCommand):
            self._meter.command(arrive_us, *_lean(command.roll_rad, command.pitch_rad, command.yaw_rad))

    def answer(self, attitude: Attitude) -> LawParams | None:
        """What was measured; the law that it calls for, where that is another one than is flown."""
        if self._meter is None:
            return None
        if self._depth == "rate":
            roll, pitch, _ = attitude.rates_flu_rad_s
        else:
            roll, pitch = _lean(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
        late = self._meter.answer(attitude.stamp_us, roll, pitch)
        self._since_us = self._since_us or attitude.stamp_us
        if late is not None and self._teaches(late) and self._is_other(late):
            return self._changed()
        if self._first and attitude.stamp_us - self._since_us > PATIENCE_US:
            return self._changed()
        return None

    def _teaches(self, late: Late) -> bool:
        return late.unexplained <= UNEXPLAINED[self._depth] and late.moved >= LEAST_MOVED[self._depth]

    def _is_other(self, late: Late) -> bool:
        """Whether the law must change for this."""
        usual_s = self._law.own(self._depth).delay_s
        expected_s = self._told_s + usual_s
        if SURE * late.deviation_s > TOLERATED * expected_s:
            return False
        # Whole milliseconds: what is commanded must not hang on the last bits of a library's sums.
        most_s = MOST_SLOWER * expected_s - usual_s
        found_s = min(max(round(late.delay_s, 3), LEAST_S), most_s)
        if self._depth == "attitude":
            # The law is slow there, and bears an answer that is quicker than it expects.
            found_s = max(found_s, self._told_s)
        stretched = (found_s + usual_s) / expected_s
        # The first time at once; later the least that two in a row ask for.
        asked = min(round(stretched * max(1.0, late.peak / USUAL_PEAK), 2), MOST_SLOWER)
        slower, self._asked = max(self._slower, min(asked, self._asked)), asked
        is_other = abs(found_s - self._counted_s) > TOLERATED * (self._counted_s + usual_s)
        if slower < (1.0 + TOLERATED) * self._slower and not (is_other and stretched <= slower):
            return self._first
        self._counted_s, self._slower = found_s, slower
        return True

    def _changed(self) -> LawParams:
        self._first = False
        found_s, slower = self._counted_s, self._slower
        self.law = self._law.model_copy(update=self._gains(slower))
        if found_s != self._told_s:
            told = f"{self._told_s * 1e3:.0f} expected"
            words = f"gains divided by {slower:g}" if self.law != self._law else "gains as they were"
            self.words = f"roll and pitch answer {found_s * 1e3:.0f} ms after a command, {told}: {words}"
            self.law = self.law.model_copy(update={"dead_time_s": found_s / 2, "lag_s": found_s / 2})
        return self.law

    def _gains(self, slower: float) -> dict[str, float]:
        if slower == 1.0 or self._own.omega0_rad_s is not None:
            return {}
        flown = gains_of(self._law, tuning(self._law, self._depth))
        return {key: value / slower for key, value in flown.items() if getattr(self._own, key) is None}


def gains_of(law: LawParams, tune: Tuning) -> dict[str, float]:
    """The gains of x, y and z in force, by their keys; those of rows that are not measured are left out."""
    omega0 = law.omega0_rad_s or law.own(tune.depth).omega0_rad_s
    return {_GAINS[0]: omega0, **{_GAINS[1 + row.index]: row.kappa_rad_s for row in tune.horizontal.spec.rows}}


def _lean(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float]:
    """Where the thrust points, north and west: unlike roll and pitch, the same while the vehicle turns in wind."""
    north, west, _ = to_world(trig(roll_rad, pitch_rad, yaw_rad), (0.0, 0.0, 1.0))
    return north, west
