"""The vehicle in virtual time, and pymavlink's connection to it: who waits lets time pass, and nobody waits for real."""

import math
import time

import pytest
from pymavlink import mavutil

import sitl_mock
from mavquad.drivers.lockstep import START_US
from mavquad.errors import ConfigError
from mavquad.protocol.codec import Encoder, mavlink
from sitl_mock import VirtualVehicle
from sitl_mock.api import connection as connection_module
from sitl_mock.api.story import Story

START_S = START_US * 1e-6
INTERVAL = (1, 1, 511, 0)


@pytest.fixture(autouse=True)
def nobody_waits(monkeypatch):
    """Whatever would wait for the wall clock or a socket fails."""

    def waits(*_):
        raise AssertionError("waits for real")

    monkeypatch.setattr(mavutil.time, "sleep", waits)
    monkeypatch.setattr(mavutil.select, "select", waits)


def received(seed, **arguments):
    vehicle = VirtualVehicle(seed=seed, **arguments)
    connection = vehicle.connect()
    connection.wait_heartbeat()
    connection.arducopter_arm()
    vehicle.run(2.0)
    return list(connection._outlet.inbox), vehicle.truth


def test_same_seed_same_bytes():
    assert received(1) == received(1)
    assert received(1)[0] != received(2)[0]


def test_time_passes_only_when_asked():
    vehicle = VirtualVehicle()
    vehicle.run(1.5)
    assert vehicle.now_s == 1.5
    assert vehicle.truth.time_s == pytest.approx(1.5, abs=0.004)
    connection = vehicle.connect()
    connection.mav.heartbeat_send(6, 8, 0, 0, 0)
    assert vehicle.now_s == pytest.approx(1.5, abs=1e-4)


def test_a_flight_as_mavutil_is_used():
    vehicle = VirtualVehicle(autopilot="px4", firmware="1.16")
    connection = vehicle.connect()
    assert connection.wait_heartbeat().autopilot == mavlink.MAV_AUTOPILOT_PX4
    assert (connection.target_system, connection.flightmode) == (1, "LOITER")
    vehicle.every(1.0, lambda: connection.mav.heartbeat_send(6, 8, 0, 0, 0))
    vehicle.run(2.0)
    connection.arducopter_arm()
    connection.motors_armed_wait()
    connection.mav.command_long_send(1, 1, 22, 0, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)
    assert connection.recv_match(type="COMMAND_ACK", condition="COMMAND_ACK.command==22", blocking=True).result == 0
    vehicle.run_until(lambda truth: truth.position_ned_m[2] < -2.0, 20.0)
    connection.set_mode("LAND")
    connection.motors_disarmed_wait()
    assert vehicle.truth.landed and not vehicle.truth.crashed
    assert "Landing detected" in vehicle.texts
    assert "Disarmed by landing" in vehicle.report()


def test_parameters_as_mavutil_fetches_them():
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    connection.wait_heartbeat()
    connection.param_fetch_all()
    sent = connection.mav.total_packets_sent
    connection.param_fetch_all()  # asks once in 2 s
    assert connection.mav.total_packets_sent == sent
    first = connection.recv_match(type="PARAM_VALUE", blocking=True, timeout=3)
    indices = [first.param_index]
    while message := connection.recv_match(type="PARAM_VALUE", blocking=True, timeout=3):
        indices.append(message.param_index)
    assert [index for index in indices if index < first.param_count] == list(range(first.param_count))
    assert connection.param("MIS_TAKEOFF_ALT") == 2.5


def test_a_timeout_is_virtual_time():
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    before_s = vehicle.now_s
    assert connection.recv_match(type="MISSION_COUNT", blocking=True, timeout=7.5) is None
    assert vehicle.now_s - before_s == pytest.approx(7.5, abs=0.02)


def test_a_condition_is_waited_for():
    vehicle = VirtualVehicle()
    condition = "ATTITUDE.time_boot_ms > 1500"
    message = vehicle.connect().recv_match(type=["ATTITUDE"], condition=condition, blocking=True, timeout=5)
    assert 1500 < message.time_boot_ms < 1520


def test_who_waits_without_timeout_for_nothing_is_told(monkeypatch):
    monkeypatch.setattr(connection_module, "_PATIENCE_S", 20.0)
    vehicle = VirtualVehicle(faults=[{"kind": "silent", "from_s": 1.0}])
    connection = vehicle.connect()
    vehicle.run(1.0)
    while connection.recv_match():
        pass
    with pytest.raises(TimeoutError, match="waited 20 s of virtual time for HEARTBEAT"):
        connection.wait_heartbeat()


def test_a_loop_of_polls_comes_to_an_end():
    vehicle = VirtualVehicle()
    connection, polls = vehicle.connect(), 0
    while connection.recv_match(type="BATTERY_STATUS") is None:
        polls += 1
        assert polls < 2000
    vehicle.fail("die")
    connection.recv_match(), connection.recv_match()
    before_s = vehicle.now_s
    assert connection.recv_match(type="ATTITUDE") is None
    assert vehicle.now_s > before_s


def test_a_loop_without_end_meets_the_limit():
    vehicle = VirtualVehicle(limit_s=20.0)
    connection = vehicle.connect()
    with pytest.raises(TimeoutError, match="the limit of 20 s of virtual time"):
        connection.motors_armed_wait()


def test_messages_carry_virtual_time(tmp_path):
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    connection.setup_logfile(str(tmp_path / "flight.tlog"))
    vehicle.run(3.0)
    stamps = []
    while (message := connection.recv_match(type="ATTITUDE")) and message.time_boot_ms < 2500:
        stamps.append(message._timestamp)
        assert message._timestamp - START_S == pytest.approx(message.time_boot_ms * 1e-3, abs=0.01)
    assert connection.time_since("ATTITUDE") == pytest.approx(0.5, abs=0.02)
    connection._tlog.close()
    log, logged = mavutil.mavlink_connection(str(tmp_path / "flight.tlog")), []
    while (message := log.recv_match(type="ATTITUDE")) and len(logged) < len(stamps):
        logged.append(message._timestamp)
    assert logged == pytest.approx(stamps, abs=1e-5)
    log.close()


def test_each_connection_gets_everything_of_its_link():
    vehicle = VirtualVehicle(links=("onboard", "gcs"))
    one, two, ground = vehicle.connect(), vehicle.connect(source_system=42), vehicle.connect(link=1)
    vehicle.run(1.0)
    assert list(one._outlet.inbox) == list(two._outlet.inbox) != list(ground._outlet.inbox)
    two.close()
    before = len(two._outlet.inbox)
    vehicle.run(1.0)
    assert len(two._outlet.inbox) == before < len(one._outlet.inbox)


def test_errands_are_run_at_their_time():
    vehicle, times = VirtualVehicle(), []
    stop = vehicle.every(0.25, lambda: times.append(vehicle.now_s))
    vehicle.run(1.1)
    stop()
    vehicle.run(1.0)
    assert times == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_who_waits_in_an_errand_does_not_stop_time():
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    vehicle.every(1.0, lambda: connection.recv_match(type="ATTITUDE", blocking=True))
    vehicle.run(5.0)
    assert vehicle.now_s == pytest.approx(5.0, abs=0.01)


def test_a_script_that_reads_the_clock_and_sleeps():
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    with vehicle.clock():
        start_s, began_s = time.time(), time.monotonic()
        time.sleep(2.5)
        assert time.time() - start_s == time.monotonic() - began_s == vehicle.now_s == 2.5
        while time.time() < start_s + 4.0:  # as scripts wait that know no timeouts
            connection.recv_match(type="HOME_POSITION")
        assert vehicle.now_s == pytest.approx(4.0, abs=0.1)
    assert time.time() > START_S + 100.0


def test_something_fails_now():
    vehicle = VirtualVehicle()
    vehicle.run(2.0)
    connection = vehicle.connect()
    vehicle.fail("silent", for_s=1.0)
    assert connection.recv_match(blocking=True, timeout=0.9) is None
    assert connection.recv_match(blocking=True, timeout=0.2) is not None
    vehicle.fail("refuse", command="SET_MESSAGE_INTERVAL", since="takeoff")
    connection.mav.command_long_send(*INTERVAL, 30, 1e4, 0, 0, 0, 0, 0)
    assert connection.recv_match(type="COMMAND_ACK", blocking=True).result == 0
    vehicle.fail("refuse", command="SET_MESSAGE_INTERVAL", result="FAILED")
    connection.mav.command_long_send(*INTERVAL, 30, 1e4, 0, 0, 0, 0, 0)
    assert connection.recv_match(type="COMMAND_ACK", blocking=True).result == 4
    assert "fault: silent" in vehicle.report()


def test_the_link_fails_now():
    vehicle = VirtualVehicle()
    connection = vehicle.connect()
    vehicle.fail("drop", direction="from_vehicle", for_s=1.0)
    assert connection.recv_match(blocking=True, timeout=0.9) is None
    assert connection.recv_match(blocking=True, timeout=0.2) is not None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"firmware": "4.7"}, "firmware 4.7 is none of px4's"),
        ({"autopilot": "betaflight"}, "autopilot"),
        ({"faults": [{"kind": "silnt"}]}, "did you mean silent?"),
        ({"faults": "no/such/file.toml"}, "no/such/file.toml: no such file"),
        ({"wnd": (1, 2, 3)}, "wnd: unknown key"),
        ({"wind": (1, 2)}, "wind_ned_m_s"),
        ({"vehicle": "sihh"}, "sihh"),
        ({"vehicle": {"mass": 2.0}}, "did you mean mass_kg?"),
    ],
    ids=str,
)
def test_wrong_arguments_are_named(arguments, words):
    with pytest.raises(ConfigError) as caught:
        VirtualVehicle(**arguments)
    assert words in caught.value.message


def test_a_wrong_fault_is_named():
    with pytest.raises(ConfigError, match=r"fault 1 \(mode_change\): mode: no such mode of px4: 'GUIDED'"):
        VirtualVehicle().fail("mode_change", mode="GUIDED")


def test_a_condition_that_never_holds_ends_with_the_story():
    vehicle = VirtualVehicle()
    with pytest.raises(TimeoutError, match=r"not within 3 s of virtual time:\n.*mode AUTO.LOITER"):
        vehicle.run_until(lambda truth: truth.armed, limit_s=3.0)
    assert vehicle.now_s == 3.0


def test_a_vehicle_given_by_name_or_by_keys():
    assert VirtualVehicle(vehicle="arducopter").config.vehicle.mass_kg == 3.0
    assert VirtualVehicle(vehicle={"mass_kg": 1.1}).config.vehicle.mass_kg == 1.1
    assert VirtualVehicle(autopilot="ardupilot").config.vehicle.mass_kg == 3.0


def test_signed_conversations():
    passphrase = "correct horse"
    vehicle = VirtualVehicle(signing={"mode": "require", "passphrase": passphrase})
    connection = vehicle.connect()
    connection.wait_heartbeat()
    connection.mav.command_long_send(*INTERVAL, 30, 1e4, 0, 0, 0, 0, 0)
    assert connection.recv_match(type="COMMAND_ACK", blocking=True, timeout=1) is None
    connection.setup_signing(vehicle.config.signing.key())
    connection.mav.command_long_send(*INTERVAL, 30, 1e4, 0, 0, 0, 0, 0)
    assert connection.recv_match(type="COMMAND_ACK", blocking=True, timeout=1).get_signed()


def test_a_long_text_is_one():
    story, encoder = Story(), Encoder(1, 1)
    texts = [(b"x" * 50, 7, 0), (b"yz", 7, 1), (b"next\t", 0, 0)]
    story.hear(1.0, [encoder.encode(mavlink.MAVLink_statustext_message(6, *each)) for each in texts])
    assert story.texts == ["x" * 50 + "yz", "next"]


def test_only_what_exists_is_exported():
    assert sorted(sitl_mock.__all__) == ["LiveVehicle", "VirtualVehicle"]
    with pytest.raises(AttributeError, match="no attribute 'FlyingVehicle'"):
        _ = sitl_mock.FlyingVehicle


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wind": 3.0}, "wind: must be a list"),
        ({"wind": None}, "wind: must be a list"),
        ({"faults": {"kind": "silent"}}, "faults: must be a list"),
        ({"faults": ["silent"]}, "faults: must be tables"),
    ],
)
def test_arguments_of_the_wrong_kind_are_named(arguments, words):
    with pytest.raises(ConfigError, match=words):
        VirtualVehicle(**arguments)
