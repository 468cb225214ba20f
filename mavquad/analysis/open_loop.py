"""The law beside a flight that something else flies: it sees the measurements, is asked for its command, and is not obeyed.

After each of its commands it is told what acted instead (LAW: the observer is fed what acts, not what is sent in vain). So
each command is the law's answer to this moment with the true past behind it: no integrator winds up on commands that
nobody follows, and sigma is the disturbance of the vehicle and not the difference between two pilots.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from mavquad.control.controller import Controller
from mavquad.control.euler import euler_rates, trig
from mavquad.control.integrators import Integrator, driven
from mavquad.control.inversion import Gain, apply
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.tuning import Tuning
from mavquad.frames import unwrap_near, wrap_pi
from mavquad.types import Attitude, LawCommand, Vec4


class Acted(NamedTuple):
    """What acted in the place of one command.

    Attributes:
        inputs: U at the law's depth: thrust, yaw, roll, pitch, as `TraceRow.input`.
        thrust: thrust per mass and its derivative (m/s^2, m/s^3); None where the inputs integrate to it.
        yaw_rad: at depth attitude the yaw that acted (rad, NWU); None likewise.
    """

    inputs: Vec4
    thrust: tuple[float, float] | None = None
    yaw_rad: float | None = None


class OpenLoop(Controller):
    """The controller, told after each command what acted instead."""

    _asked_with: tuple[Gain, float, Integrator, Integrator]

    def _realised(self, gain: Gain, asked: Vec4, slowed: float) -> tuple[Vec4, Vec4, tuple[str, ...]]:
        self._asked_with = (gain, slowed, self._thrust, self._yaw_input)
        return super()._realised(gain, asked, slowed)

    def instead(self, acted: Acted) -> LawCommand:
        """Take back the latest command: this acted. Returns it as a command."""
        gain, slowed, thrust, yaw_input = self._asked_with
        drive, yaw, roll, pitch = acted.inputs
        self._thrust, self._yaw_input = driven(thrust, drive), driven(yaw_input, yaw)
        if acted.thrust is not None:
            self._thrust = Integrator(thrust.order, acted.thrust[0], acted.thrust[1], drive)
            gain = gain._replace(thrust_m_s2=acted.thrust[0], thrust_rate_m_s3=acted.thrust[1])
        if acted.yaw_rad is not None:
            self._yaw_sent_rad = wrap_pi(acted.yaw_rad)
            if gain.length == 2:
                gain = gain._replace(t=trig(0.0, 0.0, acted.yaw_rad))
        wz, wx, wy = apply(gain, (drive, roll, pitch))
        self._estimator.sent(self._arrive_us, (wz, yaw + slowed, wx, wy), self._thrust.value)
        return self._on_the_wire(gain, acted.inputs)


class Motion:
    """What the vehicle did, as commands that would have made it do so.

    Who flew it did not speak the law's language, or is not in the log: its commands are taken from the measured motion. A
    vehicle that turns at q now was told so a dead time and a lag ago; a lag is bridged as a delay of its length. At depth
    attitude the angles count, at depth rate the body rates, at depth torque their derivatives between two samples.
    """

    def __init__(self, attitudes: Sequence[Attitude], thrusts: Sequence[tuple[int, float]]) -> None:
        """Keep the motion.

        Args:
            attitudes: at least one, by increasing stamps.
            thrusts: thrust per mass (m/s^2) from a stamp of the same clock on; empty: the one that holds the hover.
        """
        self._attitudes = attitudes
        self._stamps_us = [attitude.stamp_us for attitude in attitudes]
        self._thrusts = thrusts
        self._thrust_stamps_us = [stamp_us for stamp_us, _ in thrusts]

    def acted(self, tune: Tuning, arrive_us: int) -> Acted:
        """What a command that arrived at this moment must have been."""
        place, turn = tune.horizontal.spec, tune.yaw.spec
        lean, lean_rates, lean_accelerations = self._at(arrive_us + place.dead_us + round(place.lag_s * 1e6))
        yaw_us = arrive_us + turn.dead_us + round(turn.lag_s * 1e6)
        facing, yaw_rate, yaw_acceleration = self._yaw(yaw_us)
        thrust, thrust_rate = self.thrust(arrive_us)
        if tune.depth == "attitude":
            return Acted((thrust, yaw_rate, lean[0], lean[1]), (thrust, thrust_rate), facing)
        roll, pitch = lean_rates[:2] if tune.depth == "rate" else lean_accelerations[:2]
        drive, yaw = (thrust_rate, yaw_rate) if tune.depth == "rate" else (0.0, yaw_acceleration)
        return Acted((drive, yaw, roll, pitch), (thrust, thrust_rate), facing)

    def _at(self, stamp_us: int) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """Angles, body rates and their derivatives, between two samples on a line; beyond the ends as there, at rest."""
        before, after, share, dt_s = self._around(stamp_us)
        one, other = _angles(before), _angles(after)
        angles = tuple(a + share * wrap_pi(b - a) for a, b in zip(one, other, strict=True))
        rates = tuple(a + share * (b - a) for a, b in zip(before.rates_flu_rad_s, after.rates_flu_rad_s, strict=True))
        slopes = tuple(
            (b - a) / dt_s if dt_s else 0.0 for a, b in zip(before.rates_flu_rad_s, after.rates_flu_rad_s, strict=True)
        )
        return angles, rates, slopes

    def _yaw(self, stamp_us: int) -> tuple[float, float, float]:
        """Yaw, its rate (of the Euler angle) and that one's derivative."""
        before, after, share, dt_s = self._around(stamp_us)
        rate, later = _yaw_rate(before), _yaw_rate(after)
        yaw_rad = before.yaw_rad + share * (unwrap_near(after.yaw_rad, before.yaw_rad) - before.yaw_rad)
        return yaw_rad, rate + share * (later - rate), (later - rate) / dt_s if dt_s else 0.0

    def _around(self, stamp_us: int) -> tuple[Attitude, Attitude, float, float]:
        """The samples before and after a moment, where between them it is (0 to 1), and their distance in s."""
        place = bisect_right(self._stamps_us, stamp_us)
        if place == 0 or place == len(self._attitudes):
            end = self._attitudes[0 if place == 0 else -1]
            return end, end, 0.0, 0.0
        before, after = self._attitudes[place - 1], self._attitudes[place]
        span_us = after.stamp_us - before.stamp_us
        return before, after, (stamp_us - before.stamp_us) / span_us, span_us * 1e-6

    def thrust(self, stamp_us: int) -> tuple[float, float]:
        """Thrust per mass and its derivative: commanded, on a line to the next one; or T cos(tilt) = g."""
        place = bisect_right(self._thrust_stamps_us, stamp_us)
        if place == 0 or place == len(self._thrusts):
            return (self._thrusts[0 if place == 0 else -1][1] if self._thrusts else self._hover(stamp_us)), 0.0
        (start_us, start), (end_us, end) = self._thrusts[place - 1 : place + 1]
        slope = (end - start) / ((end_us - start_us) * 1e-6)
        return start + slope * (stamp_us - start_us) * 1e-6, slope

    def _hover(self, stamp_us: int) -> float:
        (roll, pitch, _), _, _ = self._at(stamp_us)
        return GRAVITY_M_S2 / max(math.cos(roll) * math.cos(pitch), 0.3)


def _angles(attitude: Attitude) -> tuple[float, float, float]:
    return attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad


def _yaw_rate(attitude: Attitude) -> float:
    return euler_rates(trig(*_angles(attitude)), attitude.rates_flu_rad_s)[2]
