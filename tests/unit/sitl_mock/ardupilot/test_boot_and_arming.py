"""The start, the modes and the arming of the ArduCopter personality, as FIRMWARE's recordings show them."""

from __future__ import annotations

import pytest

from mavquad.protocol.codec import mavlink

REAL = 42.5


def states(copter):
    return [(m.custom_mode, m.base_mode, m.system_status) for m in copter.messages("HEARTBEAT")]


def test_the_moments_of_the_real_boot(copter):
    vehicle = copter(ready_s=REAL).heartbeat().run(0.9)
    assert not vehicle.messages("HEARTBEAT")
    vehicle.run(0.3)
    assert states(vehicle) == [(0, 89, 1)]
    vehicle.run(1.2)
    assert "ArduPilot Ready" not in vehicle.texts()
    vehicle.run(0.1)
    assert "ArduPilot Ready" in vehicle.texts()
    assert vehicle.run(1.0).messages("HEARTBEAT")[-1].base_mode == 81
    assert vehicle.run(16.4).messages("HOME_POSITION") == []
    vehicle.run(0.2)
    assert len(vehicle.messages("HOME_POSITION")) == len(vehicle.messages("GPS_GLOBAL_ORIGIN")) == 1


def test_a_shorter_start_keeps_the_proportions(copter):
    vehicle = copter(ready_s=4.25).heartbeat().run(0.24)
    assert "ArduPilot Ready" not in vehicle.texts()
    vehicle.run(0.02)
    assert "ArduPilot Ready" in vehicle.texts()


@pytest.mark.parametrize("after_s", [2.0, 2.5])
def test_a_mode_set_before_the_switch_is_read_is_lost(copter, after_s):
    """The real one reads its mode switch 0.1 to 0.3 s after "ArduPilot Ready"."""
    vehicle = copter(ready_s=REAL).run(after_s)
    assert vehicle.mode(4) == [0]
    assert vehicle.run(1.0).mock.mode == "STABILIZE"


def test_who_has_said_nothing_is_told_nothing(copter):
    vehicle = copter(ready_s=4.25).run(0.5)
    assert vehicle.texts() == []
    vehicle.heartbeat().run(4.0)
    assert vehicle.texts()[:1] == ["EKF3 IMU0 tilt alignment complete"]


def test_arming_is_refused_with_the_recorded_texts(copter):
    vehicle = copter(ready_s=REAL).run(4.0)
    vehicle.mode(4)
    vehicle.forget()
    assert vehicle.command(400, 1) == [4]
    assert vehicle.texts() == [
        "Arm: Need Alt Estimate",
        "Arm: Accels inconsistent",
        "Arm: EKF attitude is bad",
        "Arm: AHRS: waiting for home",
    ]
    assert {m.severity for m in vehicle.messages("STATUSTEXT")} == {2}


def test_the_checks_are_told_when_asked_for_and_not_of_an_armed_vehicle(copter):
    vehicle = copter(ready_s=REAL).run(24.0)
    vehicle.mode(4)
    vehicle.forget()
    assert vehicle.command(401) == [0]
    assert vehicle.texts() == ["PreArm: Need Position Estimate"]
    vehicle.mode(20)
    vehicle.command(400, 1)
    assert vehicle.command(401) == [1]


def test_guided_waits_for_the_position_and_stabilize_does_not(copter):
    vehicle = copter(ready_s=REAL).run(24.0)
    vehicle.mode(4)
    vehicle.forget()
    assert vehicle.command(400, 1) == [4]
    assert vehicle.texts() == ["Arm: Need Position Estimate"]
    vehicle.mode(20)
    assert vehicle.command(400, 1) == [0]


def test_arming_check_0_arms_without_accelerometers(copter):
    vehicle = copter(ready_s=REAL).run(7.0)
    vehicle.mode(20)
    assert vehicle.command(400, 1) == [4]
    vehicle.set("ARMING_CHECK", 0)
    assert vehicle.command(400, 1) == [0]


def test_prearm_complaints_come_every_30_s(copter):
    vehicle = copter(ready_s=REAL).run(5.0)
    vehicle.mode(4)
    vehicle.run(30.0)
    assert vehicle.texts().count("PreArm: Need Position Estimate") == 1


def test_arming_tells_home_and_says_so(copter):
    vehicle = copter().run(1.1)
    vehicle.mode(4)
    vehicle.forget()
    kinds = [m.get_type() for m in vehicle.send(mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, *[0] * 6))]
    assert kinds == ["COMMAND_ACK", "GPS_GLOBAL_ORIGIN", "HOME_POSITION", "STATUSTEXT"]
    assert vehicle.texts() == ["Arming motors"]


@pytest.mark.parametrize(("number", "name"), [(9, "LAND"), (6, "RTL"), (17, "BRAKE"), (3, "AUTO"), (7, "CIRCLE")])
def test_modes_that_cannot_be_armed(copter, number, name):
    vehicle = copter().run(1.1)
    assert vehicle.mode(number) == [0]
    assert vehicle.mock.mode == name
    vehicle.forget()
    assert vehicle.command(400, 1) == [4]
    assert vehicle.texts() == [f"Arm: {'Mode requires mission' if name == 'AUTO' else f'{name} mode not armable'}"]


def test_modes_by_number_and_message(copter):
    vehicle = copter().run(1.1)
    answers = vehicle.send(mavlink.MAVLink_set_mode_message(1, 1, 5))
    assert [(a.command, a.result) for a in answers if a.get_type() == "COMMAND_ACK"] == [(11, 0)]
    assert vehicle.mock.mode == "LOITER"
    assert [m.custom_mode for m in answers if m.get_type() == "HEARTBEAT"] == [5]


def test_an_unknown_mode(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    assert vehicle.mode(99) == [4]
    assert [(m.severity, m.text) for m in vehicle.messages("STATUSTEXT")] == [(4, "No such mode 99")]
    assert vehicle.mode(11) == [4]
    assert vehicle.texts()[-1] == "Mode change to DRIFT failed: not in this mock"
    assert vehicle.command(176, 0, 4) == [2]


def test_a_mode_that_needs_a_position_in_the_air_without_one(copter):
    vehicle = copter(ready_s=REAL).run(25.0)
    assert vehicle.command(400, 1) == [0]
    vehicle.forget()
    assert vehicle.mode(5) == [4]
    assert vehicle.texts() == ["Mode change to LOITER failed: requires position"]


def test_disarming_in_the_air_only_by_force(copter):
    vehicle = copter().hover()
    assert vehicle.command(400, 0) == [4]
    assert vehicle.truth.armed
    assert vehicle.command(400, 0, 21196) == [0]
    assert not vehicle.truth.armed
    assert vehicle.texts() == ["Disarming motors"]
    assert vehicle.run(3.0).truth.position_ned_m[2] == 0.0


def test_arming_twice_and_nonsense(copter):
    vehicle = copter().arm()
    assert vehicle.command(400, 1) == [0]
    assert vehicle.command(400, 5) == [3]


def test_nothing_done_disarms_after_a_while(copter):
    vehicle = copter().arm().run(10.2)
    assert vehicle.truth.armed
    assert not vehicle.run(0.4).truth.armed
    other = copter().arm()
    other.set("DISARM_DELAY", 3)
    assert not other.run(3.6).truth.armed


def test_motors_do_not_turn_before_2_36_s(copter):
    vehicle = copter().arm()
    vehicle.set("GUID_OPTIONS", 8)
    vehicle.command(511, 36, 20_000)
    vehicle.stream(lambda v: v.rates(thrust=0.55), 2.3)
    assert vehicle.truth.landed
    assert max(m.servo1_raw for m in vehicle.messages("SERVO_OUTPUT_RAW")) <= 1100
    vehicle.stream(lambda v: v.rates(thrust=0.55), 0.6)
    assert not vehicle.truth.landed
    assert vehicle.messages("SERVO_OUTPUT_RAW")[-1].servo1_raw > 1600


def test_takeoff_is_refused_disarmed_and_in_flight(copter):
    vehicle = copter().run(1.1)
    vehicle.mode(4)
    vehicle.forget()
    assert vehicle.command(22, 0, 0, 0, 0, 0, 0, 10) == [4]
    assert vehicle.texts() == []
    assert copter().hover().command(22, 0, 0, 0, 0, 0, 0, 20) == [4]
    stabilized = copter().run(1.1)
    stabilized.command(400, 1)
    assert stabilized.command(22, 0, 0, 0, 0, 0, 0, 10) == [4]


def test_other_targets_and_unknown_commands(copter):
    vehicle = copter().run(1.1)
    assert vehicle.command(400, 1, target=(2, 1)) == []
    assert vehicle.command(31999) == [3]
    assert vehicle.command(241) == [3]
    assert vehicle.command(176, 1, 4, target=(0, 0)) == [0]
    assert vehicle.command(176, 1, 5, target=(1, 190)) == [0]


def test_heartbeat_tells_what_is_recorded(copter):
    vehicle = copter().run(2.1)
    assert states(vehicle)[-1] == (0, 81, 3)
    vehicle.mode(4)
    assert states(vehicle)[-1] == (4, 89, 3)
    vehicle.command(400, 1)
    assert states(vehicle.run(1.0))[-1] == (4, 217, 3)
    flying = copter().hover().run(1.0)
    assert states(flying)[-1] == (4, 217, 4)
    flying.stream(lambda v: v.rates(thrust=0.5), 1.2)
    assert states(flying)[-1] == (4, 209, 4)


def test_the_banner_comes_with_the_parameters(copter):
    vehicle = copter().run(1.1)
    vehicle.forget()
    vehicle.send(mavlink.MAVLink_param_request_list_message(1, 1))
    assert vehicle.texts()[0] == "ArduCopter V4.7.0-dev (8fdb6a37)"
    assert vehicle.texts()[2] == "Frame: QUAD/PLUS"


def test_a_reboot_by_command(copter):
    vehicle = copter(ready_s=4.25).run(5.0)
    assert vehicle.command(246, 1) == [0]
    vehicle.run(1.1)
    vehicle.forget()
    vehicle.heartbeat().run(0.5)
    assert "ArduPilot Ready" in vehicle.texts()
    assert copter().hover().command(246, 1) == [4]
