"""Questions and answers: each message of the client that wants an answer, with everything that answered it.

An answer belongs to the last question of its kind (the same command, the same parameter) that came before it. The
state that a command leads to is that of the last HEARTBEAT in the 1.5 s after it; HEARTBEATs come once a second, at a
phase of their own, so what the mock shows in its HEARTBEATs just before or just after that one is compared with it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mavquad.protocol.codec import Message, decode, mavlink
from tests.conformance.recording import Recording, Timed
from tests.conformance.texts import Text

ANSWER_WINDOW_US = 1_000_000
LIST_WINDOW_US = 12_000_000
STATE_WINDOW_US = 1_500_000
_PERIOD_US = 1_050_000
_CLOCK_TOLERANCE_NS = 30_000_000
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_COMMANDS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE")
_ASKED = (*_COMMANDS, "PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "TIMESYNC")

_NO_INDEX = 65535
_HASH = "_HASH_CHECK"

State = tuple[int, int, int]
"""custom_mode, base_mode, system_status."""


@dataclass(slots=True)
class Exchange:
    """One question and its answers.

    Attributes:
        at_us: when it was asked.
        question: the client's message.
        answers: what answered it, as comparable tuples, in order.
        states: the states of the vehicle that count as those after it.
        texts: STATUSTEXTs that no one on the other side said.
    """

    at_us: int
    question: Message
    answers: list[tuple[Any, ...]] = field(default_factory=list)
    states: list[State] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    @property
    def kind(self) -> str:
        """What was asked, e.g. "COMPONENT_ARM_DISARM" or "PARAM_SET"."""
        name = self.question.get_type()
        if name in ("COMMAND_LONG", "COMMAND_INT"):
            entry = mavlink.enums["MAV_CMD"].get(self.question.command)
            return entry.name.removeprefix("MAV_CMD_") if entry else f"command {self.question.command}"
        return str(name)

    @property
    def is_command(self) -> bool:
        """Whether it may change the vehicle's state."""
        return self.question.get_type() in _COMMANDS

    def __str__(self) -> str:
        return f"{self.at_us / 1e6:.2f} s {self.kind} {_arguments(self.question)}"


def exchanges_of(recording: Recording) -> list[Exchange]:
    """Every exchange of a recording, without its states and texts."""
    asked = [(at_us, decode(frame)) for at_us, frame in recording.client]
    found = [Exchange(at_us, message) for at_us, message in asked if _wants_answer(message)]
    ends = {id(exchange): _end_us(exchange, found[i + 1 :]) for i, exchange in enumerate(found)}
    for exchange in found:
        for at_us, message in _between(recording.vehicle, exchange.at_us, ends[id(exchange)]):
            answer = _answer(exchange, message, at_us, recording)
            if answer is not None:
                exchange.answers.append(answer)
            if answer is not None and _is_last_of_list(exchange, message):
                break
    return found


def add_states(real: list[Exchange], mock: list[Exchange], real_states: list[Timed], mock_states: list[Timed]) -> None:
    """Fill in the states after each command; the arguments are the HEARTBEATs of either side."""
    for ours, theirs in zip(mock, real, strict=True):
        if not theirs.is_command:
            continue
        seen = list(_between(real_states, theirs.at_us, theirs.at_us + STATE_WINDOW_US))
        if not seen:
            continue
        at_us, last = seen[-1]
        theirs.states = [_state(last)]
        before = _between(mock_states, ours.at_us, at_us + 1)
        after = _between(mock_states, at_us + 1, at_us + _PERIOD_US)
        ours.states = [_state(message) for _, message in (*before[-1:], *after[:1])]


def heartbeats(recording: Recording) -> list[Timed]:
    """The vehicle's HEARTBEATs."""
    return [(at_us, message) for at_us, message in recording.vehicle if message.get_type() == "HEARTBEAT"]


def same_result(real: Exchange, mock: Exchange) -> bool:
    """Whether the same was answered: acknowledgements, values, order."""
    return [_comparable(answer) for answer in real.answers] == [_comparable(answer) for answer in mock.answers]


def same_state(real: Exchange, mock: Exchange) -> bool:
    """Whether it led to the same mode, armed or not, and status."""
    return not real.states or real.states[0] in mock.states


def is_armed(state: State) -> bool:
    """Whether the motors may turn."""
    return bool(state[1] & _ARMED)


def _wants_answer(message: Message) -> bool:
    name = message.get_type()
    return name in _ASKED and not (name == "TIMESYNC" and message.tc1 != 0)


def _same_question(a: Exchange, b: Exchange) -> bool:
    one, other = a.question, b.question
    if one.get_type() != other.get_type():
        return False
    if one.get_type() in ("COMMAND_LONG", "COMMAND_INT"):
        return bool(one.command == other.command)
    if one.get_type().startswith("PARAM_") and one.get_type() != "PARAM_REQUEST_LIST":
        return bool(one.param_id == other.param_id)
    return True


def _end_us(exchange: Exchange, later: list[Exchange]) -> int:
    window_us = LIST_WINDOW_US if exchange.question.get_type() == "PARAM_REQUEST_LIST" else ANSWER_WINDOW_US
    following = (other.at_us for other in later if _same_question(exchange, other))
    return min(exchange.at_us + window_us, next(following, exchange.at_us + window_us))


def _between(messages: list[Timed], begin_us: int, end_us: int) -> list[Timed]:
    return [(at_us, message) for at_us, message in messages if begin_us <= at_us < end_us]


def _answer(exchange: Exchange, message: Message, at_us: int, recording: Recording) -> tuple[Any, ...] | None:
    """The message as an answer to this question, or None if it is none."""
    question, name = exchange.question, message.get_type()
    asked = question.get_type()
    if asked in _COMMANDS:
        return _command_answer(question, message)
    if name == "PARAM_VALUE" and asked == "PARAM_REQUEST_LIST":
        if message.param_index == _NO_INDEX and message.param_id != _HASH:
            return None  # told because it changed, not because it was asked for
        return (message.param_id, message.param_type, message.param_count, message.param_index, message.param_value)
    if name == "PARAM_VALUE" and asked != "TIMESYNC" and message.param_id == question.param_id:
        return (
            name,
            message.param_id,
            message.param_value,
            message.param_type,
            message.param_count,
            message.param_index,
        )
    if name == "TIMESYNC" == asked and message.ts1 == question.ts1 and message.tc1 != 0:
        is_its_clock = abs(message.tc1 - (recording.boot_us + at_us) * 1000) < _CLOCK_TOLERANCE_NS
        return (name, "time since boot" if is_its_clock else f"tc1 {message.tc1}")
    return None


def _is_last_of_list(exchange: Exchange, message: Message) -> bool:
    is_list = exchange.question.get_type() == "PARAM_REQUEST_LIST"
    return is_list and bool(message.param_index == message.param_count - 1)


def _command_answer(question: Message, message: Message) -> tuple[Any, ...] | None:
    command = mavlink.MAV_CMD_DO_SET_MODE if question.get_type() == "SET_MODE" else question.command
    if message.get_type() == "COMMAND_ACK" and message.command == command:
        result = mavlink.enums["MAV_RESULT"][message.result].name.removeprefix("MAV_RESULT_")
        return ("ACK", result, message.progress, message.result_param2, message.target_system, message.target_component)
    if command == mavlink.MAV_CMD_REQUEST_MESSAGE and message.get_msgId() == int(question.param1):
        return (message.get_type(),)
    return None


def _comparable(answer: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple("nan" if part != part else part for part in answer)


def _state(message: Message) -> State:
    return (message.custom_mode, message.base_mode, message.system_status)


def _arguments(question: Message) -> str:
    name = question.get_type()
    if name == "COMMAND_LONG":
        params = [getattr(question, f"param{number}") for number in range(1, 8)]
        while params and params[-1] == 0:
            params.pop()
        where = "" if question.target_system == 1 else f" to {question.target_system}/{question.target_component}"
        return " ".join(f"{value:g}" for value in params) + where
    if name in ("PARAM_SET", "PARAM_REQUEST_READ"):
        return str(question.param_id)
    return ""
