"""Sockets of the mock: non-blocking, never waited for, with bounded memory whatever the other end does.

A transport hands whole frames to `received` and sends frames; what it cannot send is dropped, the oldest first, and
counted. A client that is gone, refuses, resets or reads slowly costs nothing else.
"""

from __future__ import annotations

import asyncio
import socket
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from mavquad.protocol.codec import Framer
from mavquad.url import Address
from sitl_mock.endpoints import LinkSpec
from sitl_mock.sockets import local_address, notice_the_gone, open_tcp, open_udp

Received = Callable[[list[bytes]], None]

_READS_AT_ONCE = 64
"""Datagrams taken in before others have their turn."""
_SENDERS_MAX = 32
_DATAGRAM_MAX = 65535
_PENDING_MAX = 64 * 1024
"""Bytes that wait for a slow TCP client, beside those in the kernel."""


@dataclass(slots=True)
class Counts:
    """What passed through links: `bad` chunks were no frames, `unanswered` came from others than the one served,
    `dropped` frames could not be sent."""

    received: int = 0
    sent: int = 0
    bad: int = 0
    unknown: int = 0
    unanswered: int = 0
    dropped: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(*(getattr(self, name) + getattr(other, name) for name in Counts.__slots__))


class Transport(Protocol):
    """A link's socket."""

    spec: LinkSpec

    @property
    def address(self) -> Address:
        """The local address."""

    @property
    def counts(self) -> Counts:
        """What passed so far."""

    def send(self, frames: Sequence[bytes]) -> None:
        """Send frames to who is served, if anybody is."""

    def close(self) -> None:
        """Close the socket."""


class UdpLink:
    """A UDP socket that serves its first peer, as PX4 does: others are heard and never answered.

    The peer that it speaks to at first is given up for the first that is heard. With `answers_all`, that peer and
    everybody who was heard are served, the latest `_SENDERS_MAX` of them.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, spec: LinkSpec, received: Received, answers_all: bool) -> None:
        self.spec = spec
        self._received = received
        self._answers_all = answers_all
        self._loop = loop
        self._socket, speaks_to = open_udp(spec)
        self._served = [speaks_to] if speaks_to is not None else []
        self._is_locked = False
        self._framers: OrderedDict[tuple[str, int], Framer] = OrderedDict()
        self._counts = Counts()
        loop.add_reader(self._socket, self._readable)

    @property
    def address(self) -> Address:
        """The local address."""
        return local_address(self._socket)

    @property
    def counts(self) -> Counts:
        """What passed so far."""
        framers = self._framers.values()
        bad, unknown = sum(f.bad_chunks for f in framers), sum(f.unknown for f in framers)
        return self._counts + Counts(bad=bad, unknown=unknown)

    def send(self, frames: Sequence[bytes]) -> None:
        """Send each frame as a datagram."""
        sendto, counts = self._socket.sendto, self._counts
        for peer in self._served:
            for frame in frames:
                try:
                    sendto(frame, peer)
                    counts.sent += 1
                except OSError:  # no room, or an error that an earlier datagram met
                    counts.dropped += 1

    def close(self) -> None:
        """Close the socket."""
        self._loop.remove_reader(self._socket)
        self._socket.close()

    def _readable(self) -> None:
        for _ in range(_READS_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(_DATAGRAM_MAX)
            except OSError:  # nothing more; or nobody listens at the other end just now
                return
            self._take(data, sender)

    def _take(self, data: bytes, sender: tuple[str, int]) -> None:
        frames = self._framer(sender).push(data)
        if frames:
            self._counts.received += len(frames)
            self._serve(sender, len(frames))
            self._received(frames)

    def _framer(self, sender: tuple[str, int]) -> Framer:
        """One for each sender, so that half a frame of one is not continued by another."""
        framer = self._framers.get(sender)
        if framer is None:
            framer = self._framers[sender] = Framer()
            if len(self._framers) > _SENDERS_MAX:
                _, gone = self._framers.popitem(last=False)
                self._counts += Counts(bad=gone.bad_chunks, unknown=gone.unknown)
        else:
            self._framers.move_to_end(sender)
        return framer

    def _serve(self, sender: tuple[str, int], frames: int) -> None:
        if sender in self._served:
            self._is_locked = True
        elif self._answers_all:
            self._served = [*self._served, sender][-_SENDERS_MAX:]
        elif self._is_locked:
            self._counts.unanswered += frames
        else:
            self._served, self._is_locked = [sender], True


class TcpLink:
    """A TCP server for one client at a time: the next one waits until this one has gone, as at ArduPilot's ports."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, spec: LinkSpec, received: Received, connected: Callable[[], None]
    ) -> None:
        self.spec = spec
        self._received = received
        self._connected = connected
        self._loop = loop
        self._client: socket.socket | None = None
        self._framer = Framer()
        self._rest = b""
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._counts = Counts()
        self._listener = open_tcp(spec)
        loop.add_reader(self._listener, self._accept)

    @property
    def address(self) -> Address:
        """The local address."""
        return local_address(self._listener)

    @property
    def counts(self) -> Counts:
        """What passed so far."""
        return self._counts + Counts(bad=self._framer.bad_chunks, unknown=self._framer.unknown)

    def send(self, frames: Sequence[bytes]) -> None:
        """Send frames, or keep the latest of them until the client reads on; without a client they are lost."""
        if self._client is None:
            return
        self._counts.sent += len(frames)
        if not self._rest:
            self._push(b"".join(frames))
            return
        for frame in frames:
            self._waiting.append(frame)
            self._waiting_bytes += len(frame)
        while self._waiting_bytes > _PENDING_MAX:
            self._waiting_bytes -= len(self._waiting.popleft())
            self._counts.dropped += 1
            self._counts.sent -= 1

    def close(self) -> None:
        """Close the sockets."""
        self._hang_up()
        self._loop.remove_reader(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError:  # it left while it waited
            return
        client.setblocking(False)
        notice_the_gone(client)
        self._client = client
        self._loop.remove_reader(self._listener)
        self._loop.add_reader(client, self._readable)
        self._connected()

    def _readable(self) -> None:
        assert self._client is not None
        try:
            data = self._client.recv(_DATAGRAM_MAX)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self._hang_up()
            return
        frames = self._framer.push(data)
        self._counts.received += len(frames)
        if frames:
            self._received(frames)

    def _writable(self) -> None:
        data = self._rest or b"".join(self._waiting)
        if not self._rest:
            self._waiting.clear()
            self._waiting_bytes = 0
        self._push(data)

    def _push(self, data: bytes) -> None:
        """Send as much as the kernel takes, and the rest when it takes more."""
        assert self._client is not None
        before = bool(self._rest)
        try:
            sent = self._client.send(data)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError:
            self._hang_up()
            return
        self._rest = data[sent:]
        after = bool(self._rest or self._waiting)
        if after and not before:
            self._loop.add_writer(self._client, self._writable)
        elif before and not after:
            self._loop.remove_writer(self._client)

    def _hang_up(self) -> None:
        if self._client is None:
            return
        self._loop.remove_reader(self._client)
        self._loop.remove_writer(self._client)
        self._client.close()
        self._client = None
        self._framer.forget_rest()
        self._rest = b""
        self._waiting.clear()
        self._waiting_bytes = 0
        self._loop.add_reader(self._listener, self._accept)


def open_transport(
    loop: asyncio.AbstractEventLoop,
    spec: LinkSpec,
    received: Received,
    connected: Callable[[], None],
    answers_all: bool = False,
) -> Transport:
    """Open a link.

    Raises:
        EndpointError: the port cannot be opened, or the host is unknown.
    """
    if spec.transport == "tcp":
        return TcpLink(loop, spec, received, connected)
    return UdpLink(loop, spec, received, answers_all)
