"""A replica of what stands between a command and the chain: a known delay, then a first-order lag.

A command w computed from a measurement stamped t acts at t + delay until the next one does; the chain's input a follows it:

    lag a_d = w(t - delay) - a,        zeta_r_d = sigma + a

Everything is linear, so that any interval is solved exactly by superposition: a step of w at time tau before its end adds

    S_k(tau) = tau^k / k! - E_(k-1)(tau)      to the state k integrations behind a,
    E_0(tau) = lag (1 - exp(-tau / lag)),     E_k(tau) = lag (tau^k / k! - E_(k-1)(tau))

and the lag's own memory a(0) adds a(0) E_(k-1). No numerical integration, no rounding of the command's times to samples.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

from mavquad.types import Vec4

_MICROSECOND_S = 1e-6

Command = tuple[int, Vec4]
"""When it starts to act (us of the vehicle's clock), and the chain inputs w of z, yaw, x, y."""

_KEPT = 4096
MAX_COMMANDS = 64
"""Bound on the memory: the oldest are forgotten first (a measurement stream that stood still needs no exact past)."""


class Response(NamedTuple):
    """Coefficients of one elapsed time for a chain of length r. `step` and `memory` list zeta_1 .. zeta_r, then a."""

    taylor: tuple[float, ...]
    """tau^k / k!, k = 0 .. r: how each state, and sigma, reaches those above it."""
    step: tuple[float, ...]
    """Answer to a unit step of the command, tau after it."""
    memory: tuple[float, ...]
    """Answer to a unit of lagged input left from before, tau later."""


class Responses(dict[int, Response]):
    """Of one chain length and lag, by the elapsed time; kept, since stamps are regular."""

    def __init__(self, length: int, lag_s: float) -> None:
        super().__init__()
        self._length, self._lag_s = length, lag_s

    def __missing__(self, tau_us: int) -> Response:
        if len(self) >= _KEPT:
            self.clear()
        found = self[tau_us] = response(self._length, self._lag_s, tau_us)
        return found


responses = lru_cache(maxsize=64)(Responses)


def response(length: int, lag_s: float, tau_us: int) -> Response:
    """The coefficients of one elapsed time."""
    tau_s = tau_us * _MICROSECOND_S
    taylor = tuple(tau_s**k / math.factorial(k) for k in range(length + 1))
    left = math.exp(-tau_s / lag_s) if lag_s > 0.0 else 0.0
    memories = [-math.expm1(-tau_s / lag_s) * lag_s if lag_s > 0.0 else 0.0]
    for k in range(1, length):
        memories.append(lag_s * (taylor[k] - memories[k - 1]))
    memory = tuple(memories[length - 1 - i] for i in range(length))
    step = tuple(taylor[length - i] - memory[i] for i in range(length))
    return Response(taylor, (*step, 1.0 - left), (*memory, left))


Interval = tuple[Response, Vec4, list[tuple[tuple[float, ...], Vec4, Vec4]]]
"""What happens between two moments: the response to the whole of it, the command in force at the start, and when others
take over, the latest first: (answer to a unit step of that age at the end, the command that took over, the one before)."""


def interval(length: int, lag_s: float, commands: tuple[Command, ...], from_us: int, to_us: int) -> Interval:
    """The commands in force between two moments. Before the first command its own value is taken."""
    return between(responses(length, lag_s), commands, from_us, to_us)


def between(known: Responses, commands: tuple[Command, ...], from_us: int, to_us: int) -> Interval:
    """The same, for a chain whose responses are at hand."""
    last = max(bisect_left(commands, (to_us,)) - 1, 0)
    since_us, command = commands[last]
    if since_us <= from_us or last == 0:
        return known[to_us - from_us], command, []
    first = max(bisect_left(commands, (from_us + 1,), 0, last), 1) - 1
    # In force at the start is commands[first]; those up to commands[last] take over, the latest first.
    later, earlier = commands[last:first:-1], commands[first:last][::-1]
    switches = [
        (known[to_us - start_us].step, new, old) for (start_us, new), (_, old) in zip(later, earlier, strict=True)
    ]
    return known[to_us - from_us], commands[first][1], switches


def appended(commands: tuple[Command, ...], new: Command, oldest_needed_us: int) -> tuple[Command, ...]:
    """The commands with a new one at the end, and without those that no interval from `oldest_needed_us` on sees.

    A new command that starts no later than the last one replaces it.
    """
    end = bisect_left(commands, (new[0],))
    start = max(bisect_left(commands, (oldest_needed_us + 1,), 0, end) - 1, end - MAX_COMMANDS + 1, 0)
    return (*commands[start:end], new)


def advance(state: list[float], lagged: float, span: Interval, channel: int) -> tuple[list[float], float]:
    """One chain (zeta_1 .. zeta_r, sigma) and its lagged input at the end of the interval, exactly."""
    return _ADVANCE[len(state) - 1](state, lagged, span, channel)


class Sums(NamedTuple):
    """The sums of `advance` for one length of chain, written out without loops over the states: they are most of a step's
    cost. They want `span`, `channel`, `state` and `lagged`.

    zeta_i+ = step_i first + memory_i lagged + sum_k taylor_k zeta_(i+k) + sum over the switches of their step_i change
    """

    shared: list[str]
    """What all the chains that go through an interval together have in common."""
    own: list[str]
    """Each chain's part."""
    state: str
    """Expressions of the state at the end, and of the lagged input."""
    lagged: str


def sums(length: int, with_lagged: bool = True) -> Sums:
    """Of a chain of this length; the lagged input at the end is left out where nobody wants it."""
    r = range(length)

    def names(letter: str) -> str:
        return ", ".join(f"{letter}{i}" for i in range(length + 1))

    taylor = ", ".join(f"h{k + 1}" for k in r)
    return Sums(
        shared=[f"((_, {taylor},), ({names('s')}), ({names('m')})), commanded, switches = span"],
        own=[
            f"{names('z')} = state",
            "first = commanded[channel]",
            *(
                f"d{i} = s{i} * first + m{i} * lagged + z{i} + "
                + " + ".join(f"h{k} * z{i + k}" for k in range(1, length - i + 1))
                for i in r
            ),
            *([f"a = s{length} * first + m{length} * lagged"] if with_lagged else []),
            f"for ({names('u')}), new, old in switches:",
            "    change = new[channel] - old[channel]",
            *(f"    d{i} += u{i} * change" for i in r),
            *([f"    a += u{length} * change"] if with_lagged else []),
        ],
        state=f"[{', '.join(f'd{i}' for i in r)}, z{length}]",
        lagged="a",
    )


def written(head: str, body: list[str]) -> Callable[..., Any]:
    """The function that this head and these lines define."""
    scope: dict[str, Any] = {}
    exec("\n    ".join([head, *body]), scope)
    made: Callable[..., Any] = scope[head.removeprefix("def ").partition("(")[0]]
    return made


def _written_out(length: int) -> Callable[[list[float], float, Interval, int], tuple[list[float], float]]:
    code = sums(length)
    result = f"return {code.state}, {code.lagged}"
    return written("def advance(state, lagged, span, channel):", [*code.shared, *code.own, result])


_LONGEST = 5
_ADVANCE = {length: _written_out(length) for length in range(1, _LONGEST + 1)}
