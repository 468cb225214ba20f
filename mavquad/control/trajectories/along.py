"""A curve flown from rest to rest: its phase rises smoothly, goes on at a rate of 1, and comes smoothly to its end.

The phase and four derivatives are zero or constant at both ends, so the reference is at rest there whatever the curve does.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavquad.control.trajectories.chain_rule import Five, composed
from mavquad.control.trajectories.curves import Curve
from mavquad.control.trajectories.heading import Heading, unwound
from mavquad.control.trajectories.step import Step, phase_boxcars, step

Channels = tuple[Five, Five, Five, Five]
"""z, yaw, x, y with four derivatives each; m and rad, NWU."""


@dataclass(frozen=True, slots=True)
class Along:
    """A flight along a curve, and the yaw: that of the curve's direction, or the one that the curve brings along."""

    start_us: int
    curve: Curve
    phase: Step
    heading: Heading | None

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return self.phase.duration_s


def along(start_us: int, curve: Curve, ramp_s: float, looks_from_rad: float | None) -> Along:
    """Fly a curve.

    Args:
        start_us: when it begins.
        curve: what is flown.
        ramp_s: how long it takes to come up to the curve's own pace, and to come to rest.
        looks_from_rad: the yaw is the curve's direction, of all its whole turns the one that begins nearest to this;
            None for the yaw that the curve brings along.

    Raises:
        NoHeading: the yaw is to be the direction of a curve that stands still or reverses somewhere.
    """
    phase = step(phase_boxcars(curve.length_s, ramp_s))
    heading = None if looks_from_rad is None else unwound(curve).near(looks_from_rad)
    return Along(start_us, curve, phase, heading)


def channels(flight: Along, stamp_us: int) -> Channels:
    """The channels at a moment; at rest before the start and after the end."""
    length = flight.curve.length_s
    p0, p1, p2, p3, p4 = flight.phase.at((stamp_us - flight.start_us) * 1e-6)
    phase = (p0 * length, p1 * length, p2 * length, p3 * length, p4 * length)
    point = flight.curve.at(phase[0])
    x, y, z, yaw = point
    turn = yaw if flight.heading is None else flight.heading.at(phase[0], point)
    return (composed(z, phase), composed(turn, phase), composed(x, phase), composed(y, phase))
