"""The live vehicle: a client over a real socket, the truth from another thread, what goes wrong with ports and the mock."""

import contextlib
import socket

import pytest

from mavquad.errors import EndpointError, InternalError
from mavquad.protocol.codec import mavlink
from sitl_mock import LiveVehicle
from sitl_mock.autopilot import MockAutopilot


def test_a_client_arms_it_and_the_truth_shows_it():
    with LiveVehicle(firmware="1.16", speed=5.0) as vehicle, contextlib.closing(vehicle.connect()) as connection:
        assert vehicle.url.startswith("tcp:127.0.0.1:")
        assert connection.wait_heartbeat(timeout=20).autopilot == mavlink.MAV_AUTOPILOT_PX4
        vehicle.run(2.0)
        connection.mav.heartbeat_send(6, 8, 0, 0, 0)
        connection.arducopter_arm()
        vehicle.run_until(lambda truth: truth.armed, limit_s=30.0)
        vehicle.fail("die")
        vehicle.run_until(lambda truth: not truth.armed, limit_s=30.0)
        with pytest.raises(TimeoutError, match="fault: die"):
            vehicle.run_until(lambda truth: truth.armed, limit_s=0.0)
    assert not vehicle.truth.armed
    assert "Armed by external command" in vehicle.texts


def test_udp_on_request():
    with LiveVehicle(endpoints=["udpin:127.0.0.1:0:gcs"], speed=20.0) as vehicle:
        assert vehicle.url.startswith("udpout:127.0.0.1:")
        with contextlib.closing(vehicle.connect()) as connection:
            connection.mav.heartbeat_send(6, 8, 0, 0, 0)
            assert connection.wait_heartbeat(timeout=20) is not None


def test_a_vehicle_that_waits_for_its_client():
    waiting = LiveVehicle(endpoints=["tcpin:127.0.0.1:0:wait"])
    with waiting as vehicle, pytest.raises(TimeoutError, match="no client has connected"):
        _ = vehicle.truth


def test_a_port_that_is_taken():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(EndpointError, match="cannot be opened"):
            LiveVehicle(endpoints=[f"tcpin:127.0.0.1:{taken.getsockname()[1]}"]).__enter__()


def test_an_error_of_the_mock_is_not_lost(monkeypatch):
    def breaks(self, now_us):
        raise ZeroDivisionError("planted")

    monkeypatch.setattr(MockAutopilot, "on_deadline", breaks)
    with pytest.raises(InternalError, match="the mock vehicle failed: planted"), LiveVehicle() as vehicle:
        vehicle.run_until(lambda truth: False, limit_s=30.0)
