"""The clients that people fly ArduCopter with, against the mock's ArduCopter."""

from __future__ import annotations

from mavquad.protocol.codec import decode
from mavquad.tlog import read_records

ACCEPTED, FAILED = 0, 4


def test_pymavlink_flies_arducopter_on_its_usual_port(mock, instance, client):
    mock("--autopilot", "ardupilot", "--instance", str(instance), "--speed", "5", "--ready", "42")
    seen = client("ardupilot_pymavlink.py", "pymavlink", f"tcp:127.0.0.1:{5760 + 10 * instance}")
    assert seen == {
        "is ardupilot": True,
        "interval": ACCEPTED,
        "version asked": ACCEPTED,
        "version": [4, 7],
        "parameter": 250.0,
        "parameter set": 300.0,
        "parameters": 1348,
        "armed too early": FAILED,
        "takeoff": ACCEPTED,
        "disarmed": True,
    }


def test_mavproxy_flies_arducopter_on_its_usual_port(mock, instance, client, tmp_path):
    mock("--autopilot", "ardupilot", "--instance", str(instance), "--speed", "5", "--ready", "15")
    seen = client("by_mavproxy.py", "MAVProxy", f"tcp:127.0.0.1:{5760 + 10 * instance}", str(tmp_path), "ardupilot")
    assert seen["parameters"] == 1348
    contents = read_records(seen["tlogs"][0])
    assert contents.bad_bytes == 0
    kinds = {(record.outbound, decode(record.frame).get_type()) for record in contents}
    assert {(False, "HEARTBEAT"), (False, "PARAM_VALUE"), (False, "COMMAND_ACK"), (True, "COMMAND_LONG")} <= kinds


def test_dronekit_flies_arducopter_on_its_usual_port(mock, instance, client):
    mock("--autopilot", "ardupilot", "--instance", str(instance), "--speed", "5", "--ready", "15")
    seen = client("ardupilot_dronekit.py", "dronekit", f"tcp:127.0.0.1:{5760 + 10 * instance}")
    assert seen == {"version": [4, 7], "parameters": 1348, "gps fix": True, "landed": True}
