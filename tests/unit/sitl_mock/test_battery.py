"""The battery: full for ever by default; sag, drain and thrust of one that is not."""

import pytest

from sitl_mock.battery import FULL, Battery, BatteryModel, BatteryParams
from sitl_mock.plant import VehicleParams

VEHICLE = VehicleParams()
HOVER = VEHICLE.hover_thrust_norm
REAL = BatteryParams(full_v=16.8, empty_v=14.0, resistance_ohm=0.02, capacity_ah=2.0, hover_current_a=10.0)


def run(battery, level, seconds, dt_s=1.0):
    model = BatteryModel(battery, VEHICLE, dt_s)
    for _ in range(round(seconds / dt_s)):
        model.step((level,) * 4)
    return model


def test_the_default_is_full_for_ever():
    model = run(BatteryParams(), 1.0, 36000.0, dt_s=60.0)
    assert model.reading == FULL == Battery(16.2, 0.0, 1.0)
    assert model.supply == 1.0


def test_sag_under_the_hover_current():
    model = run(REAL, HOVER, 1.0)
    assert model.reading.current_a == pytest.approx(10.0)
    # 1 s of 10 A out of 2 Ah: 10 / 7200 of the charge, of 2.8 V
    assert model.reading.voltage_v == pytest.approx(16.8 - 2.8 * 10 / 7200 - 0.2)
    assert model.supply == pytest.approx((model.reading.voltage_v / 16.8) ** 2)


def test_current_goes_with_the_power_of_each_rotor():
    model = BatteryModel(REAL, VEHICLE)
    model.step((2 * HOVER, 0.0, HOVER, HOVER))
    assert model.reading.current_a == pytest.approx(10.0 / 4 * (2**1.5 + 2))
    curved = BatteryModel(REAL, VehicleParams(thrust_curve=0.5))
    curved.step((0.8, 0.0, 0.0, 0.0))
    assert curved.reading.current_a == pytest.approx(10.0 / 4 * (3.6 / 2.4525) ** 1.5)  # 5 N (0.4 + 0.32)


def test_it_empties_in_its_time_and_stays_empty():
    # 2 Ah at 10 A: 720 s
    assert run(REAL, HOVER, 360.0).reading.remaining == pytest.approx(0.5)
    empty = run(REAL, HOVER, 800.0).reading
    assert empty == pytest.approx(Battery(14.0 - 0.2, 10.0, 0.0))


def test_without_a_load_it_keeps_its_charge():
    assert run(REAL, 0.0, 3600.0).reading == Battery(16.8, 0.0, 1.0)


@pytest.mark.parametrize(("given", "left"), [(0.25, 0.25), (-1.0, 0.0), (2.0, 1.0)])
def test_drained(given, left):
    model = BatteryModel(BatteryParams(), VEHICLE)
    model.drain(given)
    assert model.reading == pytest.approx(Battery(14.0 + 2.2 * left, 0.0, left))
    model.step((HOVER,) * 4)
    assert model.reading.remaining == left
