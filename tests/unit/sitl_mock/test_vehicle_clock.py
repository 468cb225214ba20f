"""A vehicle whose clock is slow."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.endpoint import GRID_US
from mavquad.protocol.codec import mavlink
from sitl_mock.vehicle_clock import VehicleClock
from tests.unit.sitl_mock.conftest import START_US


@given(st.floats(0, 0.5), st.integers(0, 10**10))
def test_the_wall_time_of_a_vehicle_time(drift, ticks):
    clock = VehicleClock(START_US, drift)
    vehicle_us = START_US + ticks * GRID_US
    wall_us = clock.wall_us(vehicle_us)
    assert wall_us % GRID_US == 0
    assert clock.vehicle_us(wall_us) == pytest.approx(vehicle_us, abs=GRID_US, rel=0)
    assert (wall_us - START_US) * (1 - drift) == pytest.approx(vehicle_us - START_US, abs=GRID_US, rel=1e-12)


def test_without_drift_both_are_one():
    clock = VehicleClock(START_US, 0.0)
    assert clock.vehicle_us(START_US + 123_456) == clock.wall_us(START_US + 123_456) == START_US + 123_456


def test_all_that_the_vehicle_tells_is_by_its_own_clock(pilot):
    p = pilot(firmware="1.16", clock_drift=0.02).run(10.0)
    assert len(p.messages("SYS_STATUS")) == pytest.approx(49, abs=1)  # 5 Hz of its own
    stamp_us, told = p.stamps_us("ATTITUDE")[-1], p.messages("ATTITUDE")[-1]
    assert told.time_boot_ms == pytest.approx(0.98 * stamp_us / 1000, abs=8)
    assert {m.time_boot_ms % 4 for m in p.messages("ATTITUDE")} == {0}
    (answer,) = [m for m in p.send(mavlink.MAVLink_timesync_message(0, 77)) if m.get_type() == "TIMESYNC" and m.tc1]
    assert answer.tc1 / 1e9 == pytest.approx(9.8, abs=0.01)
    assert p.messages("SYSTEM_TIME")[-1].time_unix_usec - START_US == pytest.approx(9.8e6, abs=1.1e6)


def test_it_flies_as_ever(pilot):
    slow = pilot(clock_drift=0.02).hover()
    assert slow.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.3)
