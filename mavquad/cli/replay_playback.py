"""`mavquad replay --play`: a log to whoever listens at a UDP endpoint, at its own pace."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.text import Text

from mavquad.cli.terminal import QuietConsole, say, shown
from mavquad.drivers.play import KEYS, LINES, SPEED_LEAST, SPEED_MOST, Player, listens_to, open_player
from mavquad.drivers.playback import Listener, Playback
from mavquad.drivers.run_folder import to_json
from mavquad.errors import EXIT_OK, EndpointError, InputError
from mavquad.tlog import Reading, Record, records
from mavquad.url import Address, parse_url

DIRECTIONS = {"in": (True, False), "out": (False, True), "both": (True, True)}


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """Where to, how fast, over and over, which direction; and what of the log (Unix us, system id; None: all)."""

    url: str
    speed: float = 1.0
    loop: bool = False
    direction: str = "in"
    system: int | None = None
    from_us: int | None = None
    to_us: int | None = None


def play(path: Path, options: PlayOptions, as_json: bool) -> int:
    """Play a log to its end; returns the exit code.

    Raises:
        InputError: an option, or a log without times.
        EndpointError: the endpoint is none that can be sent to.
        LogError: it cannot be read.
    """
    address = _address(options.url)
    if not SPEED_LEAST <= options.speed <= SPEED_MOST:
        raise InputError(f"--speed: {options.speed:g} is not between {SPEED_LEAST:g} and {SPEED_MOST:g}")
    if options.direction not in DIRECTIONS:
        raise InputError(f"--direction: {options.direction!r} is none of {', '.join(DIRECTIONS)}")
    first_us, last_us = _span(path, options)
    started = time.monotonic()
    player = asyncio.run(_play(path, options, address, (first_us, last_us), as_json))
    playback = player.playback
    summary = {
        "frames": playback.frames,
        "bytes": playback.bytes,
        "rounds": playback.rounds,
        "leaps": playback.leaps,
        "position_s": player.position_s,
        "log_s": (last_us - first_us) * 1e-6,
        "wall_s": time.monotonic() - started,
        "heard": player.heard,
    }
    if as_json:
        say(to_json(summary))
    else:
        words = f"{playback.frames} frames, {playback.bytes} bytes in {summary['wall_s']:.1f} s to {address}"
        shown(lambda: QuietConsole(highlight=False).print(Text(words), soft_wrap=True))
    return EXIT_OK


def _address(url: str) -> Address:
    place = parse_url(url)
    if not isinstance(place, Address) or place.listens or place.transport != "udp":
        raise EndpointError(url, "a log is played to a UDP endpoint", "--play udpout:127.0.0.1:14550")
    return place


def _span(path: Path, options: PlayOptions) -> tuple[int, int]:
    """Stamps of the first and the last frame that are played; this goes through the log once."""
    reading = Reading(path)
    for _ in reading:
        pass
    if reading.last_us == 0:
        raise InputError(f"{path}: its frames have no times, so there is no pace to play them at", "a .tlog has them")
    first_us = max(reading.first_us, options.from_us or reading.first_us)
    last_us = min(reading.last_us, options.to_us or reading.last_us)
    if first_us > last_us:
        raise InputError(f"{path}: nothing of it lies between --from and --to")
    return first_us, last_us


async def _play(path: Path, options: PlayOptions, address: Address, span_us: tuple[int, int], as_json: bool) -> Player:
    inbound, outbound = DIRECTIONS[options.direction]

    def open_at(stamp_us: int) -> Iterator[Record]:
        listener = Listener(inbound, outbound)
        chosen = records(path, system=options.system, from_us=stamp_us, to_us=span_us[1])
        return (record for record in chosen if listener.hears(record))

    playback = Playback(open_at, *span_us, _now_us(), speed=options.speed, loop=options.loop)
    player = await open_player(playback, span_us[0], address, _now_us)
    screen = _Screen((span_us[1] - span_us[0]) * 1e-6, quiet=as_json)
    with listens_to(player, screen.complain) as has_keys, _ends_on_ctrl_c(player):
        screen.begin(f"{path} to {address}: {KEYS if has_keys else LINES}")
        await player.run(screen.show)
    screen.end()
    return player


def _now_us() -> int:
    return time.monotonic_ns() // 1000


@contextlib.contextmanager
def _ends_on_ctrl_c(player: Player) -> Iterator[None]:
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGINT, player.wish, "quit")
    try:
        yield
    finally:
        loop.remove_signal_handler(signal.SIGINT)


class _Screen:
    """One line on stderr that says where the log is; nothing but faults where that is no terminal."""

    def __init__(self, log_s: float, quiet: bool) -> None:
        self._console = QuietConsole(stderr=True, highlight=False)
        self._log_s = log_s
        self._quiet = quiet
        self._live = self._console.is_terminal and not quiet

    def begin(self, words: str) -> None:
        if not self._quiet:
            shown(lambda: self._console.print(Text(words), soft_wrap=True))

    def show(self, player: Player) -> None:
        if self._live:
            playback = player.playback
            mark = "paused" if playback.paused else f"x{playback.speed:g}"
            words = f"\r{player.position_s:8.1f} / {self._log_s:.1f} s  {mark:<8} {playback.frames} frames   "
            shown(lambda: self._console.print(Text(words), end="", soft_wrap=True))

    def complain(self, words: str) -> None:
        shown(lambda: self._console.print(Text(words), soft_wrap=True))

    def end(self) -> None:
        if self._live:
            shown(lambda: self._console.print())
