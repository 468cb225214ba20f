"""How fast logs are read beside pymavlink and fasttlogparser: `python tests/bench/tlog_speed.py [FOLDER or FILE ...]`.

Every reader decodes all ATTITUDE and LOCAL_POSITION_NED of each log, in a process of its own; the time is that of the
processor, the least of some runs, without starting Python. mavlogfile checks each CRC, as we do; what
mavutil.mavlink_connection opens for reading (mavmmaplog) does not. fasttlogparser is left out if it is not installed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.tlog_reference import LOGS

WANTED = ("ATTITUDE", "LOCAL_POSITION_NED")
LEAST_S = 1.0  # spent on one log by one reader, at least one run


def by_mavlogfile(path: str) -> Callable[[], int]:
    from pymavlink import mavutil

    return lambda: loop(mavutil.mavlogfile(path), None)


def by_mavmmaplog(path: str) -> Callable[[], int]:
    from pymavlink import mavutil

    return lambda: loop(mavutil.mavmmaplog(path), list(WANTED))


def loop(log, types) -> int:
    """A user's loop; mavlogfile decodes every message before it looks at its type."""
    count = 0
    while (message := log.recv_match(type=types)) is not None:
        count += message.get_type() in WANTED
    log.close()
    return count


def by_fasttlogparser(path: str) -> Callable[[], int]:
    import fasttlogparser

    def read() -> int:
        found = fasttlogparser.parseTLog(path, whitelist=list(WANTED))[0]
        return sum(len(found[name]["timestamp"]) for name in WANTED if name in found)

    return read


def by_mavquad(path: str) -> Callable[[], int]:
    from mavquad import tlog

    def read() -> int:
        tables = tlog.read(path, WANTED).tables.values()
        return sum(len(column) for table in tables for column in list(table.columns().values())[:1])

    return read


READERS = {
    "mavlogfile": by_mavlogfile,
    "mavmmaplog": by_mavmmaplog,
    "fasttlogparser": by_fasttlogparser,
    "mavquad": by_mavquad,
}


def measure(name: str, path: str) -> None:
    """Prints [seconds, messages]."""
    read = READERS[name](path)
    least_s, spent_s = float("inf"), 0.0
    while spent_s < LEAST_S:
        started = time.process_time()
        count = read()
        took = time.process_time() - started
        least_s, spent_s = min(least_s, took), spent_s + took
    print(json.dumps([least_s, count]))


def in_a_process(name: str, path: Path) -> tuple[float, int] | None:
    command = [sys.executable, __file__, "--measure", name, str(path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    return tuple(json.loads(ended.stdout.splitlines()[-1])) if ended.returncode == 0 else None


def cell(result: tuple[float, int] | None, base_s: float) -> str:
    return f"{result[0] * 1e3:.1f}  {result[1]}  {base_s / result[0]:.0f}x" if result else "-"


def main(arguments: list[str]) -> None:
    if arguments[:1] == ["--measure"]:
        measure(*arguments[1:])
        return
    given = [Path(argument) for argument in arguments] or [LOGS]
    paths = [path for place in given for path in (sorted(place.glob("*.tlog")) if place.is_dir() else [place])]
    table = Table(box=None, title="ms of the processor; messages found; times as fast as mavlogfile")
    for head in ("log", "MB", *READERS):
        table.add_column(head, justify="left" if head == "log" else "right")
    totals = dict.fromkeys(READERS, 0.0)
    for path in paths:
        found = {name: in_a_process(name, path) for name in READERS}
        base_s = found["mavlogfile"][0]
        for name, result in found.items():
            totals[name] += result[0] if result else float("nan")
        words = [cell(result, base_s) for result in found.values()]
        table.add_row(path.stem[:34], f"{path.stat().st_size / 1e6:.2f}", *words)
    table.add_row(
        "all", "", *(f"{total_s * 1e3:.0f}  {totals['mavlogfile'] / total_s:.0f}x" for total_s in totals.values())
    )
    Console(width=150).print(table)


if __name__ == "__main__":
    main(sys.argv[1:])
