"""Sockets and serial ports of the live driver: bytes in, bytes out, and what happens when the other end goes away.

    UdpTransport      datagrams, one peer
    ServedStream      a TCP server with one client
    StreamTransport   a TCP connection or a serial port, opened again and again once it was lost

A stream that is lost ends nothing: the endpoint lives on for its deadlines (it will ask for a hold, and count the
vehicle as lost in its own time), what it sends meanwhile is dropped, and it is told in a note. What a slow stream has
not taken yet is dropped too, the newest first: a setpoint that comes late is worse than none.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import re
import socket
import struct
import sys
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, Protocol, cast

from mavquad.errors import EndpointError
from mavquad.protocol.codec import is_known
from mavquad.url import Address, Place, SerialPort

RECONNECT_S = 0.2
BACKLOG_MAX = 512
"""Bytes that may wait in a stream: a tenth of a second at 57600 baud."""
_SEND_BUFFER = 16384
"""Of TCP, in the kernel; it counts some hundred bytes of its own for each frame, so these are tens of frames."""
_HINT = "check the host and the port"
DATAGRAMS_AT_ONCE = 10_000
"""Read in one go; a flood must not keep the deadlines from firing for ever."""
_TIMESTAMPS = 35 if sys.platform == "linux" else None
"""SO_TIMESTAMPNS, and SCM_TIMESTAMPNS; Python has no name for it."""
_TIMESPEC = struct.Struct("@ll")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) if hasattr(socket, "CMSG_SPACE") else 0
_LONGEST = 65536
_OLDEST_US = 2_000_000

Peer = tuple[str, int]


class Receiver(Protocol):
    """The driver, as its transport sees it."""

    def cut(self, data: bytes) -> list[bytes]:
        """The whole frames that these bytes complete."""

    def take(self, frames: list[bytes], age_us: int = 0) -> None:
        """Hand frames to the endpoint, as of so long ago."""

    def take_bytes(self, data: bytes, age_us: int = 0) -> None:
        """Both."""

    def forget_rest(self) -> None:
        """What comes next does not continue what came before."""

    def is_locked(self) -> bool:
        """Whether the endpoint knows whom it serves."""

    def note_stranger(self) -> None:
        """Count a datagram, or a client, that is not the peer's."""

    def note(self, text: str) -> None:
        """Tell the operator."""


class Transport(Protocol):
    """A way to the vehicle."""

    async def open(self) -> None:
        """Open it; raises OSError."""

    def send(self, frame: bytes) -> bool:
        """Send a frame now; False if it was dropped."""

    @property
    def port(self) -> int:
        """The local port; 0 where there is none."""

    def close(self) -> None:
        """Close it; for good."""


class UdpTransport:
    """Speaks to the address that it was given, or answers who spoke last until the peer is known: the address whose
    frame made the endpoint lock. From then on datagrams of others are counted and ignored.

    All that waits is read at once, each datagram with the time at which the kernel took it in (Linux: SO_TIMESTAMPNS): when
    this program has stalled, what waited meanwhile counts as of its own time, and only a vehicle that is really silent
    is taken for silent.
    """

    def __init__(self, receiver: Receiver, address: Address) -> None:
        self._address = address
        self._receiver = receiver
        self._peer: Peer | None = None
        self._heard: Peer | None = None
        self._locked = False
        self._socket: socket.socket | None = None

    async def open(self) -> None:
        """Open the socket."""
        loop, address = asyncio.get_running_loop(), self._address
        family, kind, protocol, _, (host, port, *_) = (
            await loop.getaddrinfo(address.host, address.port, type=socket.SOCK_DGRAM)
        )[0]
        opened = socket.socket(family, kind, protocol)
        try:
            opened.setblocking(False)
            if _TIMESTAMPS is not None:
                opened.setsockopt(socket.SOL_SOCKET, _TIMESTAMPS, 1)
            if address.listens:
                opened.bind((host, port))
            else:
                opened.connect((host, port))
                self._peer = self._heard = (str(host), int(port))
                self._locked = True
        except OSError:
            opened.close()
            raise
        self._socket = opened
        loop.add_reader(opened, self._read)

    def _read(self) -> None:
        """Take in all that waits, so that it comes before the deadlines that are due by now."""
        assert self._socket is not None
        for _ in range(DATAGRAMS_AT_ONCE):
            try:
                data, ancillary, _, sender = self._socket.recvmsg(_LONGEST, _ANCILLARY)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                continue  # nobody listens at the other end just now; a vehicle that starts later is still found
            self._take(data, _age_us(ancillary), sender[:2])
            if self._socket is None:
                return

    def _take(self, data: bytes, age_us: int, sender: Peer) -> None:
        if not self._locked:
            self._take_unlocked(data, age_us, sender)
        elif not self._address.listens or sender == self._peer:
            self._receiver.take_bytes(data, age_us)
        else:
            self._receiver.note_stranger()

    def _take_unlocked(self, data: bytes, age_us: int, sender: Peer) -> None:
        if sender != self._heard:
            self._receiver.forget_rest()  # half a frame of somebody else
            self._heard = sender
        frames = self._receiver.cut(data)
        if any(map(is_known, frames)):
            self._peer = sender
        self._receiver.take(frames, age_us)
        self._locked = self._peer == sender and self._receiver.is_locked()

    def send(self, frame: bytes) -> bool:
        """Send a datagram to the peer, if there is one."""
        if self._socket is None or self._peer is None:
            return False
        try:
            if self._address.listens:
                self._socket.sendto(frame, self._peer)
            else:
                self._socket.send(frame)
        except OSError:
            return False  # refused by an end that does not listen yet, or the buffer is full: late is worse than never
        return True

    @property
    def port(self) -> int:
        """The local port."""
        assert self._socket is not None
        return int(self._socket.getsockname()[1])

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None


def _age_us(ancillary: list[tuple[int, int, bytes]]) -> int:
    """How long ago the kernel took in a datagram; 0 where it does not tell, or where the system's clock was set."""
    for level, kind, data in ancillary:
        if level == socket.SOL_SOCKET and kind == _TIMESTAMPS and len(data) >= _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack_from(data)
            age_us = (time.time_ns() - seconds * 1_000_000_000 - nanoseconds) // 1000
            return age_us if 0 <= age_us < _OLDEST_US else 0
    return 0


class _Stream(asyncio.Protocol):
    """What a connected stream does, whoever opened it."""

    def __init__(self, receiver: Receiver, words: str) -> None:
        self._receiver = receiver
        self._words = words
        self._stream: asyncio.Transport | None = None
        self._closed = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The stream is open."""
        self._stream = cast(asyncio.Transport, transport)
        tcp = transport.get_extra_info("socket")
        if tcp is not None:
            tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            tcp.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)

    def data_received(self, data: bytes) -> None:
        """Some bytes, cut anywhere."""
        self._receiver.take_bytes(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """The other end closed, or the device is gone."""
        self._stream = None
        self._receiver.forget_rest()
        if not self._closed:
            reason = f" ({_reason(exc)})" if isinstance(exc, OSError) else ""
            self._receiver.note(f"{self._words}: the connection was lost{reason}; {self._lost()}")

    def _lost(self) -> str:
        """Do something about it; returns what, in words."""
        raise NotImplementedError

    def send(self, frame: bytes) -> bool:
        """Write a frame, unless the stream is lost or has not taken what was written before."""
        stream = self._stream
        if stream is None or stream.is_closing() or _waiting(stream) > BACKLOG_MAX:
            return False
        stream.write(frame)
        return True

    def close(self) -> None:
        """Close the stream; one that does not take what was written is not waited for."""
        self._closed = True
        if self._stream is not None:
            self._stream.abort() if self._stream.get_write_buffer_size() else self._stream.close()


def _waiting(stream: asyncio.Transport) -> int:
    """Bytes that have not left: in the stream, and in the kernel where a serial port tells it."""
    waiting = stream.get_write_buffer_size()
    serial = stream.get_extra_info("serial")
    if serial is None:
        return waiting
    with contextlib.suppress(OSError, AssertionError):  # it is being closed
        waiting += int(serial.num_unwritten_bytes())
    return waiting


class StreamTransport(_Stream):
    """A connection that is opened again when it is lost, every `RECONNECT_S` until it succeeds."""

    def __init__(self, receiver: Receiver, words: str, connect: Callable[[asyncio.Protocol], Awaitable[Any]]) -> None:
        super().__init__(receiver, words)
        self._connect = connect
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Connect."""
        await self._connect(self)

    def _lost(self) -> str:
        self._task = asyncio.get_running_loop().create_task(self._reconnect())
        return "it is tried again and again"

    async def _reconnect(self) -> None:
        while True:
            await asyncio.sleep(RECONNECT_S)
            with contextlib.suppress(OSError):
                await self._connect(self)
                self._receiver.note(f"{self._words}: connected again")
                return

    @property
    def port(self) -> int:
        """The local port of a TCP connection."""
        name = self._stream.get_extra_info("sockname") if self._stream is not None else None
        return int(name[1]) if name else 0

    def close(self) -> None:
        """Close the stream, or stop trying."""
        if self._task is not None:
            self._task.cancel()
        super().close()


class ServedStream(_Stream):
    """A TCP server with one client at a time; another one meanwhile is a stranger, and is sent away."""

    def __init__(self, receiver: Receiver, address: Address) -> None:
        super().__init__(receiver, str(address))
        self._address = address
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Open the port."""
        loop, address = asyncio.get_running_loop(), self._address
        self._server = await loop.create_server(lambda: _Client(self), address.host, address.port, backlog=1)

    @property
    def is_served(self) -> bool:
        """Whether there is a client."""
        return self._stream is not None

    def note_stranger(self) -> None:
        """Count a second client."""
        self._receiver.note_stranger()

    def _lost(self) -> str:
        return "the next client is waited for"

    @property
    def port(self) -> int:
        """The port that is listened to."""
        assert self._server is not None
        return int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Close the port and the client's connection."""
        if self._server is not None:
            self._server.close()
        super().close()


class _Client(asyncio.Protocol):
    """One client of a server: the one that is served, or one to be sent away."""

    def __init__(self, server: ServedStream) -> None:
        self._server: ServedStream | None = server

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert self._server is not None
        if self._server.is_served:
            self._server.note_stranger()
            self._server = None
            cast(asyncio.Transport, transport).abort()
        else:
            self._server.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        if self._server is not None:
            self._server.data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        if self._server is not None:
            self._server.connection_lost(exc)


# ---------------------------------------------------------------------- opening


def transport_for(place: Place, receiver: Receiver) -> Transport:
    """The transport to a place, not yet open.

    Raises:
        EndpointError: the package for serial ports is not installed.
    """
    if isinstance(place, SerialPort):
        return StreamTransport(receiver, str(place), _serial(place))
    if place.transport == "udp":
        return UdpTransport(receiver, place)
    return ServedStream(receiver, place) if place.listens else StreamTransport(receiver, str(place), _tcp(place))


def _tcp(address: Address) -> Callable[[asyncio.Protocol], Awaitable[Any]]:
    async def connect(protocol: asyncio.Protocol) -> None:
        await asyncio.get_running_loop().create_connection(lambda: protocol, address.host, address.port)

    return connect


def _serial(port: SerialPort) -> Callable[[asyncio.Protocol], Awaitable[Any]]:
    try:
        from serialx import create_serial_connection
    except ImportError:
        hint = "pip install 'mavquad[serial]'"
        raise EndpointError(str(port), "serial ports need the package serialx, which is not installed", hint) from None

    async def connect(protocol: asyncio.Protocol) -> None:
        await create_serial_connection(asyncio.get_running_loop(), lambda: protocol, port.device, port.baud)

    return connect


@contextlib.contextmanager
def explained(place: Place) -> Iterator[None]:
    """Turn what goes wrong while a transport opens into an `EndpointError` in a user's words."""
    try:
        yield
    except UnicodeError:
        raise EndpointError(str(place), "cannot be opened (this is no host name)", _HINT) from None
    except OSError as error:
        raise EndpointError(str(place), f"cannot be opened ({_reason(error)})", _what_to_do(place, error)) from None


def _reason(error: OSError) -> str:
    # Of its own, asyncio adds the address to the words of some errors.
    number = _number(error)
    return (os.strerror(number) if number in errno.errorcode else error.strerror or str(error)).lower()


def _number(error: OSError) -> int:
    """The errno; where several addresses of a host were tried, asyncio has it in the text alone."""
    found = re.search(r"\[Errno (\d+)\]", str(error))
    return error.errno or (int(found[1]) if found else 0)


def _what_to_do(place: Place, error: OSError) -> str:
    if isinstance(place, SerialPort):
        return {
            errno.ENOENT: "is it plugged in? ls /dev/serial/by-id shows what is",
            errno.EACCES: "your user may not use it: sudo usermod -aG dialout $USER, and log in again",
            errno.EBUSY: "another program has it; stop it",
        }.get(_number(error), "check the device and its baud rate")
    return {
        errno.EADDRINUSE: "another program has this port; stop it or choose another",
        errno.ECONNREFUSED: "nobody listens there: start the simulator, or check the port",
    }.get(_number(error), _HINT)
