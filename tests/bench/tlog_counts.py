"""The reader against the reference counts, and pymavlink: `python tests/bench/tlog_counts.py`. Exit code 1 if it fails.

Of each log: good frames and frames of unknown messages must be the reference's; every frame that pymavlink's mavlogfile
finds and whose CRC is right must be among ours, in its order; and every value of every message must be pymavlink's, to
the last bit. MAVQUAD_TLOGS names another folder.
"""

from __future__ import annotations

import struct
import sys
from collections import defaultdict
from pathlib import Path

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad import tlog
from mavquad.protocol.codec import is_valid
from tests.tlog_reference import FRAMES_OF, LOGS


def frames_of_mavlogfile(path: Path) -> list[bytes]:
    log = mavutil.mavlogfile(str(path), notimestamps=path.suffix == ".raw")
    frames = []
    while (message := log.recv_match()) is not None:
        if message.get_type() != "BAD_DATA":
            frames.append(bytes(message.get_msgbuf()))
    log.close()
    return [frame for frame in frames if is_valid(frame)]


def is_part_of(some: list[bytes], all_: list[bytes]) -> bool:
    """Whether they are in there, in this order."""
    rest = iter(all_)
    return all(any(frame == other for other in rest) for frame in some)


def is_same(ours, theirs) -> bool:
    if isinstance(theirs, list):
        return len(ours) == len(theirs) and all(map(is_same, ours, theirs))
    if isinstance(theirs, float):
        return struct.pack("<d", ours) == struct.pack("<d", theirs)
    return ours == theirs


def values_differ(path: Path) -> int:
    """Messages of which a value, or the stamp, is not the same in the columns and by pymavlink."""
    log, parser, rows, differ = tlog.read(path), dialect.MAVLink(None), defaultdict(int), 0
    for record in tlog.records(path):
        message = parser.decode(bytearray(record.frame))
        key = (message.get_type(), (message.get_srcSystem(), message.get_srcComponent()))
        table, row = log.tables[key], rows[key]
        rows[key] += 1
        same = table.stamps_us[row] == record.stamp_us
        differ += not (same and all(is_same(table[name][row], getattr(message, name)) for name in table.fields))
    return differ + sum(len(table) != rows[key] for key, table in log.tables.items())


def main() -> int:
    table = Table(box=None)
    for head in (
        "log",
        "frames",
        "reference",
        "mavlogfile",
        "unknown",
        "bad bytes",
        "ATTITUDE",
        "LOCAL_POS",
        "differ",
        "",
    ):
        table.add_column(head, justify="left" if head == "log" else "right")
    failed = 0
    for name, reference in FRAMES_OF.items():
        path = LOGS / name
        log = tlog.read(path, ("ATTITUDE", "LOCAL_POSITION_NED"))
        theirs, ours = frames_of_mavlogfile(path), [record.frame for record in tlog.records(path)]
        differ = values_differ(path)
        is_right = (log.frames, log.unknown_frames) == reference and is_part_of(theirs, ours) and not differ
        failed += not is_right
        counts = (sum(map(len, log[kind].values())) for kind in ("ATTITUDE", "LOCAL_POSITION_NED"))
        cells = (log.frames, reference[0], len(theirs), log.unknown_frames, log.bad_bytes, *counts, differ)
        table.add_row(path.stem[:34], *map(str, cells), "right" if is_right else "WRONG")
    Console(width=130).print(table)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
