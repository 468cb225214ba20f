"""`python -m tests.conformance.cut FILES...`: recordings cut to what the exchanges need, into `recordings/`.

Kept are the client's frames and the vehicle's COMMAND_ACK, HEARTBEAT, STATUSTEXT, PARAM_VALUE, what was requested by
REQUEST_MESSAGE, answers to TIMESYNC, and one ATTITUDE in two seconds, which tells the vehicle's clock. Of a stream of
setpoints one message in `_SETPOINT_US` is kept.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

from mavquad.protocol.codec import decode, frame_source, mavlink, message_id
from mavquad.tlog import Record, pack_record, read_records
from tests.conformance.recording import VEHICLE, clock_of, short_name

FOLDER = Path(__file__).parent / "recordings"
_KEPT = ("COMMAND_ACK", "HEARTBEAT", "STATUSTEXT", "PARAM_VALUE")
_SETPOINTS = ("SET_ATTITUDE_TARGET", "SET_ACTUATOR_CONTROL_TARGET", "SET_POSITION_TARGET_LOCAL_NED")
_SETPOINT_US = 40_000


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for path in map(Path, sys.argv[1:]):
        records = sorted(read_records(path), key=lambda record: record.stamp_us)
        kept = b"".join(pack_record(r.stamp_us, r.frame, frame_source(r.frame) != VEHICLE) for r in _cut(records))
        target = FOLDER / f"{short_name(path)}.tlog.gz"
        target.write_bytes(gzip.compress(kept, mtime=0))
        print(f"{target.name}: {len(kept) // 1000} kB, packed {target.stat().st_size // 1000} kB")


def _cut(records: list[Record]) -> list[Record]:
    clock = clock_of(records)
    requested = _requested(records)
    kept: list[Record] = []
    setpoint_us = 0
    for record in records:
        name = mavlink.mavlink_map[message_id(record.frame)].msgname
        if frame_source(record.frame) == VEHICLE:
            answers = name == "TIMESYNC" and decode(record.frame).tc1 != 0
            if name in _KEPT or answers or name in requested or record in clock or record is records[0]:
                kept.append(record)
        elif name not in _SETPOINTS:
            kept.append(record)
        elif record.stamp_us >= setpoint_us + _SETPOINT_US:
            kept.append(record)
            setpoint_us = record.stamp_us
    return [*kept, records[-1]] if kept[-1] is not records[-1] else kept


def _requested(records: list[Record]) -> set[str]:
    """Names of the messages that were asked for by REQUEST_MESSAGE."""
    names = set()
    for record in records:
        message = decode(record.frame)
        if message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            asked = mavlink.mavlink_map.get(int(message.param1))
            names.add(asked.msgname if asked else "")
    return names


if __name__ == "__main__":
    main()
