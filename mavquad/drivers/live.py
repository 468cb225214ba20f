"""The live driver: one endpoint on one UDP socket, in asyncio's event loop.

Time is the Unix time at the start plus the monotonic time since, so that a stepped system clock moves nothing.
A datagram is handed over in the callback that reads it; a deadline fires at its own time however late the loop wakes,
and how late is measured.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import time
from collections.abc import Callable
from typing import cast

from mavquad.drivers.runner import Recorder, Runner
from mavquad.endpoint import NEVER_US, Endpoint
from mavquad.errors import EndpointError
from mavquad.protocol.codec import is_known
from mavquad.url import Address

MAX_WAIT_S = 1.0


class Clock:
    """Unix time in microseconds that only the monotonic clock moves on."""

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def now_us(self) -> int:
        """Now."""
        return (self._offset_ns + time.monotonic_ns()) // 1000


class LiveDriver(asyncio.DatagramProtocol):
    """Drives an endpoint over UDP. Use `open_live`.

    It speaks to the address it was given, or answers who spoke last until the peer is known: the address whose frame
    made `locked` true. From then on datagrams of others are counted (`runner.strangers`) and ignored.

    Attributes:
        runner: the endpoint under the rule of time.
        lateness_us: for each datagram sent, how long after its stamp it left.
        failure: what an endpoint raised in a callback, for the one who waits.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: Clock,
        start_us: int,
        recorder: Recorder | None,
        remote: tuple[str, int] | None,
        locked: Callable[[], bool],
    ) -> None:
        self._clock = clock
        self._peer = remote
        self._heard = remote
        self._connected = remote is not None
        self._is_locked = locked
        self._locked = remote is not None
        self._transport: asyncio.DatagramTransport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._loop = asyncio.get_running_loop()
        self._failed = asyncio.Event()
        self.runner = Runner(endpoint, start_us, self._send, recorder)
        self.lateness_us: list[int] = []
        self.failure: Exception | None = None
        self._abandoned = False

    # ------------------------------------------------------------------ asyncio's callbacks

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The socket is open."""
        self._transport = cast(asyncio.DatagramTransport, transport)
        self._schedule()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """A datagram arrived."""
        if self._locked and not self._connected and addr[:2] != self._peer:
            self.runner.strangers += 1
            return
        self._guarded(lambda: self._take(data, addr))

    def error_received(self, exc: Exception) -> None:
        """Nobody listens at the other end just now; a vehicle that starts later is still found."""

    # ------------------------------------------------------------------ in and out

    def _take(self, data: bytes, addr: tuple[str, int]) -> None:
        now_us = self._clock.now_us()
        if self._locked:
            self.runner.datagram(data, now_us)
        else:
            self._take_unlocked(data, addr[:2], now_us)

    def _take_unlocked(self, data: bytes, sender: tuple[str, int], now_us: int) -> None:
        if sender != self._heard:
            self.runner.framer.forget_rest()  # half a frame of somebody else
            self._heard = sender
        frames = self.runner.framer.push(data)
        if any(map(is_known, frames)):
            self._peer = sender
        self.runner.frames(frames, now_us)
        self._locked = self._peer == sender and self._is_locked()

    def _send(self, stamp_us: int, datagram: bytes) -> None:
        if self._transport is None or self._peer is None or self._transport.is_closing():
            return
        self._transport.sendto(datagram, None if self._connected else self._peer)
        self.lateness_us.append(self._clock.now_us() - stamp_us)

    def abandon(self, last_words: list[bytes]) -> None:
        """The endpoint failed, or is left alone: send this past it and the record, and nothing ever after."""
        self._abandoned = True
        if self._transport is not None and self._peer is not None:
            for datagram in last_words:
                self._transport.sendto(datagram, None if self._connected else self._peer)

    def _wake(self) -> None:
        self._timer = None
        self._guarded(lambda: self.runner.advance(self._clock.now_us()))

    def command(self, name: str, *args: float) -> None:
        """Hand the operator's command to the endpoint's method of that name, and record it."""
        act = getattr(self.runner.endpoint, name)
        self._guarded(lambda: self.runner.command(name, act, self._clock.now_us(), args))

    def _guarded(self, action: Callable[[], None]) -> None:
        """Run an action; what it raises is kept for the one who waits, since asyncio would only log it."""
        if self._abandoned or self.failure is not None:
            return
        try:
            action()
        except Exception as error:  # noqa: BLE001 - handed on, not swallowed
            self.fail(error)
        self._schedule()

    def fail(self, error: Exception) -> None:
        """End the run: whoever waits gets this error."""
        self.failure = error
        self._failed.set()

    def _schedule(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        deadline_us = self.runner.endpoint.next_deadline_us()
        if self.failure is not None or deadline_us >= NEVER_US:
            return
        wait_s = max(0.0, (deadline_us - self._clock.now_us()) * 1e-6)
        self._timer = self._loop.call_later(min(wait_s, MAX_WAIT_S), self._wake)

    # ------------------------------------------------------------------ for the one who waits

    async def wait(self, duration_s: float) -> None:
        """Let the endpoint run for a while.

        Raises:
            Exception: whatever the endpoint raised, at once.
        """
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._failed.wait(), duration_s)
        if self.failure is not None:
            raise self.failure

    @property
    def port(self) -> int:
        """The local port."""
        assert self._transport is not None
        return int(self._transport.get_extra_info("sockname")[1])

    def close(self) -> None:
        """Close the socket and record the end."""
        if self._timer is not None:
            self._timer.cancel()
        self.runner.end(None if self._abandoned or self.failure is not None else self._clock.now_us())
        if self._transport is not None:
            self._transport.close()


async def open_live(
    endpoint: Endpoint,
    address: Address,
    clock: Clock,
    start_us: int,
    recorder: Recorder | None = None,
    locked: Callable[[], bool] = lambda: True,
) -> LiveDriver:
    """Open the socket and start driving.

    Args:
        endpoint: the agent.
        address: where to listen, or whom to send to.
        clock: the time.
        start_us: when the endpoint was started, by that clock.
        recorder: keeps what passes.
        locked: with a listening address: whether the endpoint knows whom it serves; without it, the first who sends a
            frame of a known message is the peer.

    Raises:
        EndpointError: the port cannot be opened, or the host is unknown.
    """
    local = (address.host, address.port) if address.listens else None
    remote = None if address.listens else (address.host, address.port)
    words = f"{'udpin' if address.listens else 'udpout'}:{address.host}:{address.port}"
    try:
        _, driver = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: LiveDriver(endpoint, clock, start_us, recorder, remote, locked),
            local_addr=local,
            remote_addr=remote,
        )
    except UnicodeError:
        raise EndpointError(words, "cannot be opened (this is no host name)", "check the host and the port") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        in_use = error.errno == errno.EADDRINUSE
        hint = "another program has this port; stop it or choose another" if in_use else "check the host and the port"
        raise EndpointError(words, f"cannot be opened ({reason})", hint) from None
    return driver
