"""The one shape of both ends of a link, and the one rule of time.

An `Endpoint` reacts to frames and to the passing of time. It never opens a socket, reads a clock, sleeps or draws
unseeded random numbers, so the same object runs live, in lockstep and in replay.

The rule of time. Time is an integer count of microseconds on the grid of a tlog, whose two lowest bits carry a link
number (pymavlink, `mavlogfile`): every stamp is a multiple of `GRID_US`. Before an input is handed over, every
deadline up to and including the input's stamp fires, **each at its own time and not at the late time of the wake-up**;
inputs of one endpoint have strictly increasing stamps. With that, what an endpoint sends is a function of its recorded
inputs alone, whatever the event loop's delays were: a recorded flight can be replayed bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from mavquad.errors import InternalError

GRID_US = 4
NEVER_US = 1 << 62


def floor_to_grid_us(time_us: int) -> int:
    """The latest stamp of the grid that is not after `time_us`."""
    return time_us & -GRID_US


def grid_us(duration_s: float) -> int:
    """A duration in microseconds on the grid."""
    return floor_to_grid_us(round(duration_s * 1e6))


class Endpoint(Protocol):
    """One end of a MAVLink link: the agent, the mock autopilot, or a link wrapped around one of them."""

    def receive(self, data: bytes, now_us: int) -> None:
        """Take in one whole MAVLink frame that arrived at `now_us`."""

    def next_deadline_us(self) -> int:
        """When `on_deadline` wants to be called; `NEVER_US` for never."""

    def on_deadline(self, now_us: int) -> None:
        """Act on the passing of time; `now_us` is the deadline itself."""

    def datagrams_to_send(self) -> list[bytes]:
        """What the last call made ready to send; handed out once."""


def fire(endpoint: Endpoint, deadline_us: int) -> int:
    """Let the endpoint act on its deadline; returns the next one.

    Raises:
        InternalError: the deadline did not move on after it fired (it would never end).
    """
    endpoint.on_deadline(deadline_us)
    next_us = endpoint.next_deadline_us()
    if next_us <= deadline_us:
        raise InternalError(f"{type(endpoint).__name__}: the deadline at {deadline_us} us does not move on")
    return next_us


def advance(endpoint: Endpoint, now_us: int) -> Iterator[tuple[int, bytes]]:
    """Fire every deadline up to `now_us`, each at its own time, and yield what it sends as (stamp_us, datagram).

    Raises:
        InternalError: the endpoint's deadline did not move on after it fired (it would never end).
    """
    deadline_us = endpoint.next_deadline_us()
    while deadline_us <= now_us:
        fired_us, deadline_us = deadline_us, fire(endpoint, deadline_us)
        for datagram in endpoint.datagrams_to_send():
            yield fired_us, datagram


def deliver(endpoint: Endpoint, data: bytes, now_us: int) -> Iterator[tuple[int, bytes]]:
    """Hand one frame to the endpoint under the rule of time; yield all it sends as (stamp_us, datagram)."""
    yield from advance(endpoint, now_us)
    endpoint.receive(data, now_us)
    for datagram in endpoint.datagrams_to_send():
        yield now_us, datagram
