"""A log played back to a UDP endpoint, in asyncio's event loop, with somebody at the keys."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from typing import cast

from mavquad.drivers.playback import Playback
from mavquad.errors import EndpointError
from mavquad.url import Address

STEP_S = 10.0
"""How far an arrow leads."""
LOOK_S = 0.25
"""Between two looks at the display."""
SPEED_LEAST, SPEED_MOST = 0.01, 1000.0
KEYS = "space pauses, left and right by 10 s, up and down the speed, q ends"
LINES = "on stdin: pause, play, seek SECONDS (or +SECONDS, -SECONDS), speed N, quit"

_ARROWS = {b"\x1b[D": f"seek -{STEP_S}", b"\x1b[C": f"seek +{STEP_S}", b"\x1b[A": "faster", b"\x1b[B": "slower"}
_KEYS = {b" ": "toggle", b"q": "quit", b"Q": "quit", b"\x04": "quit", b"+": "faster", b"-": "slower", b"0": "seek 0"}
_LINE_MAX = 200


class Player(asyncio.DatagramProtocol):
    """Sends what is due. Use `play`.

    Attributes:
        playback: the pace.
        heard: datagrams that came back; they are not read.
    """

    def __init__(self, playback: Playback, first_us: int, now_us: Callable[[], int]) -> None:
        self.playback = playback
        self.heard = 0
        self._first_us = first_us
        self._now_us = now_us
        self._changed = asyncio.Event()
        self._quit = False
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The socket is open."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Whoever watches speaks too: its heartbeats and requests change nothing."""
        self.heard += 1

    def error_received(self, exc: Exception) -> None:
        """Nobody listens at the other end just now; who starts later sees the rest."""

    # ------------------------------------------------------------------ wishes

    @property
    def position_s(self) -> float:
        """Seconds since the log began."""
        return (self.playback.position_us(self._now_us()) - self._first_us) * 1e-6

    def wish(self, words: str) -> str:
        """Do what a key or a line says; returns what is wrong with it, or nothing."""
        name, _, argument = words.strip().partition(" ")
        now_us, playback = self._now_us(), self.playback
        if name == "toggle":
            name = "play" if playback.paused else "pause"
        if name == "quit":
            self._quit = True
        elif name == "pause":
            playback.pause(now_us)
        elif name == "play":
            playback.resume(now_us)
        elif name in ("faster", "slower"):
            self._set_speed(playback.speed * (2.0 if name == "faster" else 0.5), now_us)
        elif name in ("seek", "speed"):
            return self._number(name, argument.strip(), now_us)
        elif name:
            return f"{words.strip()!r} is not known; {LINES}"
        self._changed.set()
        return ""

    def _number(self, name: str, text: str, now_us: int) -> str:
        try:
            value = float(text)
        except ValueError:
            return f"{name}: {text!r} is not a number; {LINES}"
        if not abs(value) < 1e9 or (name == "speed" and not SPEED_LEAST <= value <= SPEED_MOST):
            return f"{name}: {text} is out of range"
        if name == "speed":
            self._set_speed(value, now_us)
        else:
            from_us = self.playback.position_us(now_us) if text[0] in "+-" else self._first_us
            self.playback.seek(from_us + round(value * 1e6), now_us)
        self._changed.set()
        return ""

    def _set_speed(self, speed: float, now_us: int) -> None:
        self.playback.change_speed(min(max(speed, SPEED_LEAST), SPEED_MOST), now_us)

    # ------------------------------------------------------------------ the run

    async def run(self, show: Callable[[Player], None]) -> None:
        """Play to the end, or until somebody has had enough."""
        looked_us = 0
        while not self._quit and not self.playback.done:
            self._send_due()
            now_us = self._now_us()
            if now_us - looked_us >= LOOK_S * 1e6:
                looked_us = now_us
                show(self)
            wait_s = min(max(0.0, (self.playback.next_deadline_us() - self._now_us()) * 1e-6), LOOK_S)
            self._changed.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._changed.wait(), wait_s)
        show(self)
        if self._transport is not None:
            self._transport.close()

    def _send_due(self) -> None:
        transport = self._transport
        assert transport is not None
        if cast(asyncio.WriteTransport, transport).get_write_buffer_size() == 0:
            for frame in self.playback.frames_due(self._now_us()):
                transport.sendto(frame)


async def open_player(playback: Playback, first_us: int, address: Address, now_us: Callable[[], int]) -> Player:
    """Open the socket.

    Raises:
        EndpointError: the host is unknown, or the socket cannot be opened.
    """
    loop = asyncio.get_running_loop()
    try:
        _, player = await loop.create_datagram_endpoint(
            lambda: Player(playback, first_us, now_us), remote_addr=(address.host, address.port)
        )
    except UnicodeError:
        raise EndpointError(str(address), "this is no host name", "check the host and the port") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise EndpointError(str(address), f"cannot be opened ({reason})", "check the host and the port") from None
    return player


@contextlib.contextmanager
def listens_to(player: Player, complain: Callable[[str], None]) -> Iterator[bool]:
    """Keys of a terminal, or lines of anything else, become wishes; yields whether it is a terminal."""
    loop, stream = asyncio.get_running_loop(), sys.stdin
    if stream is None or stream.closed:
        yield False
        return
    number = stream.fileno()
    is_terminal = os.isatty(number)
    reader = _Keys(player) if is_terminal else _Lines(player, complain)

    def read() -> None:
        data = os.read(number, 1024)
        if not data:
            loop.remove_reader(number)  # whoever wrote has left: play on
        reader.take(data)

    before = termios.tcgetattr(number) if is_terminal else None
    try:
        if before is not None:
            tty.setcbreak(number)
        try:
            loop.add_reader(number, read)
        except OSError as error:
            if error.errno != errno.EPERM:
                raise
            reader.take(stream.buffer.read(1 << 16))  # a file: all its lines at once
        yield is_terminal
    finally:
        loop.remove_reader(number)
        if before is not None:
            termios.tcsetattr(number, termios.TCSADRAIN, before)


class _Keys:
    """A terminal's keys, one wish each."""

    def __init__(self, player: Player) -> None:
        self._player = player

    def take(self, data: bytes) -> None:
        while data:
            arrow = next((code for code in _ARROWS if data.startswith(code)), None)
            key = arrow or data[:1]
            data = data[len(key) :]
            if wish := _ARROWS.get(key) or _KEYS.get(key):
                self._player.wish(wish)


class _Lines:
    """Lines of whatever stdin is; the last one may lack its end."""

    def __init__(self, player: Player, complain: Callable[[str], None]) -> None:
        self._player = player
        self._complain = complain
        self._rest = b""

    def take(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        if not data or len(self._rest) > _LINE_MAX:
            lines, self._rest = [*lines, self._rest], b""
        for line in lines:
            if fault := self._player.wish(line.decode(errors="replace")):
                self._complain(fault)
