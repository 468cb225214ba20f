"""Whether this build of PX4 takes torques, found out on the ground.

PX4 up to 1.13 handles SET_ACTUATOR_CONTROL_TARGET only in a build without lockstep; one with lockstep ignores it, and says
so to nobody on the link. But PX4 takes OFFBOARD, disarmed too, only while setpoints come that it handles (seen on 1.13.3,
built either way), and its answer to the mode change tells which build it is.
"""

from __future__ import annotations

from mavquad.endpoint import NEVER_US
from mavquad.protocol import command as commands
from mavquad.protocol.codec import Message
from mavquad.protocol.command import CommandExchange, Reply
from mavquad.protocol.firmware import Mode, setpoints

ZERO_US = 20_000
"""Between two setpoints, all of them zero."""
BEFORE_ASKING_US = 400_000
"""One setpoint would do, where none is lost."""
REFUSALS = 3
"""So often the answer must be no: more than a hundred setpoints have had the time to arrive by then."""

Target = tuple[int, int]


class TorqueProbe:
    """Sends torques of zero, and asks for the offboard mode meanwhile. It never arms.

    Attributes:
        asked: whether the offboard mode was asked for.
        proven: whether the vehicle took it.
        refusals: how often it did not.
    """

    def __init__(self, offboard: Mode) -> None:
        self._offboard = offboard
        self._exchange = CommandExchange()
        self._zero_us = NEVER_US
        self._ask_us = NEVER_US
        self.asked = False
        self.proven = False
        self.refusals = 0

    @property
    def result(self) -> str:
        """The last answer, a name of MAV_RESULT."""
        return self._exchange.result

    @property
    def refused(self) -> bool:
        """Whether it was refused often enough to be believed."""
        return self.refusals >= REFUSALS

    def start(self, now_us: int) -> None:
        """Begin with the setpoints; they go on until `stop`, also on the way back, lest their loss changes the mode."""
        self._zero_us = now_us
        self._ask_us = now_us + BEFORE_ASKING_US

    def stop(self) -> None:
        """Nothing more is sent."""
        self._zero_us = NEVER_US

    def next_deadline_us(self) -> int:
        """When the next setpoint is due."""
        return self._zero_us

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """The setpoint, when it is due."""
        if now_us < self._zero_us:
            return []
        self._zero_us = now_us + ZERO_US
        return [setpoints.torque_setpoint(now_us, (0.0, 0.0, 0.0, 0.0), *target)]

    def on_heartbeat(self, target: Target, now_us: int) -> list[Message]:
        """The question, right behind a HEARTBEAT that shows the mode unchanged: no choice of the pilot's is overrun."""
        if now_us < self._ask_us:
            return []
        self.asked = True
        return [self._exchange.request(commands.set_mode(self._offboard), target, now_us)]

    def on_ack(self, ack: Message) -> None:
        """Take in a COMMAND_ACK. An answer that comes twice counts once."""
        was_pending = self._exchange.pending
        reply = self._exchange.on_ack(ack)
        if reply is Reply.ACCEPTED:
            self.proven = True
        elif reply is Reply.REFUSED and was_pending:
            self.refusals += 1
