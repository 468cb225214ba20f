"""A curve flown from rest to rest: its phase rises smoothly, goes on at a rate of 1, and comes smoothly to its end.

The phase and four derivatives are zero or constant at both ends, so the reference is at rest there whatever the curve does.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.trajectories.chain_rule import Five, composed
from mavquad.control.trajectories.curves import Curve
from mavquad.control.trajectories.heading import Heading, unwound
from mavquad.control.trajectories.step import Step, phase_boxcars, step
from mavquad.frames import unwrap_near

Channels = tuple[Five, Five, Five, Five]
"""z, yaw, x, y with four derivatives each; m and rad, NWU."""


@dataclass(frozen=True, slots=True)
class Along:
    """A flight along a curve, and the yaw: that of the curve's direction, or the one that the curve brings along.

    `turns_rad` are whole turns that are added to it.
    """

    start_us: int
    curve: Curve
    phase: Step
    heading: Heading | None
    turns_rad: float

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return self.phase.duration_s


def along(start_us: int, curve: Curve, ramp_s: float, looks_along: bool, yaw_rad: float = 0.0) -> Along:
    """Fly a curve.

    Args:
        start_us: when it begins.
        curve: what is flown.
        ramp_s: how long it takes to come up to the curve's own pace, and to come to rest.
        looks_along: whether the yaw is the curve's direction, and not the one that the curve brings along.
        yaw_rad: the yaw so far; that of the flight begins within half a turn of it.

    Raises:
        NoHeading: the yaw is to be the direction of a curve that stands still or reverses somewhere.
    """
    phase = step(phase_boxcars(curve.length_s, ramp_s))
    heading = unwound(curve) if looks_along else None
    first_rad = heading.angles_rad[0] if heading else curve.at(0.0)[3][0]
    return Along(start_us, curve, phase, heading, unwrap_near(first_rad, yaw_rad) - first_rad)


def channels(flight: Along, stamp_us: int) -> Channels:
    """The channels at a moment; at rest before the start and after the end."""
    length = flight.curve.length_s
    p0, p1, p2, p3, p4 = flight.phase.at((stamp_us - flight.start_us) * 1e-6)
    phase = (p0 * length, p1 * length, p2 * length, p3 * length, p4 * length)
    point = flight.curve.at(phase[0])
    x, y, z, yaw = point
    turn = yaw if flight.heading is None else flight.heading.at(phase[0], point)
    t0, t1, t2, t3, t4 = composed(turn, phase)
    return (composed(z, phase), (t0 + flight.turns_rad, t1, t2, t3, t4), composed(x, phase), composed(y, phase))
