"""The MCAP file, read back by the library's own reader."""

import builtins
import json
import math

import numpy as np
import pytest

from mavquad import tlog
from mavquad.analysis.report.foxglove import write_mcap
from mavquad.analysis.report.of_log import read_log, report_of_log
from mavquad.errors import InputError
from tests.unit.analysis.report.logs import START_US, LogFile, circling

reader = pytest.importorskip("mcap.reader", reason="the extra mcap is not installed")


def read_back(path):
    """(schema, channel, message, decoded JSON) of everything in the order of the file."""
    with path.open("rb") as stream:
        found = list(reader.make_reader(stream).iter_messages(log_time_order=False))
    return [(schema, channel, message, json.loads(message.data)) for schema, channel, message in found]


@pytest.fixture
def made(tmp_path, make_trace):
    path = circling(4.0).write(tmp_path / "some.tlog")
    log = tlog.read(path)
    rows = make_trace(1.0)
    write_mcap(tmp_path / "some.mcap", log, rows, report_of_log(read_log(path)))
    return log, rows, read_back(tmp_path / "some.mcap")


def topic(found, name):
    return [(message, value) for _, channel, message, value in found if channel.topic == name]


def test_every_message_is_there_with_its_time(made):
    log, rows, found = made
    for table in log.tables.values():
        messages = topic(found, f"/mavlink/1/1/{table.name}")
        assert [message.log_time for message, _ in messages] == (table.stamps_us * 1000).tolist()
    assert [value["roll_rad"] for _, value in topic(found, "/mavlink/1/1/ATTITUDE")] == log["ATTITUDE"][1, 1][
        "roll"
    ].tolist()
    trace = topic(found, "/mavquad/trace")
    assert [value["measured_x_m"] for _, value in trace] == [row.measured[2] for row in rows]


def test_messages_lie_in_the_order_of_time(made):
    *_, found = made
    times = [message.log_time for *_, message, _ in found]
    assert times == sorted(times)


def test_schemas_say_what_is_in_the_messages(made):
    *_, found = made
    for schema, channel, _, value in found:
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        assert set(value) == set(json.loads(schema.data)["properties"])


def test_texts_are_logs_of_foxglove(made):
    *_, found = made
    texts = [(value["level"], value["message"]) for _, value in topic(found, "/texts")]
    assert texts == [(level, f"text of severity {k}") for k, level in enumerate((5, 5, 5, 4, 3, 2, 2, 1))]
    message, value = topic(found, "/texts")[0]
    assert value["timestamp"] == {"sec": message.log_time // 10**9, "nsec": message.log_time % 10**9}


def turned(orientation, vector):
    """The vector turned by a quaternion, by its definition q v q*."""
    x, y, z, w = (orientation[axis] for axis in "xyzw")
    u, v = np.array([x, y, z]), np.array(vector, float)
    return 2 * u.dot(v) * u + (w * w - u.dot(u)) * v + 2 * w * np.cross(u, v)


@pytest.mark.parametrize(
    ("angles", "body", "world"),
    [
        ((0, 0, math.pi / 2), (1, 0, 0), (0, -1, 0)),  # heading east: the nose (forward) points to minus west
        ((0, 0.5, 0), (1, 0, 0), (math.cos(0.5), 0, math.sin(0.5))),  # nose up
        ((0.5, 0, 0), (0, 1, 0), (0, math.cos(0.5), math.sin(0.5))),  # right wing down: the left one up
    ],
)
def test_poses_are_nwu(tmp_path, angles, body, world):
    log = LogFile()
    for tenth in range(3):
        log.at(tenth / 10).attitude(*angles)
        log.position(1.0, 2.0, -3.0)
    path = log.write(tmp_path / "some.tlog")
    write_mcap(tmp_path / "some.mcap", tlog.read(path), (), report_of_log(read_log(path)))
    [*_, (_, value)] = topic(read_back(tmp_path / "some.mcap"), "/pose")
    assert value["pose"]["position"] == {"x": 1.0, "y": -2.0, "z": 3.0}
    np.testing.assert_allclose(turned(value["pose"]["orientation"], body), world, atol=1e-6)


def test_no_number_is_null(tmp_path):
    log = LogFile()
    log.position(math.nan, math.inf, 0.0)
    path = log.write(tmp_path / "some.tlog")
    write_mcap(tmp_path / "some.mcap", tlog.read(path), (), report_of_log(read_log(path)))
    [(_, value)] = topic(read_back(tmp_path / "some.mcap"), "/mavlink/1/1/LOCAL_POSITION_NED")
    assert (value["x_m"], value["y_m"], value["z_m"]) == (None, None, 0.0)
    assert value["stamp_us"] == START_US


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    real = builtins.__import__

    def without_mcap(name, *args, **kwargs):
        if name.startswith("mcap"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    path = circling(1.0).write(tmp_path / "some.tlog")
    report = report_of_log(read_log(path))
    monkeypatch.setattr(builtins, "__import__", without_mcap)
    with pytest.raises(InputError, match="mcap is not installed") as caught:
        write_mcap(tmp_path / "some.mcap", None, (), report)
    assert "pip install" in caught.value.hint


def test_a_log_without_stamps_is_refused(tmp_path):
    log = LogFile(with_stamps=False)
    log.at(1.0).attitude(0, 0, 0)
    log.at(2.0).attitude(0, 0, 0)
    path = log.write(tmp_path / "some.raw")
    with pytest.raises(InputError, match="no stamps"):
        write_mcap(tmp_path / "some.mcap", tlog.read(path), (), report_of_log(read_log(path)))
