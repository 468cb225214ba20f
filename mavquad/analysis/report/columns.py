"""A log's messages, and the law's steps, as tables for other programs: `columns.npz`, and one CSV a table.

Names carry units (`roll_rad`, `vx_cm_s`); values are as on the wire. `stamp_us` is the log's, in the order of the file;
`link` 3 is what the writer of the log sent. An array of MAVLink is one array of two axes in the npz, and columns NAME_0,
NAME_1 ... in the CSV.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from mavquad.analysis.trace import row_values
from mavquad.flight_record import TraceRow
from mavquad.tlog import Log, Table

Columns = dict[str, NDArray[Any]]


def table_name(table: Table) -> str:
    """ATTITUDE_1_1: the message, the system, the component."""
    system, component = table.sender
    return f"{table.name}_{system}_{component}"


def all_tables(log: Log | None, rows: Sequence[TraceRow]) -> Iterator[tuple[str, Columns]]:
    """Every table by its name: `trace` of the law, and one a message and sender."""
    if rows:
        yield "trace", trace_columns(rows)
    for table in log.tables.values() if log is not None else ():
        yield table_name(table), columns_of(table)


def columns_of(table: Table) -> Columns:
    """All columns of a table, stamps first."""
    return {"stamp_us": table.stamps_us, "link": table.links, **table.columns()}


def trace_columns(rows: Sequence[TraceRow]) -> Columns:
    """The steps of the law by the names that trace.csv has; none without rows."""
    if not rows:
        return {}
    table = zip(*(row_values(row).values() for row in rows), strict=True)
    return {name: numpy.array(values) for name, values in zip(row_values(rows[0]), table, strict=True)}


def write_npz(path: Path, tables: Iterable[tuple[str, Columns]]) -> None:
    """One array a column, named TABLE/COLUMN: `numpy.load(path)["ATTITUDE_1_1/roll_rad"]`."""
    arrays = {f"{table}/{name}": values for table, columns in tables for name, values in columns.items()}
    numpy.savez_compressed(path, allow_pickle=False, **arrays)


def write_csv(path: Path, columns: Columns) -> None:
    """One row a message; floats are the shortest that read back as they are."""
    flat = list(_flat(columns))
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(name for name, _ in flat)
        writer.writerows(zip(*(_cells(values) for _, values in flat), strict=True))


def _flat(columns: Columns) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, values in columns.items():
        if values.ndim == 1:
            yield name, values
        else:
            yield from ((f"{name}_{index}", values[:, index]) for index in range(values.shape[1]))


def _cells(values: NDArray[Any]) -> list[Any]:
    return list((values.astype("U") if values.dtype == numpy.float32 else values).tolist())
