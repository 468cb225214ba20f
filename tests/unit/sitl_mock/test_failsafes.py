"""Links, battery and geofence: what PX4 does by its parameters, and what it says; 1.13 and later differ."""

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.personality.params import to_wire

MISSION_MODE = (4, 4)


def set_parameter(p, name, value):
    kind = mavlink.MAV_PARAM_TYPE_INT32 if isinstance(value, int) else mavlink.MAV_PARAM_TYPE_REAL32
    p.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), to_wire(value), kind))
    return p


def drain(p, remaining):
    p.mock._world.drain_battery(remaining)
    return p


# --- the ground station ---------------------------------------------------------------------------------------------------


def test_113_without_pilot_and_ground_station_turns_back_from_its_takeoff(pilot):
    # seen on 1.13.3: AUTO.TAKEOFF, then AUTO.RTL two seconds later, on the ground still
    p = pilot().run(1.1)
    p.command(400, 1)
    p.command(22, 0, 0, 0, float("nan"), float("nan"), float("nan"), float("nan"))
    p.run(1.0)
    assert p.mock.mode == "AUTO.TAKEOFF"
    p.run(1.5)
    assert p.mock.mode == "AUTO.RTL"
    p.run(8.0)
    assert not p.mock.armed
    p = pilot(firmware="1.16").run(1.1)
    p.command(400, 1)
    p.command(22, 0, 0, 0, float("nan"), float("nan"), float("nan"), float("nan"))
    p.run(12.0)
    assert p.mock.mode == "AUTO.LOITER"


@pytest.mark.parametrize(("action", "mode"), [(0, "AUTO.RTL"), (1, "AUTO.LOITER"), (2, "AUTO.RTL"), (3, "AUTO.LAND")])
def test_loss_of_the_ground_station_on_113(pilot, action, mode):
    p = set_parameter(pilot().hover(), "NAV_DLL_ACT", action)
    p.heartbeat().run(9.9)
    assert p.mock.mode == "AUTO.LOITER"
    p.run(0.3)
    assert p.mock.mode == mode
    p.heartbeat().run(0.1)
    texts = p.texts()
    assert "Connection to ground station lost" in texts
    reason = "no datalink" if action else "no RC and no datalink"
    assert f"Failsafe enabled: {reason}" in texts
    assert "Data link regained" in texts


@pytest.mark.parametrize(("action", "mode"), [(0, "AUTO.LOITER"), (2, "AUTO.RTL"), (3, "AUTO.LAND")])
def test_loss_of_the_ground_station_on_116_holds_first(pilot, action, mode):
    p = set_parameter(pilot(firmware="1.16").hover(), "NAV_DLL_ACT", action)
    p.heartbeat().run(10.1)
    assert p.mock.mode == "AUTO.LOITER"
    p.run(4.8)
    assert p.mock.mode == "AUTO.LOITER"
    p.run(0.3)
    assert p.mock.mode == mode
    p.heartbeat().run(0.1)
    told = [text for text in p.texts() if text.startswith("Failsafe")]
    assert told == (["Failsafe activated: entering Hold for 5 seconds", "Failsafe activated"] if action else [])
    assert p.mock.mode == mode  # it goes on although the link is back
    assert p.command(176, 1, 4, 3)[-1] == 0
    p.fly(1.0)
    assert p.mock.mode == "AUTO.LOITER"


def test_116_does_not_arm_without_the_ground_station_that_it_would_miss(pilot):
    p = set_parameter(pilot(firmware="1.16").run(1.1), "NAV_DLL_ACT", 2)
    assert p.command(400, 1) == [1]
    p.heartbeat()
    assert p.command(400, 1) == [0]


# --- setpoints: every action of every release -------------------------------------------------------------------------------


@pytest.mark.parametrize(("action", "mode"), [(0, "AUTO.LAND"), (1, "AUTO.LOITER"), (2, "AUTO.RTL"), (-1, "OFFBOARD")])
def test_loss_of_setpoints_on_113(pilot, action, mode):
    p = set_parameter(pilot().hover(), "COM_OBL_ACT", action)
    p.position(0.0, 0.0, -2.5)
    p.offboard()
    p.fly(1.1)
    assert p.mock.mode == mode
    p.position(0.0, 0.0, -2.5)
    p.run(0.02)
    assert p.mock.mode == "OFFBOARD"


@pytest.mark.parametrize("firmware", ["1.14", "1.15", "1.16"])
@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, "POSCTL"), (1, "ALTCTL"), (2, "STABILIZED"), (3, "AUTO.RTL"), (4, "AUTO.LAND"), (5, "AUTO.LOITER")],
)
def test_loss_of_setpoints_on_later_releases(pilot, firmware, action, mode):
    p = set_parameter(pilot(firmware=firmware).hover(), "COM_OBL_RC_ACT", action)
    set_parameter(p, "COM_OF_LOSS_T", 0.5)
    p.position(0.0, 0.0, -2.5)
    p.offboard()
    p.heartbeat().run(0.45)
    assert p.mock.mode == "OFFBOARD"
    p.fly(0.1)
    assert p.mock.mode == mode
    assert "Failsafe activated" in p.texts()
    p.position(0.0, 0.0, -2.5)
    p.run(0.02)
    assert p.mock.mode == "OFFBOARD"


@pytest.mark.parametrize(("action", "mode"), [(0, "AUTO.RTL"), (1, "AUTO.RTL"), (4, "AUTO.LAND"), (5, "AUTO.LOITER")])
def test_loss_of_setpoints_on_117_without_sticks(pilot, action, mode):
    p = set_parameter(pilot(firmware="1.17").hover(), "COM_OBL_RC_ACT", action)
    p.position(0.0, 0.0, -2.5)
    p.offboard()
    p.fly(1.1)
    assert p.mock.mode == mode
    assert "Failsafe activated" in p.texts()


@pytest.mark.parametrize("action", [6, 7])
def test_loss_of_setpoints_may_stop_the_motors(pilot, action):
    p = set_parameter(pilot(firmware="1.16").hover(), "COM_OBL_RC_ACT", action)
    p.position(0.0, 0.0, -2.5)
    p.offboard()
    p.fly(2.5)
    assert p.truth.crashed
    assert not p.mock.armed


# --- geofence ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", ["1.13", "1.16"])
@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, "AUTO.TAKEOFF"), (1, "AUTO.TAKEOFF"), (2, "AUTO.LOITER"), (3, "AUTO.RTL"), (5, "AUTO.LAND")],
)
def test_geofence(pilot, firmware, action, mode):
    p = set_parameter(pilot(firmware=firmware).hover(), "GF_ACTION", action)
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 20.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.command(22, 0, 0, 0, float("nan"), float("nan"), float("nan"), float("nan"))
    p.fly(2.0)
    p.mock._personality.breach_geofence()
    p.fly(0.5)
    assert "Geofence exceeded" in p.texts()
    p.fly(5.5)  # 1.16 holds for 5 s before it returns or lands
    assert p.mock.mode == mode
    p.command(176, 1, 4, 3)
    p.fly(1.0)
    assert p.mock.mode == "AUTO.LOITER"


@pytest.mark.parametrize("firmware", ["1.13", "1.16"])
def test_geofence_may_stop_the_motors(pilot, firmware):
    p = set_parameter(pilot(firmware=firmware).hover(), "GF_ACTION", 4)
    p.mock._personality.breach_geofence()
    p.fly(2.0)
    assert p.truth.crashed


# --- battery ----------------------------------------------------------------------------------------------------------------


def test_battery_of_113_warns_by_default(pilot):
    p = pilot().hover()
    for remaining, text in (
        (0.14, "Low battery level, return advised"),
        (0.06, "Critical battery level, return now"),
        (0.04, "Dangerous battery level, land now"),
    ):
        drain(p, remaining).fly(1.0)
        assert p.texts()[-1] == text
    assert p.messages("STATUSTEXT")[-1].severity == mavlink.MAV_SEVERITY_EMERGENCY
    p.fly(12.0)
    assert p.mock.mode == "AUTO.LOITER"


@pytest.mark.parametrize(
    ("action", "remaining", "mode"), [(2, 0.06, "AUTO.LAND"), (3, 0.06, "AUTO.RTL"), (3, 0.04, "AUTO.LAND")]
)
def test_battery_of_113_acts_after_a_while(pilot, action, remaining, mode):
    p = set_parameter(pilot().hover(), "COM_LOW_BAT_ACT", action)
    set_parameter(p, "COM_BAT_ACT_T", 4.0)
    p.position()
    p.offboard()
    drain(p, remaining)
    p.stream(lambda q: q.position(), 1.0)
    p.heartbeat().run(0.1)
    assert p.mock.mode == "AUTO.LOITER"
    assert any("executing AUTO_" in text and text.endswith("in 4 seconds") for text in p.texts())
    p.fly(3.5)
    assert p.mock.mode == mode


@pytest.mark.parametrize(
    ("action", "remaining", "mode"),
    [(0, 0.04, "AUTO.LOITER"), (2, 0.06, "AUTO.LAND"), (3, 0.06, "AUTO.RTL"), (3, 0.04, "AUTO.LAND")],
)
def test_battery_of_116(pilot, action, remaining, mode):
    p = set_parameter(pilot(firmware="1.16").hover(), "COM_LOW_BAT_ACT", action)
    drain(p, remaining).fly(1.0)
    assert p.mock.mode == "AUTO.LOITER"
    assert any(text in ("Critical battery", "Emergency battery level") for text in p.texts())
    p.fly(5.0)
    assert p.mock.mode == mode
