"""The run folder: everything that a flight leaves behind.

    config.toml    the configuration in force, complete
    parameters.json what is changed on the vehicle, and was before; there before anything is changed
    flight.tlog    both directions, as pymavlink and MAVProxy read it
    events.jsonl   the start, the operator's commands, the end
    notes.jsonl    the story: phases, the vehicle's texts, guards
    trace.csv      one row a step of the law
    summary.json   what was measured
    flight.png     to be looked at
    report.html    the same to be looked into: a page that needs nothing else

What streams in during the flight is flushed about once a second, so that a crash of ours loses no more than that;
what is written at the end appears whole or not at all.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mavquad.analysis.trace import TraceWriter
from mavquad.drivers.replay import OperatorEvent
from mavquad.errors import RunFolderError
from mavquad.flight_record import Note, TraceRow
from mavquad.tlog import TlogWriter

FLUSH_US = 1_000_000
EVENT_ARGUMENTS = {
    "start": (0,),
    "kept": (0,),
    "takeoff": (0, 1),
    "goto": (3, 4),
    "fly": (1,),
    "land": (0,),
    "stop": (0,),
    "late": (1,),
    "end": (0,),
}
"""How many arguments each event may have. takeoff: height in m; goto: north, east, down in m, and heading in degrees
where it is given; fly: the mission in JSON, the only text; late: by how many us a setpoint left late. The driver says kept
when what a flight is about to change on its vehicle is safe in the run folder."""


class RunFolder:
    """An open run folder; also the `Recorder` of the flight's `Runner`. Close it when the flight is over.

    Attributes:
        failure: why the recording stopped; None while it goes on.
    """

    def __init__(self, path: Path, config_text: str) -> None:
        """Make the folder.

        Raises:
            RunFolderError: it exists and is not empty, or it cannot be written.
        """
        self.path = path
        self.failure: RunFolderError | None = None
        self._written_us = self._flushed_us = 0
        self._frames: list[tuple[int, bytes, bool]] = []
        try:
            self._made = not path.exists()
            path.mkdir(parents=True, exist_ok=True)
            if any(path.iterdir()):
                raise RunFolderError(str(path), "the run folder is not empty", "choose another with --run-dir")
            (path / "config.toml").write_text(config_text, encoding="utf-8")
            self._tlog_stream = (path / "flight.tlog").open("wb")
            self._events = (path / "events.jsonl").open("w", encoding="utf-8")
            self._notes = (path / "notes.jsonl").open("w", encoding="utf-8")
            self._trace_stream = (path / "trace.csv").open("w", encoding="utf-8", newline="")
        except OSError as error:
            raise _error(self.path, error) from None
        self._streams = (self._tlog_stream, self._events, self._notes, self._trace_stream)
        self._tlog = TlogWriter(self._tlog_stream)
        self._trace = TraceWriter(self._trace_stream)

    def frame(self, stamp_us: int, frame: bytes, outbound: bool) -> None:
        """One frame that passed. It is written by the next `add`: neither what answers it nor the frame behind it waits."""
        if self.failure is None:
            self._frames.append((stamp_us, frame, outbound))

    def event(self, stamp_us: int, name: str, args: tuple[float | str, ...] = ()) -> None:
        """One command of the operator; on the disk at once."""
        line = json.dumps({"stamp_us": stamp_us, "name": name, **({"args": args} if args else {})}, allow_nan=False)
        self._keep(lambda: print(line, file=self._events, flush=True))

    def add(self, rows: Sequence[TraceRow], notes: Sequence[Note]) -> None:
        """Write what passed, and what the agent handed out, since the last call."""
        self._keep(lambda: self._add(rows, notes))

    def _add(self, rows: Sequence[TraceRow], notes: Sequence[Note]) -> None:
        self._write_frames()
        self._trace.write(rows)
        for note in notes:
            self._notes.write(json.dumps(asdict(note)) + "\n")
        if self._written_us - self._flushed_us > FLUSH_US:
            self._flushed_us = self._written_us
            for stream in self._streams:
                stream.flush()

    def _write_frames(self) -> None:
        frames, self._frames = self._frames, []
        for stamp_us, frame, outbound in frames:
            self._tlog.write(stamp_us, frame, outbound)
            self._written_us = stamp_us

    def _keep(self, write: Callable[[], None]) -> None:
        """Write; a full disk must not end a flight, so the first failure ends the recording and is told afterwards."""
        if self.failure is None:
            try:
                write()
            except OSError as error:
                self.failure = _error(self.path, error)

    def write_whole(self, name: str, text: str) -> None:
        """Write a file so that it appears whole or not at all.

        Raises:
            RunFolderError: it cannot be written.
        """
        write_whole(self.path / name, text)

    def close(self) -> None:
        """Write what is left and close the streams; once is enough."""
        self._keep(self._write_frames)
        for stream in self._streams:
            if not stream.closed:
                self._keep(stream.flush)
            with contextlib.suppress(OSError):
                stream.close()

    def discard(self) -> None:
        """Remove what was written, and the folder if it is ours: nothing came of the flight."""
        self.close()
        with contextlib.suppress(OSError):
            for stream in self._streams:
                Path(stream.name).unlink(missing_ok=True)
            (self.path / "config.toml").unlink(missing_ok=True)
            if self._made:
                self.path.rmdir()


def write_whole(path: Path, text: str) -> None:
    """Write a file so that it appears whole or not at all, also if the power fails.

    Raises:
        RunFolderError: it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.part")
    try:
        with temporary.open("w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise _error(path.parent, error) from None


def _error(path: Path, error: OSError) -> RunFolderError:
    reason = (error.strerror or str(error)).lower()
    return RunFolderError(str(path), f"cannot be written ({reason})", "choose another with --run-dir")


def read_events(path: Path) -> list[OperatorEvent]:
    """The events of a run folder.

    Raises:
        RunFolderError: the file is missing or damaged.
    """
    try:
        lines = (path / "events.jsonl").read_text(encoding="utf-8").splitlines()
        return [_event(**json.loads(line)) for line in lines]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise RunFolderError(str(path / "events.jsonl"), f"cannot be read ({reason})") from None
    except (ValueError, TypeError):
        raise RunFolderError(str(path / "events.jsonl"), "is damaged") from None


def _event(stamp_us: int, name: str, args: Sequence[float | str] = ()) -> OperatorEvent:
    if name == "fly":
        fits = all(type(arg) is str for arg in args)
    else:
        fits = all(type(arg) in (int, float) and math.isfinite(arg) for arg in args)  # type: ignore[arg-type]
    if type(stamp_us) is not int or not fits or len(args) not in EVENT_ARGUMENTS.get(name, ()):
        raise ValueError(f"not an event: {name!r} {args!r} at {stamp_us!r}")
    return OperatorEvent(stamp_us, name, tuple(args))


def read_notes(path: Path) -> list[Note]:
    """The story of a run folder."""
    lines = (path / "notes.jsonl").read_text(encoding="utf-8").splitlines()
    return [Note(**json.loads(line)) for line in lines]


def to_json(value: Any) -> str:
    """JSON as this project writes it: indented, no NaN."""
    return json.dumps(value, indent=2, allow_nan=False) + "\n"
