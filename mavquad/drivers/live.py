"""The live driver: one endpoint on one transport (UDP, TCP, a serial port), in asyncio's event loop.

Time is the Unix time at the start plus the monotonic time since, so that a stepped system clock moves nothing.
What arrives is handed over in the callback that reads it, frame by frame; a deadline fires at its own time however late
the loop wakes, and how late is measured.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable

from mavquad.drivers.runner import Recorder, Runner
from mavquad.drivers.transports import Transport, explained, transport_for
from mavquad.endpoint import NEVER_US, Endpoint
from mavquad.flight_record import Note
from mavquad.url import Place

MAX_WAIT_US = 1_000_000


class Clock:
    """Unix time in microseconds that only the monotonic clock moves on."""

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def now_us(self) -> int:
        """Now."""
        return (self._offset_ns + time.monotonic_ns()) // 1000


class LiveDriver:
    """Drives an endpoint over a transport. Use `open_live`.

    Attributes:
        runner: the endpoint under the rule of time.
        lateness_us: for each frame sent, how long after its stamp it left.
        failure: what an endpoint raised in a callback, for the one who waits.
    """

    def __init__(
        self, endpoint: Endpoint, clock: Clock, start_us: int, recorder: Recorder | None, locked: Callable[[], bool]
    ) -> None:
        self._clock = clock
        self._transport: Transport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._timer_us = NEVER_US
        self._loop = asyncio.get_running_loop()
        self._failed = asyncio.Event()
        self._notes: list[Note] = []
        self.is_locked = locked
        self.runner = Runner(endpoint, start_us, self._send, recorder)
        self.lateness_us: list[int] = []
        self.failure: Exception | None = None
        self._abandoned = False

    async def open(self, place: Place) -> None:
        """Open the transport and start; see `open_live`."""
        self._transport = transport_for(place, self)
        with explained(place):
            await self._transport.open()
        self._schedule()

    # ------------------------------------------------------------------ what the transport calls

    def cut(self, data: bytes) -> list[bytes]:
        """The whole frames that these bytes complete."""
        return self.runner.framer.push(data)

    def take(self, frames: list[bytes], age_us: int = 0) -> None:
        """Hand frames to the endpoint, as of so long ago."""
        self._guarded(lambda: self.runner.frames(frames, self._arrival_us(age_us)))

    def take_bytes(self, data: bytes, age_us: int = 0) -> None:
        """Both."""
        self._guarded(lambda: self.runner.datagram(data, self._arrival_us(age_us)))

    def _arrival_us(self, age_us: int) -> int:
        """Not before what the endpoint has already lived through."""
        return max(self._clock.now_us() - age_us, self.runner.reached_us)

    def forget_rest(self) -> None:
        """What comes next does not continue what came before."""
        self.runner.framer.forget_rest()

    def note_stranger(self) -> None:
        """Count a datagram, or a client, that is not the peer's."""
        self.runner.strangers += 1

    def note(self, text: str) -> None:
        """Keep something for the operator."""
        self._notes.append(Note(self._clock.now_us(), "link", text))

    def take_notes(self) -> list[Note]:
        """What happened to the transport since the last call."""
        notes, self._notes = self._notes, []
        return notes

    # ------------------------------------------------------------------ out

    def _send(self, stamp_us: int, frame: bytes) -> None:
        if self._transport is not None and self._transport.send(frame):
            self.lateness_us.append(self._clock.now_us() - stamp_us)
        else:
            self.runner.dropped += 1

    def abandon(self, last_words: list[bytes]) -> None:
        """The endpoint failed, or is left alone: send this past it and the record, and nothing ever after."""
        self._abandoned = True
        if self._transport is not None:
            for frame in last_words:
                self._transport.send(frame)

    def _wake(self) -> None:
        self._timer, self._timer_us = None, NEVER_US
        self._guarded(lambda: self.runner.advance(self._clock.now_us()))

    def command(self, name: str, *args: float | str) -> None:
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
        """Have a timer for the deadline, or for an earlier time: most deadlines move away with each frame, and a wake-up
        too many costs less than a timer for each frame."""
        deadline_us = self.runner.deadline_us
        if deadline_us >= self._timer_us or self.failure is not None:
            return
        if self._timer is not None:
            self._timer.cancel()
        now_us = self._clock.now_us()
        wait_us = min(max(0, deadline_us - now_us), MAX_WAIT_US)
        self._timer_us = now_us + wait_us
        self._timer = self._loop.call_later(wait_us * 1e-6, self._wake)

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
        """The local port; 0 for a serial one."""
        assert self._transport is not None
        return self._transport.port

    def close(self) -> None:
        """Close the transport and record the end."""
        if self._timer is not None:
            self._timer.cancel()
        self.runner.end(None if self._abandoned or self.failure is not None else self._clock.now_us())
        if self._transport is not None:
            self._transport.close()


async def open_live(
    endpoint: Endpoint,
    place: Place,
    clock: Clock,
    start_us: int,
    recorder: Recorder | None = None,
    locked: Callable[[], bool] = lambda: True,
) -> LiveDriver:
    """Open the transport and start driving.

    Args:
        endpoint: the agent.
        place: where to listen, whom to speak to, or a serial port.
        clock: the time.
        start_us: when the endpoint was started, by that clock.
        recorder: keeps what passes.
        locked: with a listening UDP address: whether the endpoint knows whom it serves; without it, the first who sends
            a frame of a known message is the peer.

    Raises:
        EndpointError: the port cannot be opened, the host is unknown, nobody listens there, or a device is not there.
    """
    driver = LiveDriver(endpoint, clock, start_us, recorder, locked)
    await driver.open(place)
    return driver
