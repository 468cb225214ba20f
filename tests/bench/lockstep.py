"""How fast a flight in lockstep is, and where its time goes: `python -m tests.bench.lockstep [--flights N]`.

The default flight at each depth, agent and mock, every byte packed and parsed, on one core. "wall" is by the clock, "core" by
the processor's time, which leaves out what other programs take. The shares are measured in a flight of their own, whose
calls are timed one inside the other; a message's costs are measured beside pymavlink's in the same run.
"""

from __future__ import annotations

import argparse
import functools
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

import mavquad.agent
import mavquad.protocol.link
import sitl_mock.autopilot
from mavquad.agent import Agent
from mavquad.flight.law_flight import LawFlight
from mavquad.protocol.codec import Encoder, Framer, decode, mavlink
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.world import World
from tests.support import LockstepFlight, fly

DEPTHS = ("torque", "rate", "attitude")
REPEATS, MESSAGES = 7, 3000
PARTS: dict[str, list[tuple[Any, tuple[str, ...]]]] = {
    "world": [(World, ("step",))],
    "mock software": [(MockAutopilot, ("receive", "on_deadline"))],
    "codec": [
        (Encoder, ("encode",)),
        (Framer, ("takes", "push")),
        *((module, ("decode",)) for module in (mavquad.agent, mavquad.protocol.link, sitl_mock.autopilot)),
    ],
    "agent": [(Agent, ("receive", "on_deadline"))],
    "law": [(LawFlight, ("step", "take_attitude", "take_position"))],
}
REST = "link and drivers"


def flown(depth: str) -> LockstepFlight:
    flight = fly({"law.depth": depth})
    assert flight.exit_code == 0, flight.agent.error
    return flight


def factors(depth: str) -> tuple[float, float]:
    """Virtual time over wall time, and over the processor's."""
    wall, core = time.perf_counter(), time.process_time()
    flight = flown(depth)
    return flight.seconds / (time.perf_counter() - wall), flight.seconds / (time.process_time() - core)


class Account:
    """Who had the processor: the innermost of the calls that are watched."""

    def __init__(self) -> None:
        self.spent_s: Counter[str] = Counter()
        self._now = [REST]
        self._since_s = time.process_time()

    def _turn(self) -> None:
        now_s = time.process_time()
        self.spent_s[self._now[-1]] += now_s - self._since_s
        self._since_s = now_s

    def watched(self, call: Callable[..., Any], part: str) -> Callable[..., Any]:
        @functools.wraps(call)
        def timed(*args: Any, **named: Any) -> Any:
            self._turn()
            self._now.append(part)
            try:
                return call(*args, **named)
            finally:
                self._turn()
                self._now.pop()

        return timed

    def shares(self) -> dict[str, float]:
        self._turn()
        total = sum(self.spent_s.values())
        return {part: self.spent_s[part] / total for part in (*PARTS, REST)}


@contextmanager
def accounted() -> Iterator[Account]:
    account = Account()
    places = [(place, name, part) for part, all_of in PARTS.items() for place, names in all_of for name in names]
    before = [getattr(place, name) for place, name, _ in places]
    for (place, name, part), call in zip(places, before, strict=True):
        setattr(place, name, account.watched(call, part))
    try:
        yield account
    finally:
        for (place, name, _), call in zip(places, before, strict=True):
            setattr(place, name, call)


def messages() -> dict[str, tuple[Any, ...]]:
    """What goes to and fro most often, by class and fields."""
    return {
        "attitude": (123456, 0.1, -0.2, 0.3, 0.04, -0.05, 0.06),
        "local_position_ned": (123456, 1.1, -2.2, -3.3, 0.1, 0.2, -0.3),
        "set_attitude_target": (123456, 1, 1, 0x80, [1.0, 0.0, 0.0, 0.0], 0.1, 0.2, 0.3, 0.5),
        "set_actuator_control_target": (123456, 0, 1, 1, [0.1, 0.2, -0.1, 0.5, 0.0, 0.0, 0.0, 0.0]),
        "heartbeat": (2, 12, 81, 0x60000, 4, 3),
    }


def microseconds(call: Callable[[], Any]) -> float:
    """Of one call: the best of several runs."""
    best = float("inf")
    for _ in range(REPEATS):
        start_s = time.process_time()
        for _ in range(MESSAGES):
            call()
        best = min(best, time.process_time() - start_s)
    return best / MESSAGES * 1e6


def message_costs(name: str, fields: tuple[Any, ...]) -> list[float]:
    """Build and pack, frame and parse, by pymavlink and by us."""
    theirs, parser, ours, framer = dialect.MAVLink(None, 1, 1), dialect.MAVLink(None), Encoder(1, 1), Framer()
    their_kind, our_kind = (getattr(where, f"MAVLink_{name}_message") for where in (dialect, mavlink))
    frame = ours.encode(our_kind(*fields))
    return [
        microseconds(lambda: their_kind(*fields).pack(theirs)),
        microseconds(lambda: ours.encode(our_kind(*fields))),
        microseconds(lambda: parser.parse_buffer(frame)),
        microseconds(lambda: [decode(one) for one in framer.push(frame)]),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=5, help="flights at each depth")
    count = parser.parse_args().flights
    print(f"Times real time, medians of {count} flights (best)\n\n| depth | wall | core |\n|---|---|---|")
    for depth in DEPTHS:
        flown(depth)
        wall, core = zip(*(factors(depth) for _ in range(count)), strict=True)
        cells = (f"{statistics.median(values):.0f} ({max(values):.0f})" for values in (wall, core))
        print(f"| {depth} | {' | '.join(cells)} |", flush=True)
    print(f"\nWhere the time goes\n\n| depth | {' | '.join((*PARTS, REST))} |\n|---|{'---|' * (len(PARTS) + 1)}")
    for depth in DEPTHS:
        with accounted() as account:
            flown(depth)
        print(f"| {depth} | {' | '.join(f'{share:.0%}' for share in account.shares().values())} |", flush=True)
    print("\nA message, us\n\n| message | pack: pymavlink | ours | parse: pymavlink | ours |\n|---|---|---|---|---|")
    for name, fields in messages().items():
        print(f"| {name.upper()} | {' | '.join(f'{cost:.1f}' for cost in message_costs(name, fields))} |", flush=True)


if __name__ == "__main__":
    main()
