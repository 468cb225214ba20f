"""Columns read back as the log's own values, and as much is told as there is."""

import csv

import numpy as np
import pytest

from mavquad import tlog
from mavquad.analysis.report.columns import all_tables, write_csv, write_npz
from mavquad.protocol.codec import mavlink
from tests.unit.analysis.report.logs import circling


@pytest.fixture
def log(tmp_path):
    made = circling(3.0)
    q = [0.1, 0.2, 0.3, 0.4]
    made.add(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, q, 0.1, -0.2, float("nan"), 0.6), outbound=True)
    made.text('a "quoted", comma\nand a line')
    return tlog.read(made.write(tmp_path / "some.tlog"))


def test_npz_holds_every_column_as_it_is(log, tmp_path):
    write_npz(tmp_path / "columns.npz", all_tables(log, ()))
    with np.load(tmp_path / "columns.npz") as arrays:
        count = sum(len(table.names) + 2 for table in log.tables.values())
        assert len(arrays.files) == count
        for table in log.tables.values():
            name = f"{table.name}_{table.sender[0]}_{table.sender[1]}"
            np.testing.assert_array_equal(arrays[f"{name}/stamp_us"], table.stamps_us)
            for column, values in table.columns().items():
                assert arrays[f"{name}/{column}"].dtype == values.dtype
                np.testing.assert_array_equal(arrays[f"{name}/{column}"], values)


def test_csv_reads_back_to_the_last_bit(log, tmp_path):
    for name, columns in all_tables(log, ()):
        write_csv(tmp_path / name, columns)
        with (tmp_path / name).open(newline="") as stream:
            rows = list(csv.DictReader(stream))
        assert len(rows) == len(columns["stamp_us"])
        for column, values in columns.items():
            if values.ndim == 1 and values.dtype.kind == "f":
                np.testing.assert_array_equal(np.array([row[column] for row in rows], values.dtype), values)
            elif values.ndim == 1:
                assert [row[column] for row in rows] == [str(value) for value in values.tolist()]
            else:
                read = [[row[f"{column}_{k}"] for k in range(values.shape[1])] for row in rows]
                np.testing.assert_array_equal(np.array(read, values.dtype), values)


def test_names_carry_units(log):
    [attitude] = [columns for name, columns in all_tables(log, ()) if name == "ATTITUDE_1_1"]
    assert {"stamp_us", "roll_rad", "rollspeed_rad_s", "time_boot_ms"} <= set(attitude)


def test_the_law_is_a_table_too(make_trace):
    rows = make_trace(1.0)
    [(name, columns)] = all_tables(None, rows)
    assert name == "trace"
    assert columns["measured_x_m"].tolist() == [row.measured[2] for row in rows]
    assert columns["limits"][0] == "snap"
    assert columns["stamp_us"].dtype == np.int64
