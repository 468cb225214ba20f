"""What is asked of the vehicle, one command after the other: each a few times, then it is given up."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.command import Command, CommandExchange, Reply, request_message, set_interval

TRIES_MAX = 5

STREAMS = (
    ("SYS_STATUS", mavlink.MAVLINK_MSG_ID_SYS_STATUS, 2.0),
    ("EXTENDED_SYS_STATE", mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 2.0),
    ("ATTITUDE_TARGET", mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET, 10.0),
)
POSE_STREAMS = (
    ("ATTITUDE", mavlink.MAVLINK_MSG_ID_ATTITUDE),
    ("LOCAL_POSITION_NED", mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED),
)


def questions(rate_hz: float) -> list[Command]:
    """The version, and the streams that a flight needs, at `rate_hz` those of the pose."""
    streams = [(name, number, rate_hz) for name, number in POSE_STREAMS]
    return [
        request_message("AUTOPILOT_VERSION", mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
        *(set_interval(*stream) for stream in (*streams, *STREAMS)),
    ]


def prearm_checks() -> Command:
    """MAV_CMD_RUN_PREARM_CHECKS (401): the vehicle says in STATUSTEXTs what keeps it from arming."""
    return Command("pre-arm checks", mavlink.MAV_CMD_RUN_PREARM_CHECKS)


def back_to_default(command: Command) -> Command:
    """The command that undoes a SET_MESSAGE_INTERVAL: an interval of 0 is the default."""
    return Command(f"{command.words.split()[0]} as before", command.command_id, (command.params[0], 0.0))


class Asking:
    """Commands on their way.

    Attributes:
        results: of each command by its words, the MAV_RESULT; "no answer" where none came.
        asked: the commands that were sent.
    """

    def __init__(self) -> None:
        self.results: dict[str, str] = {}
        self.asked: list[Command] = []
        self._queue: deque[Command] = deque()
        self._exchange = CommandExchange()

    @property
    def done(self) -> bool:
        """Whether nothing is waited for."""
        return not self._queue and not self._exchange.pending

    def next_deadline_us(self) -> int:
        """When to ask again."""
        return self._exchange.next_deadline_us()

    def add(self, commands: Iterable[Command], target: tuple[int, int], now_us: int) -> list[Message]:
        """Ask these too; returns what is to be sent now."""
        self._queue.extend(commands)
        return [] if self._exchange.pending else self._next(target, now_us)

    def forget(self) -> None:
        """Ask no more."""
        self._queue.clear()
        self._exchange.cancel()

    def on_ack(self, ack: Message, target: tuple[int, int], now_us: int) -> list[Message]:
        """Take in a COMMAND_ACK."""
        command = self._exchange.command
        if self._exchange.on_ack(ack) is None or command is None:
            return []
        self.results[command.words] = self._exchange.result
        self._exchange.cancel()
        return self._next(target, now_us)

    def on_deadline(self, target: tuple[int, int], now_us: int) -> list[Message]:
        """Repeat, or give up and go on."""
        if now_us < self._exchange.next_deadline_us():
            return []
        command = self._exchange.command
        if command is not None and self._exchange.tries >= TRIES_MAX:
            self.results[command.words] = "no answer"
            self._exchange.cancel()
            return self._next(target, now_us)
        repeated = self._exchange.on_deadline(target, now_us)
        return [] if repeated is None or isinstance(repeated, Reply) else [repeated]

    def _next(self, target: tuple[int, int], now_us: int) -> list[Message]:
        if not self._queue:
            return []
        command = self._queue.popleft()
        self.asked.append(command)
        return [self._exchange.request(command, target, now_us)]
