"""`trace.csv` reads back to the last bit, and what is not one is refused with its line."""

from __future__ import annotations

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.analysis.trace import TraceWriter, header, read_trace, write_trace
from mavquad.control.defaults import CHAIN_LENGTHS, DEPTHS, YAW_LENGTHS
from mavquad.errors import LogError
from mavquad.flight_record import TraceRow
from mavquad.types import CHANNELS

LENGTHS = {depth: (CHAIN_LENGTHS[depth], YAW_LENGTHS[depth]) for depth in DEPTHS}
PADDED = [(4, 3), (4, 4), (3, 2), (3, 3), (2, 2), (2, 3)]
"""With integrators before the yaw."""
COLUMNS = {"torque": 45, "rate": 41, "attitude": 38}
NUMBERS = st.floats(allow_nan=False)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)


def rows_of(lengths):
    """Rows whose chains have these lengths."""
    place, yaw = lengths
    estimates = [st.tuples(*[NUMBERS] * (yaw if channel == "yaw" else place)) for channel in CHANNELS]
    return st.builds(
        TraceRow,
        stamp_us=st.integers(0, 2**62),
        vehicle_stamp_us=st.integers(0, 2**62),
        phase=st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=12),
        measured=VECTORS,
        reference=VECTORS,
        zeta_hat=st.tuples(*estimates),
        sigma=VECTORS,
        wind=st.tuples(NUMBERS, NUMBERS, NUMBERS),
        demanded=VECTORS,
        input=VECTORS,
        controls=VECTORS,
        limits=st.lists(st.sampled_from(["tilt", "snap", "thrust floor"]), max_size=3).map(tuple),
    )


FLIGHTS = st.sampled_from([*LENGTHS.values(), *PADDED]).flatmap(lambda lengths: st.lists(rows_of(lengths), max_size=3))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("trace")


def written(path, rows):
    with path.open("w", newline="", encoding="utf-8") as stream:
        write_trace(stream, rows)
    return path


@given(rows=FLIGHTS)
def test_round_trip_to_the_last_bit(folder, rows):
    assert repr(read_trace(written(folder / "trace.csv", rows))) == repr(rows)


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_flight_of_each_depth_reads_back_as_one(folder, make_trace, depth):
    rows = make_trace(0.05, depth=depth)
    read = read_trace(written(folder / f"{depth}.csv", rows))
    assert read == rows
    assert {row.depth for row in read} == {depth}


def test_the_law_that_was_never_in_control_leaves_an_empty_file(folder):
    path = written(folder / "empty.csv", [])
    assert path.read_text() == ""
    assert read_trace(path) == []


def test_rows_that_come_in_parts_stand_under_one_header(make_trace):
    rows = make_trace(0.05, depth="rate")
    parts, whole = io.StringIO(), io.StringIO()
    writer = TraceWriter(parts)
    for part in ([], rows[:2], [], rows[2:]):
        writer.write(part)
    write_trace(whole, rows)
    assert parts.getvalue() == whole.getvalue()
    assert parts.getvalue().count("stamp_us,vehicle_stamp_us") == 1


def counted(place, yaw):
    """A row whose numbers count up in the order of the fields."""
    counter = iter(range(100))

    def vector(length=4):
        return tuple(float(next(counter)) for _ in range(length))

    return TraceRow(
        stamp_us=11,
        vehicle_stamp_us=22,
        phase="hover",
        measured=vector(),
        reference=vector(),
        zeta_hat=(vector(place), vector(yaw), vector(place), vector(place)),
        sigma=vector(),
        wind=vector(3),
        demanded=vector(),
        input=vector(),
        controls=vector(),
        limits=("a", "b"),
    )


def named_torque(row):
    return {
        "zeta_hat_z_m_s3": row.zeta_hat[0][3],
        "zeta_hat_yaw_rad_s": row.zeta_hat[1][1],
        "zeta_hat_x_m_s2": row.zeta_hat[2][2],
        "zeta_hat_y_m": row.zeta_hat[3][0],
        "sigma_z_m_s4": row.sigma[0],
        "sigma_yaw_rad_s2": row.sigma[1],
        "demanded_y_m_s4": row.demanded[3],
        "input_thrust_m_s4": row.input[0],
        "input_yaw_rad_s2": row.input[1],
        "input_roll_rad_s2": row.input[2],
        "input_pitch_rad_s2": row.input[3],
        "control_roll_norm": row.controls[0],
        "control_yaw_norm": row.controls[2],
    }


def named_rate(row):
    return {
        "zeta_hat_z_m_s2": row.zeta_hat[0][2],
        "zeta_hat_yaw_rad": row.zeta_hat[1][0],
        "zeta_hat_x_m_s": row.zeta_hat[2][1],
        "sigma_y_m_s3": row.sigma[3],
        "sigma_yaw_rad_s": row.sigma[1],
        "demanded_x_m_s3": row.demanded[2],
        "input_thrust_m_s3": row.input[0],
        "input_yaw_rad_s": row.input[1],
        "input_roll_rad_s": row.input[2],
        "input_pitch_rad_s": row.input[3],
        "control_roll_rate_rad_s": row.controls[0],
        "control_pitch_rate_rad_s": row.controls[1],
    }


def named_attitude(row):
    return {
        "zeta_hat_z_m_s": row.zeta_hat[0][1],
        "zeta_hat_y_m_s": row.zeta_hat[3][1],
        "sigma_x_m_s2": row.sigma[2],
        "demanded_z_m_s2": row.demanded[0],
        "demanded_yaw_rad_s": row.demanded[1],
        "input_thrust_m_s2": row.input[0],
        "input_yaw_rad_s": row.input[1],
        "input_roll_rad": row.input[2],
        "input_pitch_rad": row.input[3],
        "control_pitch_rad": row.controls[1],
        "control_yaw_rad": row.controls[2],
    }


def named_everywhere(row):
    return {
        "measured_z_m": row.measured[0],
        "measured_yaw_rad": row.measured[1],
        "reference_x_m": row.reference[2],
        "reference_y_m": row.reference[3],
        "wind_x_m_s2": row.wind[0],
        "wind_z_m_s2": row.wind[2],
        "control_thrust_norm": row.controls[3],
    }


@pytest.mark.parametrize(
    ("depth", "named"), [("torque", named_torque), ("rate", named_rate), ("attitude", named_attitude)]
)
def test_each_number_stands_under_its_own_name(depth, named):
    row = counted(*LENGTHS[depth])
    stream = io.StringIO()
    write_trace(stream, [row])
    [cells] = csv.DictReader(io.StringIO(stream.getvalue()))
    words = ("stamp_us", "vehicle_stamp_us", "phase", "limits")
    assert tuple(cells[name] for name in words) == ("11", "22", "hover", "a+b")
    expected = named_everywhere(row) | named(row)
    assert {name: float(cells[name]) for name in expected} == expected
    assert len(cells) == COLUMNS[depth]


@pytest.mark.parametrize("lengths", [*LENGTHS.values(), *PADDED])
def test_every_number_has_a_unit_in_its_name(lengths):
    units = ("_us", "_m", "_rad", "_s", "_s2", "_s3", "_s4", "_norm")
    names = header(lengths)
    place, yaw = lengths
    assert len(set(names)) == len(names) == 4 + 8 + 3 * place + yaw + 19
    assert all(name.endswith(units) for name in names if name not in ("phase", "limits"))


def test_no_two_lengths_have_one_header():
    headers = {header((place, yaw)) for place in (2, 3, 4) for yaw in (1, 2, 3, 4)}
    assert len(headers) == 12


def test_nan_survives(folder, make_trace):
    [row] = make_trace(0.01)
    nan_row = TraceRow(**{name: getattr(row, name) for name in row._fields} | {"sigma": (math.nan,) * 4})
    [read] = read_trace(written(folder / "nan.csv", [nan_row]))
    assert all(math.isnan(value) for value in read.sigma)


def test_what_is_not_a_trace_is_refused(folder, make_trace):
    good = written(folder / "good.csv", make_trace(0.03)).read_text()
    cases = {
        "a,b,c\n1,2,3\n": "first line differs",
        good + "1,2,3\n": "line 5: 3 cells instead of 45",
        good.replace(",hover,", ",hover,x", 1): "line 2: could not convert",
        good.replace("control_roll_norm", "control_roll_rad", 1): "first line differs",
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
