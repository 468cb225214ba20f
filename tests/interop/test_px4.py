"""The clients that people fly PX4 with, against the mock's PX4."""

from __future__ import annotations

import pytest

from mavquad.protocol.codec import decode
from mavquad.tlog import read_records

ACCEPTED = 0


def test_pymavlink_flies_px4_on_its_usual_ports(mock, instance, client):
    mock("--firmware", "1.16", "--instance", str(instance), "--system-id", "1", "--speed", "5")
    seen = client("px4_pymavlink.py", "pymavlink", f"udpin:127.0.0.1:{14540 + instance}")
    assert seen.pop("attitude hz") == pytest.approx(50, rel=0.05)
    assert seen == {
        "heartbeat from system": 1,
        "is px4": True,
        "parameter": 2.5,
        "parameter set": 4.0,
        "all parameters": True,
        "interval": ACCEPTED,
        "armed": True,
        "takeoff": ACCEPTED,
        "flight mode": "LOITER",
        "offboard": ACCEPTED,
        "offboard mode": "OFFBOARD",
        "land": ACCEPTED,
        "disarmed": True,
    }


def test_mavsdk_flies_px4_on_its_usual_ports(mock, instance, client):
    mock("--firmware", "1.16", "--instance", str(instance), "--system-id", "1", "--speed", "3")
    seen = client("px4_mavsdk.py", "mavsdk", str(14540 + instance))
    assert seen.pop("parameters") > 800
    assert seen == {
        "version": [1, 16],
        "telemetry missing": [],
        "takeoff altitude": 4.0,
        "int parameter": 4,
        "offboard without setpoint": "NO_SETPOINT_SET",
        "mission items": 3,
        "mission progress": [3, 3],
        "landed": True,
    }


def test_mavproxy_flies_px4(mock, client, tmp_path):
    (url,) = mock("--firmware", "1.16", "--endpoint", "udpin:127.0.0.1:0:gcs", "--speed", "2", "--ready", "1")
    seen = client("by_mavproxy.py", "MAVProxy", url, str(tmp_path), "px4")
    assert seen["parameters"] > 800
    contents = read_records(seen["tlogs"][0])
    assert contents.bad_bytes == 0
    kinds = {(record.outbound, decode(record.frame).get_type()) for record in contents}
    assert {(False, "HEARTBEAT"), (False, "ATTITUDE"), (False, "COMMAND_ACK"), (True, "COMMAND_LONG")} <= kinds
