"""`trace.csv` reads back to the last bit, and what is not one is refused with its line."""

from __future__ import annotations

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.analysis.trace import HEADER, read_trace, write_trace
from mavquad.errors import LogError
from mavquad.flight_record import TraceRow

NUMBERS = st.floats(allow_nan=False)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
ROWS = st.builds(
    TraceRow,
    stamp_us=st.integers(0, 2**62),
    vehicle_stamp_us=st.integers(0, 2**62),
    phase=st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=12),
    measured=VECTORS,
    reference=VECTORS,
    zeta_hat=st.tuples(VECTORS, VECTORS, VECTORS, VECTORS),
    sigma=VECTORS,
    demanded=VECTORS,
    input=VECTORS,
    controls=VECTORS,
    limits=st.lists(st.sampled_from(["tilt", "snap", "thrust floor"]), max_size=3).map(tuple),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("trace")


def written(path, rows):
    with path.open("w", newline="", encoding="utf-8") as stream:
        write_trace(stream, rows)
    return path


@given(rows=st.lists(ROWS, max_size=3))
def test_round_trip_to_the_last_bit(folder, rows):
    assert repr(read_trace(written(folder / "trace.csv", rows))) == repr(rows)


def test_each_number_stands_under_its_own_name():
    counter = iter(range(100))

    def vec4():
        return tuple(float(next(counter)) for _ in range(4))

    row = TraceRow(
        11, 22, "hover", vec4(), vec4(), (vec4(), vec4(), vec4(), vec4()), *(vec4() for _ in range(4)), ("a", "b")
    )
    stream = io.StringIO()
    write_trace(stream, [row])
    [cells] = csv.DictReader(io.StringIO(stream.getvalue()))
    assert (cells["stamp_us"], cells["vehicle_stamp_us"], cells["phase"], cells["limits"]) == (
        "11",
        "22",
        "hover",
        "a+b",
    )
    expected = {
        "measured_z_m": row.measured[0],
        "measured_yaw_rad": row.measured[1],
        "reference_x_m": row.reference[2],
        "reference_y_m": row.reference[3],
        "zeta_hat_z_m_s": row.zeta_hat[0][1],
        "zeta_hat_yaw_rad_s3": row.zeta_hat[1][3],
        "zeta_hat_x_m_s2": row.zeta_hat[2][2],
        "zeta_hat_y_m": row.zeta_hat[3][0],
        "sigma_yaw_rad_s4": row.sigma[1],
        "demanded_y_m_s4": row.demanded[3],
        "input_v1_m_s4": row.input[0],
        "input_pitch_rad_s2": row.input[3],
        "control_roll_norm": row.controls[0],
        "control_thrust_norm": row.controls[3],
    }
    assert {name: float(cells[name]) for name in expected} == expected


def test_every_number_has_a_unit_in_its_name():
    units = ("_us", "_m", "_rad", "_s", "_s2", "_s3", "_s4", "_norm")
    assert len(set(HEADER)) == len(HEADER) == 44
    assert all(name.endswith(units) for name in HEADER if name not in ("phase", "limits"))


def test_nan_survives(folder, make_trace):
    [row] = make_trace(0.01)
    nan_row = TraceRow(**{name: getattr(row, name) for name in row.__slots__} | {"sigma": (math.nan,) * 4})
    [read] = read_trace(written(folder / "nan.csv", [nan_row]))
    assert all(math.isnan(value) for value in read.sigma)


def test_what_is_not_a_trace_is_refused(folder, make_trace):
    good = written(folder / "good.csv", make_trace(0.03)).read_text()
    cases = {
        "": "first line differs",
        "a,b,c\n1,2,3\n": "first line differs",
        good + "1,2,3\n": "line 5: 3 cells instead of 44",
        good.replace(",hover,", ",hover,x", 1): "line 2: could not convert",
    }
    for text, reason in cases.items():
        path = folder / "bad.csv"
        path.write_text(text)
        with pytest.raises(LogError, match=reason):
            read_trace(path)
    with pytest.raises(LogError, match="cannot be read"):
        read_trace(folder / "none.csv")
    (folder / "bytes.csv").write_bytes(b"\xff\xfe\xfd")
    with pytest.raises(LogError, match="cannot be read"):
        read_trace(folder / "bytes.csv")
