"""Failsafes and modes without a pilot of the ArduCopter personality."""

from __future__ import annotations

import math

import pytest

from mavquad.protocol.codec import Encoder, decode, mavlink


def beating(vehicle, seconds):
    for _ in range(round(seconds)):
        vehicle.heartbeat().run(1.0)
    return vehicle


def test_a_lost_ground_station_does_nothing_by_default(copter):
    vehicle = copter().hover()
    assert vehicle.run(12.0).mock.mode == "GUIDED"
    assert vehicle.texts() == []


def test_a_lost_ground_station_calls_back(copter):
    vehicle = copter().hover()
    vehicle.set("FS_GCS_ENABLE", 1)
    beating(vehicle, 2.0).heartbeat()
    vehicle.forget()
    vehicle.stream(lambda v: v.rates(thrust=0.5), 4.7)
    assert vehicle.mock.mode == "GUIDED"
    vehicle.stream(lambda v: v.rates(thrust=0.5), 0.4)
    assert vehicle.mock.mode == "RTL"
    assert [(m.severity, m.text) for m in vehicle.messages("STATUSTEXT")] == [(4, "GCS Failsafe")]
    assert vehicle.messages("HEARTBEAT")[-1].system_status == 5
    vehicle.forget()
    beating(vehicle, 2.0)
    assert vehicle.texts() == ["GCS Failsafe Cleared"]
    assert vehicle.mock.mode == "RTL"
    assert vehicle.messages("HEARTBEAT")[-1].system_status == 4
    assert vehicle.mode(4) == [0]


def test_only_the_ground_station_counts(copter):
    vehicle = copter().hover()
    vehicle.set("FS_GCS_ENABLE", 5)
    beating(vehicle, 1.0)
    companion = Encoder(42, 191)
    for _ in range(6):
        vehicle.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), companion)
        vehicle.run(1.0)
    assert vehicle.mock.mode == "LAND"


def test_on_the_ground_it_disarms(copter):
    vehicle = copter().arm()
    vehicle.set("FS_GCS_ENABLE", 1)
    vehicle.set("DISARM_DELAY", 0)
    assert not vehicle.run(6.0).truth.armed


@pytest.mark.parametrize(("action", "mode"), [(0, "GUIDED"), (1, "LAND"), (2, "RTL")])
def test_an_empty_battery(copter, action, mode):
    vehicle = copter().hover()
    vehicle.set("BATT_LOW_MAH", 3100)
    vehicle.set("BATT_FS_LOW_ACT", action)
    vehicle.run(25.0)
    assert any(text.startswith("Battery 1 is low 12.60V used") for text in vehicle.texts())
    assert ("Battery Failsafe" in vehicle.texts()) == bool(action)
    assert vehicle.mock.mode == mode


def test_the_fence(copter):
    vehicle = copter().hover()
    vehicle.command(207, 1)
    vehicle.set("FENCE_RADIUS", 10)
    vehicle.local(0xDF8, (30.0, 0.0, -10.0))
    vehicle.run(8.0)
    assert vehicle.mock.mode == "RTL"
    assert "Circle fence breached" in vehicle.texts()


def test_the_height_of_the_fence(copter):
    vehicle = copter().hover()
    vehicle.set("FENCE_ENABLE", 1)
    vehicle.set("FENCE_ALT_MAX", 12)
    vehicle.set("FENCE_ACTION", 2)
    vehicle.local(0xDF8, (0.0, 0.0, -20.0))
    vehicle.run(5.0)
    assert vehicle.mock.mode == "LAND"
    assert "Max Alt fence breached" in vehicle.texts()


def test_a_breach_from_outside(copter):
    vehicle = copter().hover()
    vehicle.mock._personality.breach_geofence()
    vehicle.run(0.1)
    assert (vehicle.mock.mode, vehicle.texts()) == ("RTL", ["Circle fence breached"])


def test_return_climbs_comes_home_waits_and_lands(copter):
    vehicle = copter().hover()
    vehicle.local(0xDF8, (12.0, 5.0, -10.0))
    vehicle.run(10.0)
    assert vehicle.command(20) == [0]
    vehicle.run(6.0)
    assert vehicle.truth.position_ned_m[2] == pytest.approx(-15.0, abs=0.5)
    vehicle.run(14.0)
    assert math.hypot(*vehicle.truth.position_ned_m[:2]) < 0.5
    assert not vehicle.run(40.0).truth.armed
    assert vehicle.texts()[-1] == "Disarming motors"


def test_landing_takes_its_time(copter):
    """From 10 m the real one needed 20.4 s to the ground, 2.1 s more until it was disarmed."""
    vehicle = copter().hover()
    assert vehicle.command(21) == [0]
    sent_us = vehicle.now_us
    vehicle.forget()
    while vehicle.truth.armed and vehicle.now_us - sent_us < 40e6:
        vehicle.run(0.1)
    hit_us = next(t for t, f in stamped(vehicle) if f.startswith("SIM Hit ground"))
    assert (hit_us - sent_us) / 1e6 == pytest.approx(20.4, abs=0.8)
    assert (vehicle.now_us - hit_us) / 1e6 == pytest.approx(2.1, abs=0.2)


def stamped(vehicle):
    for stamp, frame in vehicle.frames:
        message = decode(frame)
        if message.get_type() == "STATUSTEXT":
            yield stamp, message.text


def test_landing_is_fast_above_10_m(copter):
    vehicle = copter().hover(20.0)
    vehicle.mode(9)
    assert vehicle.run(4.0).truth.velocity_ned_m_s[2] == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(("number", "sinks_m_s"), [(5, 2.5), (2, 2.5), (16, 2.5), (17, 0.0), (7, 0.0)])
def test_modes_without_a_pilot(copter, number, sinks_m_s):
    """The throttle stick of SITL lies at its lowest: LOITER and its like sink as it asks, BRAKE and CIRCLE stay."""
    vehicle = copter().hover(20.0)
    assert vehicle.mode(number) == [0]
    assert vehicle.run(4.0).truth.velocity_ned_m_s[2] == pytest.approx(sinks_m_s, abs=0.2)


def test_stabilize_falls_without_throttle(copter):
    vehicle = copter().hover(20.0)
    vehicle.mode(0)
    assert vehicle.run(1.0).truth.velocity_ned_m_s[2] > 8.0


def test_the_throttle_stick_by_override(copter):
    def override(v, pulse=1500):
        v.send(mavlink.MAVLink_rc_channels_override_message(1, 1, 1500, 1500, pulse, 1500, 0, 0, 0, 0))

    vehicle = copter().hover()
    override(vehicle)
    vehicle.mode(5)
    vehicle.stream(override, 4.0, hz=5)
    assert vehicle.truth.position_ned_m[2] == pytest.approx(-10.0, abs=0.5)
    vehicle.stream(lambda v: override(v, 2000), 4.0, hz=5)
    assert vehicle.truth.velocity_ned_m_s[2] == pytest.approx(-2.5, abs=0.2)
    assert vehicle.run(7.0).truth.velocity_ned_m_s[2] == pytest.approx(2.5, abs=0.2)


def test_a_crash_on_its_back_disarms(copter):
    vehicle = copter().hover()
    vehicle.set("GUID_OPTIONS", 8)
    vehicle.stream(lambda v: v.rates(roll=3.0, thrust=0.0), 1.6)
    vehicle.run(4.0)
    assert vehicle.truth.crashed
    assert not vehicle.truth.armed
    assert vehicle.command(400, 1) == [4]


def test_termination(copter):
    vehicle = copter().hover()
    assert vehicle.command(185, 0) == [4]
    assert vehicle.command(185, 1) == [0]
    assert not vehicle.truth.armed
