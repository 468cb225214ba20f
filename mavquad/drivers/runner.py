"""What all three drivers share: frames in, frames out, the rule of time, and the record of both.

Every input (a frame, an operator's command) gets a stamp that is later than the one before, on the tlog's grid, so the
order of inputs is a total one and the tlog alone, with the few operator events, says what the endpoint was given.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from mavquad.endpoint import GRID_US, Endpoint, fire, floor_to_grid_us
from mavquad.protocol.codec import Framer, is_known


class Recorder(Protocol):
    """Keeps what passed, in the order of cause and effect."""

    def frame(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        """One frame that was received, or sent."""

    def event(self, stamp_us: int, name: str, args: tuple[float | str, ...] = ()) -> None:
        """One command of the operator with its arguments, or the start and the end."""


class Runner:
    """Runs one endpoint under the rule of time.

    Attributes:
        framer: cuts what arrives into frames; counts what is not one.
        last_us: stamp of the last input.
        reached_us: up to when the endpoint has lived.
        deadline_us: the endpoint's next deadline. It is asked for again when the endpoint has acted, and not before.
        strangers: datagrams that the driver refused, since they are not the peer's.
        dropped: frames that the driver could not send: nobody is there, or a stream is lost or too slow.
    """

    def __init__(
        self, endpoint: Endpoint, start_us: int, send: Callable[[int, bytes], None], recorder: Recorder | None = None
    ) -> None:
        self.endpoint = endpoint
        self.framer = Framer()
        self.strangers = 0
        self.dropped = 0
        self.last_us = floor_to_grid_us(start_us)
        self.deadline_us = endpoint.next_deadline_us()
        self.reached_us = self.last_us
        self._send = send
        self._recorder = recorder
        if recorder is not None:
            recorder.event(self.last_us, "start")

    def advance(self, now_us: int) -> None:
        """Let time pass up to `now_us`."""
        now_us &= -GRID_US
        if now_us > self.reached_us:
            self.reached_us = now_us
        endpoint = self.endpoint
        while (stamp_us := self.deadline_us) <= now_us:
            self.deadline_us = fire(endpoint, stamp_us)
            if datagrams := endpoint.datagrams_to_send():
                self._out(stamp_us, datagrams)

    def datagram(self, data: bytes, now_us: int) -> None:
        """Take in what a transport delivered."""
        if self.framer.takes(data):
            self.frame(data, now_us)
        else:
            self.frames(self.framer.push(data), now_us)

    def frames(self, frames: list[bytes], now_us: int) -> None:
        """Take in the whole frames of one delivery; one of an unknown message is recorded and goes no further."""
        for frame in frames:
            if is_known(frame):
                self.frame(frame, now_us)
            elif self._recorder is not None:
                self._recorder.frame(self._input_stamp(now_us), frame, outbound=False)

    def frame(self, frame: bytes, now_us: int) -> None:
        """Take in one whole frame. What answers it leaves before anything is written down: a setpoint must not wait."""
        stamp_us = self._input_stamp(now_us)
        datagrams: list[bytes] = []
        try:
            self.endpoint.receive(frame, stamp_us)
            datagrams = self.endpoint.datagrams_to_send()
            for datagram in datagrams:
                self._send(stamp_us, datagram)
        finally:
            if self._recorder is not None:
                self._recorder.frame(stamp_us, frame, outbound=False)
                for datagram in datagrams:
                    self._recorder.frame(stamp_us, datagram, outbound=True)
        self.deadline_us = self.endpoint.next_deadline_us()

    def command(self, name: str, act: Callable[..., None], now_us: int, args: tuple[float | str, ...] = ()) -> None:
        """Hand over a command of the operator: `act` is called with its stamp and its arguments, finite numbers."""
        stamp_us = self._input_stamp(now_us)
        if self._recorder is not None:
            self._recorder.event(stamp_us, name, args)
        act(stamp_us, *args)
        self._drain(stamp_us)

    def end(self, now_us: int | None) -> None:
        """The run is over: record when. None for an endpoint that failed or was left: it ended where it last acted."""
        stamp_us = max(self.reached_us, self.last_us) if now_us is None else self._input_stamp(now_us)
        if self._recorder is not None:
            self._recorder.event(stamp_us, "end")

    def _input_stamp(self, now_us: int) -> int:
        stamp_us = now_us & -GRID_US
        if stamp_us <= self.last_us:
            stamp_us = self.last_us + GRID_US
        self.last_us = stamp_us
        if self.deadline_us <= stamp_us:
            self.advance(stamp_us)
        return stamp_us

    def _drain(self, stamp_us: int) -> None:
        if datagrams := self.endpoint.datagrams_to_send():
            self._out(stamp_us, datagrams)
        self.deadline_us = self.endpoint.next_deadline_us()

    def _out(self, stamp_us: int, datagrams: list[bytes]) -> None:
        recorder, send = self._recorder, self._send
        for datagram in datagrams:
            if recorder is not None:
                recorder.frame(stamp_us, datagram, outbound=True)
            send(stamp_us, datagram)
