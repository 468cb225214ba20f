"""Telemetry logs: a writer, and a reader that is fast, resynchronises on CRC and never loses a good frame.

`read` gives the columns of messages, `records` and `messages` go through a log one by one in bounded memory,
`read_records` and `scan` hold a whole log in memory; `Scanner` takes in what grows, piece by piece.
"""

from mavquad.tlog.columns import Table, column_name, wire_type
from mavquad.tlog.contents import TlogContents, read_records, scan
from mavquad.tlog.frames import Frames
from mavquad.tlog.log import Log, Reading, messages, read, records
from mavquad.tlog.record import LINK_INBOUND, LINK_OUTBOUND, STAMP_LENGTH, Record, TlogWriter, pack_record
from mavquad.tlog.scanner import Scanner
from mavquad.tlog.selection import Selection, Sender

__all__ = [
    "LINK_INBOUND",
    "LINK_OUTBOUND",
    "STAMP_LENGTH",
    "Frames",
    "Log",
    "Reading",
    "Record",
    "Scanner",
    "Selection",
    "Sender",
    "Table",
    "TlogContents",
    "TlogWriter",
    "column_name",
    "messages",
    "pack_record",
    "read",
    "read_records",
    "records",
    "scan",
    "wire_type",
]
