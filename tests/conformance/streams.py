"""What is sent without being asked: kinds of messages, their rates, and the fields that never change."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import Any

from mavquad.protocol.codec import Message, decode, mavlink
from tests.conformance.recording import Recording, Timed

RATE_TOLERANCE = 0.10
_SETTLED_US = 500_000
_LEAST_MESSAGES = 5
_LEAST_CONSTANT = 3
_ANSWERS = ("COMMAND_ACK", "PARAM_VALUE", "STATUSTEXT")
_TIMES = ("time_boot_ms", "time_usec", "time_unix_usec", "tc1", "ts1", "seq", "timestamp", "time_utc", "uid")


@dataclass(frozen=True, slots=True)
class Rate:
    """How often a kind was sent, in Hz of the vehicle's clock, since the client last asked for an interval."""

    kind: str
    real_hz: float
    mock_hz: float

    @property
    def agrees(self) -> bool:
        """Whether it is the same within 10 %."""
        return abs(self.mock_hz - self.real_hz) <= RATE_TOLERANCE * self.real_hz


@dataclass(frozen=True, slots=True)
class Constant:
    """A field that never changes in the recording; `mock` is what the mock sends, None for several values."""

    kind: str
    field: str
    real: Any
    mock: Any

    @property
    def agrees(self) -> bool:
        """Whether the mock sends that value always."""
        return _text(self.real) == _text(self.mock)


def kinds(real: Recording, mock: Recording) -> tuple[list[str], list[str]]:
    """Kinds that only the real one sends, and kinds that only the mock sends."""
    ours, theirs = ({message.get_type() for _, message in side.vehicle} for side in (mock, real))
    return sorted(theirs - ours), sorted(ours - theirs)


def rates(real: Recording, mock: Recording) -> list[Rate]:
    """Rates of the kinds that both send, over the time since the client last changed one."""
    begin_us = _last_interval_us(real) + _SETTLED_US
    seconds = (real.end_us - begin_us) * 1e-6
    theirs, ours = _counts(real.vehicle, begin_us), _counts(mock.vehicle, begin_us)
    return [
        Rate(kind, count / seconds, ours[kind] / seconds)
        for kind, count in sorted(theirs.items())
        if count >= _LEAST_MESSAGES and ours[kind] and kind not in _ANSWERS
    ]


def constants(real: Recording, mock: Recording) -> list[Constant]:
    """The fields that are constant in the recording, of the kinds that both send."""
    theirs, ours = _values(real), _values(mock)
    found = []
    for (kind, name), values in sorted(theirs.items()):
        if len(values) != 1 or (kind, name) not in ours:
            continue
        sent = ours[(kind, name)]
        found.append(Constant(kind, name, next(iter(values)), next(iter(sent)) if len(sent) == 1 else None))
    return found


def _last_interval_us(recording: Recording) -> int:
    asked = [
        at_us
        for at_us, message in ((at_us, decode(frame)) for at_us, frame in recording.client)
        if message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    ]
    return max(asked, default=0)


def _counts(messages: list[Timed], begin_us: int) -> Counter[str]:
    return Counter(message.get_type() for at_us, message in messages if at_us >= begin_us)


def _values(recording: Recording) -> dict[tuple[str, str], set[Any]]:
    counts = Counter(message.get_type() for _, message in recording.vehicle)
    values: dict[tuple[str, str], set[Any]] = defaultdict(set)
    for _, message in recording.vehicle:
        if message.get_type() not in _ANSWERS and counts[message.get_type()] >= _LEAST_CONSTANT:
            for name in _fields(message):
                values[(message.get_type(), name)].add(_hashable(getattr(message, name)))
    return values


def _fields(message: Message) -> list[str]:
    return [name for name in message.fieldnames if name not in _TIMES]


def _hashable(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_hashable(part) for part in value)
    return "nan" if value != value else value


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float | int) else str(value)
