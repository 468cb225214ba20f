"""The bytes of a log's file in pieces, plain or gzip; every fault of a file as one clear error."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mavquad.errors import LogError

PIECE = 1 << 20
"""Bytes that are worked on at a time."""

_GZIP = b"\x1f\x8b"
_OTHERS = {
    b"PK\x03\x04": "a zip archive",
    b"\x89PNG": "a picture",
    b"ULog": "a PX4 .ulg log",
    b"\xa3\x95": "an ArduPilot .bin log",
}
_WANTED = "a .tlog, as written by mavquad, MAVProxy, Mission Planner or QGroundControl, is wanted"
_LEAST_GOOD_PART = 1000  # random bytes hold about one "frame" with a right CRC in 10 MB; a log holds more than that


def pieces(path: Path) -> Iterator[bytes]:
    """The file from its beginning to where it ended when it was opened; what is appended later is left for later.

    A gzip that is cut or damaged ends where it can no longer be unpacked.

    Raises:
        LogError: there is no such file, or it cannot be read.
    """
    try:
        with path.open("rb") as stream:
            if stream.read(2) == _GZIP:
                stream.seek(0)
                yield from _unpacked(stream)
            else:
                yield from _plain(stream)
    except FileNotFoundError:
        raise LogError(str(path), "no such file") from None
    except IsADirectoryError:
        hint = f"did you mean {path / 'flight.tlog'}?" if (path / "flight.tlog").exists() else "name a .tlog file"
        raise LogError(str(path), "is a folder, not a file", hint) from None
    except PermissionError:
        raise LogError(str(path), "no permission to read it", f"chmod u+r {path}") from None
    except OSError as error:
        raise LogError(str(path), error.strerror or str(error)) from None


def not_a_log(path: Path, size: int, good_bytes: int, head: bytes) -> LogError | None:
    """Why a file is no telemetry log, from its size, the bytes of its good frames and its first bytes; None if it is."""
    if not size and path.stat().st_size:
        return LogError(str(path), "nothing in it can be unpacked", "the gzip is cut or damaged")
    if not size:
        return LogError(str(path), "the file is empty", "was the recording stopped before anything arrived?")
    if good_bytes * _LEAST_GOOD_PART >= size:
        return None
    other = next((name for start, name in _OTHERS.items() if head.startswith(start)), "")
    what = f"not a telemetry log but {other}" if other else "not a telemetry log"
    return LogError(str(path), f"{what}: no MAVLink frames in {size} bytes", _WANTED)


def _plain(stream: BinaryIO) -> Iterator[bytes]:
    left = stream.seek(0, 2)
    stream.seek(0)
    while left > 0 and (piece := stream.read(min(PIECE, left))):
        left -= len(piece)
        yield piece


def _unpacked(stream: BinaryIO) -> Iterator[bytes]:
    with gzip.open(stream) as unpacked:
        while True:
            try:
                piece = unpacked.read1(PIECE)
            except (EOFError, zlib.error, gzip.BadGzipFile):
                return
            if not piece:
                return
            yield piece
