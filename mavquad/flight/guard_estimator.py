"""Guard of what the autopilot says of its own estimator: ESTIMATOR_STATUS (PX4), EKF_STATUS_REPORT (ArduPilot).

The two messages share the bits that matter here (ESTIMATOR_STATUS_FLAGS, EKF_STATUS_FLAGS). In the air real PX4 shows 831
or 895 (as it is near the ground or not), ArduPilot 831; a PX4 1.16 on the ground also the constant-position bit.
"""

from __future__ import annotations

from pydantic import Field

from mavquad.endpoint import grid_us
from mavquad.flight.guard_types import GuardSection, Lasting, Tripped
from mavquad.protocol.codec import Message, mavlink

_NEEDED = (
    (mavlink.ESTIMATOR_ATTITUDE, "attitude"),
    (mavlink.ESTIMATOR_VELOCITY_HORIZ, "horizontal velocity"),
    (mavlink.ESTIMATOR_VELOCITY_VERT, "vertical velocity"),
    (mavlink.ESTIMATOR_POS_HORIZ_REL | mavlink.ESTIMATOR_POS_HORIZ_ABS, "horizontal position"),
    (mavlink.ESTIMATOR_POS_VERT_ABS | mavlink.ESTIMATOR_POS_VERT_AGL, "height"),
)


class EstimatorParams(GuardSection):
    """[guards.estimator]"""

    for_s: float = Field(default=0.4, ge=0.0, le=60.0)
    """How long its flags must show it unfit, s; 0: off. Where the vehicle sends neither ESTIMATOR_STATUS nor
    EKF_STATUS_REPORT, this guard says nothing."""


class EstimatorMonitor:
    """The flags as last heard.

    Attributes:
        flags: None before the first message.
    """

    def __init__(self, params: EstimatorParams) -> None:
        self._params = params
        self._unfit = Lasting(grid_us(params.for_s))
        self.flags: int | None = None

    def take(self, message: Message, now_us: int) -> Tripped | None:
        """The next ESTIMATOR_STATUS or EKF_STATUS_REPORT."""
        self.flags = message.flags
        words = unfit(message.flags)
        if not self._unfit.holds(bool(words), now_us) or self._params.for_s == 0.0:
            return None
        return Tripped("estimator", f"the autopilot's estimator {words}", self._params.reaction)


def unfit(flags: int) -> str:
    """What its flags say is wrong with an estimator in flight, in words; empty where nothing is."""
    missing = [name for bits, name in _NEEDED if not flags & bits]
    if missing:
        return f"has lost its {', '.join(missing)}"
    if flags & mavlink.ESTIMATOR_CONST_POS_MODE:
        return "knows no position (constant-position mode)"
    return ""
