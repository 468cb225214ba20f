"""The battery: charge and voltage, lasting; what is not known says nothing."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from mavquad.flight.guard_battery import BatteryMonitor, BatteryParams
from mavquad.protocol.codec import mavlink

PARAMS = BatteryParams(remaining_percent=20.0, voltage_v=14.0, for_s=3.0)
UNKNOWN = 65535


def battery(remaining=80, cells_mv=(16000,), which=0):
    voltages = [*cells_mv, *[UNKNOWN] * 10][:10]
    return mavlink.MAVLink_battery_status_message(which, 0, 1, 0, voltages, 0, 0, 0, remaining)


def sys_status(remaining=80, voltage_mv=16000):
    return mavlink.MAVLink_sys_status_message(0, 0, 0, 0, voltage_mv, 0, remaining, 0, 0, 0, 0, 0, 0)


def lasting(message, params=PARAMS, seconds=3.0):
    """What comes of it after so long, heard twice a second."""
    monitor = BatteryMonitor(params)
    take = monitor.take_sys_status if message.get_type() == "SYS_STATUS" else monitor.take_battery
    return [take(message, round(step * 0.5e6)) for step in range(round(seconds * 2) + 1)][-1]


@pytest.mark.parametrize("message", [battery, sys_status])
def test_charge(message):
    assert lasting(message(20)) is None
    assert lasting(message(19), seconds=2.5) is None
    tripped = lasting(message(19))
    assert (tripped.name, tripped.reaction) == ("battery", "land")
    assert tripped.words == "19 % of the battery left, 20 % needed"
    assert lasting(message(0)) is not None


def test_voltage():
    assert lasting(sys_status(voltage_mv=14000)) is None
    assert lasting(sys_status(voltage_mv=13900)).words == "the battery gives 13.9 V, 14 V needed"


def test_the_voltage_of_a_battery_is_that_of_its_cells():
    assert lasting(battery(cells_mv=(3500, 3500, 3500, 3500))) is None
    assert lasting(battery(cells_mv=(3500, 3500, 3500, 3400))).words == "the battery gives 13.9 V, 14 V needed"
    assert lasting(battery(cells_mv=(13900,))) is not None  # PX4 and ArduPilot without cells: all of it in the first


@pytest.mark.parametrize(
    "message", [battery(-1, ()), battery(80, (0,)), sys_status(-1, UNKNOWN), sys_status(-1, 0)], ids=str
)
def test_what_is_not_known_says_nothing(message):
    assert lasting(message, seconds=10.0) is None


def test_a_sag_for_a_moment_is_none():
    monitor = BatteryMonitor(PARAMS)
    for step in range(40):
        assert monitor.take_sys_status(sys_status(voltage_mv=13000 if step % 5 else 15000), step * 500_000) is None


def test_each_battery_counts_for_itself():
    monitor = BatteryMonitor(PARAMS)
    for step in range(7):
        good, bad = battery(90, which=0), battery(10, which=1)
        tripped = [monitor.take_battery(message, step * 500_000) for message in (good, bad)]
    assert tripped[0] is None
    assert tripped[1] is not None
    assert monitor.low == {1: "10 % of the battery left, 20 % needed"}


def test_what_is_low_is_known_at_once_and_forgotten_when_it_is_not():
    monitor = BatteryMonitor(PARAMS)
    monitor.take_sys_status(sys_status(5), 0)
    assert monitor.low == {-1: "5 % of the battery left, 20 % needed"}
    monitor.take_sys_status(sys_status(50), 4)
    assert monitor.low == {}


def test_zero_is_off():
    off = BatteryParams(remaining_percent=0.0, voltage_v=0.0)
    assert lasting(sys_status(0, 1), off, 60.0) is None


def test_a_limit_out_of_range_is_refused():
    with pytest.raises(ValidationError):
        BatteryParams(remaining_percent=101.0)
