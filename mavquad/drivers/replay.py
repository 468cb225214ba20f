"""The replay driver: a recorded flight's inputs go through the same agent; its outputs must be the recorded ones.

Inputs are the inbound frames of the log and the operator's events, merged by their stamps (no two are equal).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from mavquad.drivers.runner import Runner
from mavquad.endpoint import Endpoint
from mavquad.protocol.codec import decode, is_valid
from mavquad.tlog import Record


@dataclass(frozen=True, slots=True)
class OperatorEvent:
    """A command of the operator with its arguments, or the start and the end of the run."""

    stamp_us: int
    name: str
    args: tuple[float | str, ...] = ()


@dataclass(frozen=True, slots=True)
class Mismatch:
    """The first outbound frame that differs; a side is None where it has no such frame."""

    index: int
    recorded: tuple[int, bytes] | None
    replayed: tuple[int, bytes] | None

    def to_json(self) -> dict[str, Any]:
        """The mismatch for people and machines."""
        return {"index": self.index, "recorded": _words(self.recorded), "replayed": _words(self.replayed)}


def _words(item: tuple[int, bytes] | None) -> dict[str, Any] | None:
    if item is None:
        return None
    stamp_us, frame = item
    message = str(decode(frame)) if is_valid(frame) else "(not a valid frame)"
    return {"stamp_us": stamp_us, "hex": frame.hex(), "message": message}


@dataclass(slots=True)
class ReplayResult:
    """What a replay found. `matched` counts outbound frames equal in bytes and stamp, place by place."""

    inbound: int = 0
    recorded: int = 0
    replayed: int = 0
    matched: int = 0
    first_mismatch: Mismatch | None = None
    sent: list[tuple[int, bytes]] = field(default_factory=list)

    @property
    def equal(self) -> bool:
        """Whether every recorded outbound frame was sent again, and nothing else."""
        return self.first_mismatch is None


def replay(
    endpoint: Endpoint,
    start_us: int,
    records: Iterable[Record],
    events: list[OperatorEvent],
    witness: Callable[[Record], None] = lambda _: None,
) -> ReplayResult:
    """Run an endpoint through a recorded flight and compare what it sends.

    Args:
        endpoint: a fresh agent with the flight's configuration, started at `start_us`.
        start_us: stamp of the "start" event.
        records: the log, both directions.
        events: the operator's events; "start" and "end" among them.
        witness: called after each inbound frame.
    """
    result = ReplayResult()
    runner = Runner(endpoint, start_us, lambda stamp_us, data: result.sent.append((stamp_us, data)))
    recorded: list[tuple[int, bytes]] = []
    pending = iter(sorted((e for e in events if e.name != "start"), key=lambda event: event.stamp_us))
    event = next(pending, None)
    for record in records:
        while event is not None and event.stamp_us < record.stamp_us:
            _act(runner, event)
            event = next(pending, None)
        if record.outbound:
            recorded.append((record.stamp_us, record.frame))
        else:
            result.inbound += 1
            runner.frame(record.frame, record.stamp_us)
            witness(record)
    while event is not None:
        _act(runner, event)
        event = next(pending, None)
    _compare(result, recorded)
    return result


def _act(runner: Runner, event: OperatorEvent) -> None:
    if event.name == "end":
        runner.advance(event.stamp_us)
    else:
        runner.command(event.name, getattr(runner.endpoint, event.name), event.stamp_us, event.args)


def _compare(result: ReplayResult, recorded: list[tuple[int, bytes]]) -> None:
    result.recorded, result.replayed = len(recorded), len(result.sent)
    for index, (one, other) in enumerate(_pairs(recorded, result.sent)):
        if one == other:
            result.matched += 1
        elif result.first_mismatch is None:
            result.first_mismatch = Mismatch(index, one, other)


def _pairs(
    recorded: list[tuple[int, bytes]], replayed: list[tuple[int, bytes]]
) -> Iterator[tuple[tuple[int, bytes] | None, tuple[int, bytes] | None]]:
    for index in range(max(len(recorded), len(replayed))):
        yield (
            recorded[index] if index < len(recorded) else None,
            replayed[index] if index < len(replayed) else None,
        )
