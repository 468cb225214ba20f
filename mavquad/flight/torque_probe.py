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
ASK_AGAIN_US = 300_000
REFUSALS = 4
"""So often in a row the answer must be no: some 60 setpoints, and a HEARTBEAT, have had the time to arrive by then."""

Target = tuple[int, int]


class TorqueProbe:
    """Sends torques of zero, and asks for the offboard mode meanwhile. It never arms.

    Attributes:
        asked: whether the offboard mode was asked for.
        proven: whether the vehicle took it.
        refusals: how often it did not.
        result: its last answer, a name of MAV_RESULT.
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
    def result(self) -> str:  # noqa: D102 - see the class
        return self._exchange.result

    @property
    def refused(self) -> bool:
        """Whether it was refused often enough to be believed."""
        return self.refusals >= REFUSALS

    def start(self, now_us: int) -> None:
        """Begin with the setpoints."""
        self._zero_us = now_us
        self._ask_us = now_us + BEFORE_ASKING_US

    def withdraw(self) -> None:
        """Ask no more; the setpoints go on, lest the loss of them changes the mode."""
        self._ask_us = NEVER_US
        self._exchange.cancel()

    def stop(self) -> None:
        """Nothing more is sent."""
        self.withdraw()
        self._zero_us = NEVER_US

    def next_deadline_us(self) -> int:
        """When the next setpoint or the next question is due."""
        return min(self._zero_us, self._ask_us, self._exchange.next_deadline_us())

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """Whatever is due."""
        due: list[Message] = []
        if now_us >= self._zero_us:
            self._zero_us = now_us + ZERO_US
            due.append(setpoints.torque_setpoint(now_us, (0.0, 0.0, 0.0, 0.0), *target))
        if now_us >= self._ask_us:
            self._ask_us = NEVER_US
            self.asked = True
            due.append(self._exchange.request(commands.set_mode(self._offboard), target, now_us))
        repeated = self._exchange.on_deadline(target, now_us)
        if repeated is not None and not isinstance(repeated, Reply):
            due.append(repeated)
        return due

    def on_ack(self, ack: Message, now_us: int) -> None:
        """Take in a COMMAND_ACK. One question, asked twice, may be answered twice: a refusal counts once."""
        was_pending = self._exchange.pending
        reply = self._exchange.on_ack(ack)
        if reply is Reply.ACCEPTED:
            self.proven = True
        elif reply is Reply.REFUSED and was_pending:
            self.refusals += 1
            self._ask_us = now_us + ASK_AGAIN_US
