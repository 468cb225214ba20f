"""Pose messages: NED and FRD in, NWU and FLU out, told apart by values that are all different."""

from __future__ import annotations

import math

import pytest

from mavquad.protocol.codec import mavlink
from mavquad.protocol.messages import attitude_from, position_from


def test_position():
    position = position_from(mavlink.MAVLink_local_position_ned_message(1234, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert position.stamp_us == 1_234_000
    assert position.position_nwu_m == (1.0, -2.0, -3.0)
    assert position.velocity_nwu_m_s == (4.0, -5.0, -6.0)


def test_attitude():
    attitude = attitude_from(mavlink.MAVLink_attitude_message(1234, 0.1, 0.2, 0.3, 4.0, 5.0, 6.0))
    assert attitude.stamp_us == 1_234_000
    assert (attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad) == (0.1, -0.2, -0.3)
    assert attitude.rates_flu_rad_s == (4.0, -5.0, -6.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(6))
def test_a_value_that_is_not_finite_makes_no_measurement(place, value):
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    values[place] = value
    assert position_from(mavlink.MAVLink_local_position_ned_message(1, *values)) is None
    assert attitude_from(mavlink.MAVLink_attitude_message(1, *values)) is None
