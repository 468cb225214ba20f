"""One recording against the mock: the exchanges, what happened by itself, and the streams."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from difflib import SequenceMatcher

from tests.conformance.exchanges import (
    Exchange,
    State,
    add_states,
    exchanges_of,
    heartbeats,
    same_result,
    same_state,
)
from tests.conformance.play import play
from tests.conformance.reasons import Reason, reason_of
from tests.conformance.recording import Recording
from tests.conformance.streams import Constant, Rate, constants, kinds, rates
from tests.conformance.texts import Text, texts_of, unmatched

_TEXT_OF_EXCHANGE_US = 200_000
_EVENT_WITHIN_US = 3_000_000


@dataclass(frozen=True, slots=True)
class Difference:
    """What differs, in words, and why if that is known."""

    what: str
    reason: Reason | None

    @property
    def excused(self) -> bool:
        """Whether the mock cannot know or share it (see `reasons`)."""
        return self.reason is not None and self.reason.excused

    def __str__(self) -> str:
        return f"{self.what} [{self.reason.why}]" if self.reason else self.what


@dataclass(slots=True)
class Compared:
    """An exchange on both sides."""

    real: Exchange
    mock: Exchange
    differences: list[Difference] = field(default_factory=list)
    has_same_result: bool = True
    has_same_state: bool = True

    @property
    def excused(self) -> bool:
        """Whether it differs only in what is excused."""
        return bool(self.differences) and all(difference.excused for difference in self.differences)

    @property
    def same_outcome(self) -> bool:
        """The same acknowledgements or values, and the same resulting mode, armed state and status."""
        return self.has_same_result and self.has_same_state

    @property
    def identical(self) -> bool:
        """The same outcome and the same texts."""
        return not self.differences


@dataclass(slots=True)
class Comparison:
    """A recording and the mock's answer to it."""

    recording: Recording
    exchanges: list[Compared]
    events: list[Difference]
    event_count: int
    missing_kinds: list[str]
    extra_kinds: list[str]
    rates: list[Rate]
    constants: list[Constant]

    def counted(self) -> list[Compared]:
        """The exchanges that count: all but those that differ only in what is excused."""
        return [compared for compared in self.exchanges if not compared.excused]


def compare(recording: Recording, played: Recording | None = None) -> Comparison:
    """Play a recording against the mock (or take it as played already) and hold the two side by side."""
    mock = played or play(recording)
    theirs, ours = exchanges_of(recording), exchanges_of(mock)
    add_states(theirs, ours, heartbeats(recording), heartbeats(mock))
    missing, extra = unmatched(texts_of(recording), texts_of(mock))
    missing = _give_to_exchanges(missing, theirs)
    extra = _give_to_exchanges(extra, ours)
    pairs = [_compared(recording.name, real, own) for real, own in zip(theirs, ours, strict=True)]
    events, count = _events(recording, mock, missing, extra)
    if recording.is_cut:
        return Comparison(recording, pairs, events, count, [], [], [], [])
    streams = (*kinds(recording, mock), rates(recording, mock), constants(recording, mock))
    return Comparison(recording, pairs, events, count, *streams)


def _give_to_exchanges(texts: list[Text], exchanges: list[Exchange]) -> list[Text]:
    """Add each text to the exchange that it followed closely; return those that followed none."""
    rest = []
    for text in texts:
        near = [exchange for exchange in exchanges if 0 <= text.at_us - exchange.at_us <= _TEXT_OF_EXCHANGE_US]
        if near:
            near[-1].texts.append(text)
        else:
            rest.append(text)
    return rest


def _compared(name: str, real: Exchange, mock: Exchange) -> Compared:
    compared = Compared(real, mock, [], same_result(real, mock), same_state(real, mock))
    told = []
    if not compared.has_same_result:
        told.append(_answers_differ(real, mock))
    if not compared.has_same_state:
        told.append(f"leads to {_state(real.states)}, mock {_state(mock.states)}")
    told += [f"no text {text}" for text in real.texts] + [f"text of the mock alone {text}" for text in mock.texts]
    for what in told:
        compared.differences.append(Difference(what, reason_of(name, f"{what} after {real}")))
    return compared


def _answers_differ(real: Exchange, mock: Exchange) -> str:
    if real.question.get_type() == "PARAM_REQUEST_LIST":
        return _lists_differ(real, mock)
    return f"answered {_answers(real)}, mock {_answers(mock)}"


def _answers(exchange: Exchange) -> str:
    return "; ".join(" ".join(map(str, answer)) for answer in exchange.answers) or "nothing"


def _lists_differ(real: Exchange, mock: Exchange) -> str:
    theirs, ours = ({answer[0]: answer for answer in side.answers} for side in (real, mock))
    common = [name for name in theirs if name in ours]
    parts = [f"list of {len(real.answers)} parameters, mock {len(mock.answers)}"]
    for label, names in (
        ("missing", [name for name in theirs if name not in ours]),
        ("extra", [name for name in ours if name not in theirs]),
        ("of another type", [name for name in common if theirs[name][1] != ours[name][1]]),
        ("of another index", [name for name in common if theirs[name][3] != ours[name][3]]),
        ("of another value", [name for name in common if str(theirs[name][4]) != str(ours[name][4])]),
    ):
        if names:
            parts.append(f"{len(names)} {label} ({', '.join(names[:6])}{', ...' if len(names) > 6 else ''})")
    return ", ".join(parts)


def _state(states: list[State]) -> str:
    return " or ".join(f"mode {mode:#x} base {base} status {status}" for mode, base, status in states) or "no HEARTBEAT"


def _events(
    recording: Recording, mock: Recording, missing: list[Text], extra: list[Text]
) -> tuple[list[Difference], int]:
    """What differs in texts that answer nothing and in the course of the states; and how many there were to agree."""
    missing, extra = unmatched(missing, extra, _EVENT_WITHIN_US)
    told = [f"{text.at_us / 1e6:.1f} s: no text {text}" for text in missing]
    told += [f"{text.at_us / 1e6:.1f} s: text of the mock alone {text}" for text in extra]
    theirs, ours = _course(recording), _course(mock)
    for tag, i0, i1, j0, j1 in SequenceMatcher(None, theirs, ours, autojunk=False).get_opcodes():
        if tag != "equal":
            told.append(f"states {_path(theirs[i0:i1])}, mock {_path(ours[j0:j1])}")
    differences = [Difference(what, reason_of(recording.name, what)) for what in told]
    return differences, len(texts_of(recording)) + len(theirs)


def _course(recording: Recording) -> list[State]:
    """The states in the order in which HEARTBEAT showed them."""
    course: list[State] = []
    for _, message in heartbeats(recording):
        state = (message.custom_mode, message.base_mode, message.system_status)
        if not course or course[-1] != state:
            course.append(state)
    return course


def _path(states: list[State]) -> str:
    return " > ".join(f"{mode:#x}/{base}/{status}" for mode, base, status in states) or "none"


def totals(comparisons: list[Comparison]) -> Counter[str]:
    """Counts over several recordings: exchanges, excused ones, those of the same outcome and the identical ones."""
    counts: Counter[str] = Counter()
    for comparison in comparisons:
        counted = comparison.counted()
        counts["exchanges"] += len(counted)
        counts["excused"] += len(comparison.exchanges) - len(counted)
        counts["same outcome"] += sum(compared.same_outcome for compared in counted)
        counts["identical"] += sum(compared.identical for compared in counted)
    return counts
