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


class _Responses(dict[int, Response]):
    """Of one chain length and lag, by the elapsed time; kept, since stamps are regular."""

    def __init__(self, length: int, lag_s: float) -> None:
        super().__init__()
        self._length, self._lag_s = length, lag_s

    def __missing__(self, tau_us: int) -> Response:
        if len(self) >= _KEPT:
            self.clear()
        found = self[tau_us] = response(self._length, self._lag_s, tau_us)
        return found


_responses = lru_cache(maxsize=64)(_Responses)


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


class Interval(NamedTuple):
    """What happens between two moments: the command in force at the start and when others take over."""

    duration_us: int
    whole: Response
    first: Vec4
    switches: list[tuple[tuple[float, ...], Vec4]]
    """(answer to a unit step of that age at the end, change of the command)."""


def interval(length: int, lag_s: float, commands: tuple[Command, ...], from_us: int, to_us: int) -> Interval:
    """The commands in force between two moments. Before the first command its own value is taken."""
    responses = _responses(length, lag_s)
    at = len(commands) - 1
    while at > 0 and commands[at][0] >= to_us:
        at -= 1
    switches = []
    start_us, value = commands[at]
    while at > 0 and start_us > from_us:
        at -= 1
        before_us, before = commands[at]
        switches.append((responses[to_us - start_us].step, _difference(value, before)))
        start_us, value = before_us, before
    duration_us = to_us - from_us
    return Interval(duration_us, responses[duration_us], value, switches)


def appended(commands: tuple[Command, ...], new: Command, oldest_needed_us: int) -> tuple[Command, ...]:
    """The commands with a new one at the end, and without those that no interval from `oldest_needed_us` on sees.

    A new command that starts no later than the last one replaces it.
    """
    kept = [c for c in commands if c[0] < new[0]]
    while len(kept) > 1 and (kept[1][0] <= oldest_needed_us or len(kept) >= MAX_COMMANDS):
        del kept[0]
    return (*kept, new)


def advance(state: list[float], lagged: float, span: Interval, channel: int) -> tuple[list[float], float]:
    """One chain (zeta_1 .. zeta_r, sigma) and its lagged input at the end of the interval, exactly."""
    return _ADVANCE[len(state) - 1](state, lagged, span, channel)


def _written_out(length: int) -> Callable[[list[float], float, Interval, int], tuple[list[float], float]]:
    """The sums of `advance` for one length of chain, without loops over the states: they are most of a step's cost.

    zeta_i+ = step_i first + memory_i lagged + sum_k taylor_k zeta_(i+k) + sum over the switches of their step_i change
    """
    r = range(length)

    def names(letter: str) -> str:
        return ", ".join(f"{letter}{i}" for i in range(length + 1))

    lines = [
        "def advance(state, lagged, span, channel):",
        f"    _, ((_, {', '.join(f'h{k + 1}' for k in r)},), ({names('s')}), ({names('m')})), first, switches = span",
        "    first = first[channel]",
        f"    {names('z')} = state",
        *(
            f"    d{i} = s{i} * first + m{i} * lagged + z{i} + "
            + " + ".join(f"h{k} * z{i + k}" for k in range(1, length - i + 1))
            for i in r
        ),
        f"    a = s{length} * first + m{length} * lagged",
        f"    for ({names('s')}), change in switches:",
        "        change = change[channel]",
        *(f"        d{i} += s{i} * change" for i in r),
        f"        a += s{length} * change",
        f"    return [{', '.join(f'd{i}' for i in r)}, z{length}], a",
    ]
    scope: dict[str, Any] = {}
    exec("\n".join(lines), scope)
    written: Callable[[list[float], float, Interval, int], tuple[list[float], float]] = scope["advance"]
    return written


_LONGEST = 5
_ADVANCE = {length: _written_out(length) for length in range(1, _LONGEST + 1)}


def _difference(new: Vec4, old: Vec4) -> Vec4:
    return (new[0] - old[0], new[1] - old[1], new[2] - old[2], new[3] - old[3])
