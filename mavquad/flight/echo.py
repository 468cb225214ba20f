"""Whether the autopilot follows our setpoints, seen in its ATTITUDE_TARGET long before HEARTBEAT tells it.

PX4 shows there what its inner loops are told: at depth rate our three body rates, at depth attitude our quaternion, as the
32-bit floats that we sent. Its own control never meets one of our latest setpoints in all of them by accident. Torque has
no echo.
"""

from __future__ import annotations

from collections import deque

from mavquad.protocol.codec import Message
from mavquad.protocol.firmware.setpoints import IGNORE_ATTITUDE

LATEST = 100
"""Setpoints that an echo may be of: a second of them at 100 Hz."""
CLOSE = 1e-5
"""32-bit rounding, and that of a quaternion made unit again."""
MOVES_RAD_S = 1e-3
"""Rates that are all smaller than this may be anybody's."""


class Echo:
    """Compares what is shown with what was sent.

    Attributes:
        wanted: whether it is still unknown if the autopilot follows.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[float, ...]] = deque(maxlen=LATEST)
        self.wanted = False

    def restart(self, wanted: bool) -> None:
        """The law is let on: forget what was before. `wanted`: whether the autopilot has yet to follow."""
        self._sent.clear()
        self.wanted = wanted

    def sent(self, setpoint: Message) -> None:
        """A setpoint went out."""
        if not self.wanted or setpoint.get_type() != "SET_ATTITUDE_TARGET":
            return
        rates = (setpoint.body_roll_rate, setpoint.body_pitch_rate, setpoint.body_yaw_rate)
        self._sent.append(rates if setpoint.type_mask & IGNORE_ATTITUDE else tuple(setpoint.q))

    def shows(self, target: Message) -> bool:
        """Whether an ATTITUDE_TARGET is one of them."""
        rates = (target.body_roll_rate, target.body_pitch_rate, target.body_yaw_rate)
        moves = max(map(abs, rates)) > MOVES_RAD_S
        return any(
            _same(sent, rates) if len(sent) == len(rates) else _same_turn(sent, target.q)
            for sent in self._sent
            if moves or len(sent) != len(rates)
        )


def _same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(abs(a - b) < CLOSE for a, b in zip(one, other, strict=True))


def _same_turn(one: tuple[float, ...], other: list[float]) -> bool:
    """q and -q are the same attitude; NaN is none."""
    return _same(one, tuple(other)) or _same(one, tuple(-each for each in other))
