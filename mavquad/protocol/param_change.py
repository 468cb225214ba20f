"""Changing parameters of a vehicle so that they can be put back: read, keep, set, read back.

Everything is read before anything is set, so a vehicle that does not know one of the names is not touched at all, and
whoever runs the exchange can keep the original values somewhere safe before the first PARAM_SET goes out.

What the autopilots do: PX4 answers a PARAM_SET with the value in force, and tells a change once more on every link
(1.16); ArduPilot tells it once it is saved, and answers a question after 0.1 s. An unknown name is not answered by
either. A value may be clamped or ignored: only what is read back counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import Enum, auto

from mavquad.endpoint import NEVER_US
from mavquad.protocol.codec import Message, mavlink
from mavquad.protocol.param_record import ParamNumber, ParamRecord, number_words
from mavquad.protocol.param_value import Encoding, decode_value, encode_value, fitted, type_name

RETRY_US = 300_000
MAX_TRIES = 20
"""With 20 % lost each way, one of 10^9 questions stays without an answer."""
_KEPT_AFTER = 10
"""Answers that still show another value, after which it is believed that the vehicle keeps it. Each may be old, or that
to a question whose PARAM_SET was lost: of 30000 changes with 20 % lost each way, 10 gave up none in vain, 4 one in 200."""

Target = tuple[int, int]


class _Stage(Enum):
    READING = auto()
    KNOWN = auto()
    SETTING = auto()
    CHECKING = auto()
    OVER = auto()


class _Parameter:
    """One parameter on its way.

    Attributes:
        failed: why it could not be read or changed.
        original: what was read; None before.
        record: what to remember of it, if its value differs from the wanted one.
    """

    def __init__(self, name: str, wanted: float, encoding: Encoding) -> None:
        self.name = name
        self.failed = ""
        self.original: ParamNumber | None = None
        self.record: ParamRecord | None = None
        self.value: ParamNumber = wanted
        self.stage = _Stage.READING
        self.retry_us = NEVER_US
        self._wanted = wanted
        self._encoding = encoding
        self._kind = 0
        self._tries = 0
        self._seen: ParamNumber | None = None
        self._differing = 0

    def ask(self, stage: _Stage, target: Target, now_us: int) -> list[Message]:
        """Begin a stage."""
        self.stage, self._tries = stage, 0
        return self._send(target, now_us)

    def _send(self, target: Target, now_us: int) -> list[Message]:
        self._tries += 1
        self.retry_us = now_us + RETRY_US
        name = self.name.encode()
        read = mavlink.MAVLink_param_request_read_message(*target, name, -1)
        if self.stage is not _Stage.SETTING:
            return [read]
        wire = encode_value(self.value, self._kind, self._encoding)
        change = mavlink.MAVLink_param_set_message(*target, name, wire, self._kind)
        # A set that is ignored need not be answered: from the second one on, ask what came of it.
        return [change] if self._tries == 1 else [change, read]

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """Ask or set again, or give up."""
        if now_us < self.retry_us:
            return []
        asked = number_words(self.value)
        if self._differing >= _KEPT_AFTER and self._seen is not None:
            seen = number_words(self._seen)
            return self.fail(f"the vehicle keeps it at {seen}, {asked} was asked for")
        if self._tries < MAX_TRIES:
            return self._send(target, now_us)
        seconds = MAX_TRIES * RETRY_US * 1e-6
        if self.stage is _Stage.READING:
            return self.fail(f"not answered in {seconds:g} s: the vehicle does not know it, or does not hear us")
        return self.fail(f"set to {asked}, but no answer in {seconds:g} s shows it")

    def fail(self, words: str) -> list[Message]:
        """Give up."""
        self.failed = words
        return self.rest(_Stage.OVER)

    def rest(self, stage: _Stage) -> list[Message]:
        """Nothing to ask for now."""
        self.stage, self.retry_us = stage, NEVER_US
        return []

    def on_value(self, message: Message, target: Target, now_us: int) -> list[Message]:
        """Take in its PARAM_VALUE."""
        value = decode_value(message, self._encoding)
        if self.stage is _Stage.READING:
            return self._on_read(value, message.param_type)
        if self.stage not in (_Stage.SETTING, _Stage.CHECKING):
            return []
        if value != self.value:
            self._seen, self._differing = value, self._differing + 1
            self.stage = _Stage.SETTING  # set it again, when it is time to
            return []
        return self.ask(_Stage.CHECKING, target, now_us) if self.stage is _Stage.SETTING else self.rest(_Stage.OVER)

    def _on_read(self, value: ParamNumber, kind: int) -> list[Message]:
        self._kind = kind
        try:
            self.original = fitted(value, kind, self._encoding)
        except ValueError as error:
            return self.fail(f"could not be put back: {error}")
        try:
            self.value = fitted(self._wanted, kind, self._encoding)
        except ValueError as error:
            return self.fail(str(error))
        if self.original != self.value:
            self.record = ParamRecord.model_validate(
                {"name": self.name, "type": type_name(kind), "original": self.original, "changed": self.value}
            )
        return self.rest(_Stage.KNOWN)


class ParamChange:
    """Changes a list of parameters; feed it the answers and send what it returns.

    Once all are `read` it waits for `change`, unless it is told not to wait. Before that, `originals` can be kept, and
    `failed` says why one of them cannot be changed at all.

    Args:
        wanted: new values by name.
        encoding: of the vehicle.
        waits: whether `change` must be called; if not, what can be read is set at once and the rest stays `failed`.
    """

    def __init__(self, wanted: Mapping[str, float], encoding: Encoding, waits: bool = True) -> None:
        self._parameters = {name: _Parameter(name, value, encoding) for name, value in wanted.items()}
        self._waits = waits
        self._deadline_us = NEVER_US

    @property
    def read(self) -> bool:
        """Whether each was read, or given up."""
        return all(each.stage is not _Stage.READING for each in self._parameters.values())

    @property
    def done(self) -> bool:
        """Whether nothing is waited for any more, `change` included."""
        return all(each.stage is _Stage.OVER for each in self._parameters.values())

    @property
    def failed(self) -> str:
        """Why it did not work, each parameter by its name; empty when all went well, or may still."""
        return "; ".join(f"{name}: {words}" for name, words in self.failures.items())

    @property
    def failures(self) -> dict[str, str]:
        """The same by name."""
        return {name: each.failed for name, each in self._parameters.items() if each.failed}

    @property
    def originals(self) -> list[ParamRecord]:
        """What is changed, and was read before; those that have the wanted value already are not among them."""
        return [record for each in self._parameters.values() if (record := each.record)]

    @property
    def found(self) -> dict[str, ParamNumber]:
        """What was read, by name, before anything was set."""
        return {name: each.original for name, each in self._parameters.items() if each.original is not None}

    def next_deadline_us(self) -> int:
        """When to repeat something."""
        return self._deadline_us

    def start(self, target: Target, now_us: int) -> list[Message]:
        """Read all of them."""
        return self._each(lambda one: one.ask(_Stage.READING, target, now_us))

    def on_value(self, message: Message, target: Target, now_us: int) -> list[Message]:
        """Take in a PARAM_VALUE; of a parameter that is not among them it is none of our business."""
        one = self._parameters.get(message.param_id)
        return self._each(lambda each: each.on_value(message, target, now_us) if each is one else []) + self._go_on(
            target, now_us
        )

    def on_deadline(self, target: Target, now_us: int) -> list[Message]:
        """Repeat what went without an answer; give up on what did so too often."""
        messages = self._each(lambda one: one.on_deadline(target, now_us))
        return messages + self._go_on(target, now_us)

    def _go_on(self, target: Target, now_us: int) -> list[Message]:
        return self.change(target, now_us) if self.read and not self._waits else []

    def change(self, target: Target, now_us: int) -> list[Message]:
        """Set what differs; what does not is done."""
        return self._each(lambda one: self._change(one, target, now_us))

    @staticmethod
    def _change(one: _Parameter, target: Target, now_us: int) -> list[Message]:
        if one.stage is not _Stage.KNOWN:
            return []
        return one.ask(_Stage.SETTING, target, now_us) if one.record else one.rest(_Stage.OVER)

    def _each(self, act: Callable[[_Parameter], list[Message]]) -> list[Message]:
        messages = [message for each in self._parameters.values() for message in act(each)]
        # Asked for at every frame of a flight: kept, not worked out anew.
        self._deadline_us = min((each.retry_us for each in self._parameters.values()), default=NEVER_US)
        return messages


def restoring(records: Iterable[ParamRecord], encoding: Encoding) -> ParamChange:
    """The exchange that puts the originals back; one that fails does not stop the others."""
    return ParamChange({record.name: record.original for record in records}, encoding, waits=False)
