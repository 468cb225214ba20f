"""Vehicles that the simulation cannot fly are refused; those just within the limits fly and stay finite."""

from __future__ import annotations

import math

import pytest

from mavquad.errors import ConfigError
from mavquad.schema import parse_section
from sitl_mock.config import MockConfig

THRUST_N = 9.81 / 4


@pytest.mark.parametrize(
    ("vehicle", "words"),
    [
        ({"mass_kg": 1e-4, "linear_drag_n_s_m": 1000.0, "motor_thrust_max_n": 1e-3}, "mass_kg / linear_drag_n_s_m"),
        ({"linear_drag_n_s_m": 250.0}, "mass_kg / linear_drag_n_s_m must be more than 4 ms"),
        ({"inertia_kg_m2": [0.025, 1e-6, 0.03]}, "inertia_kg_m2 / angular_drag_nm_s_rad must be more than 4 ms"),
        ({"angular_drag_nm_s_rad": 6.25}, "inertia_kg_m2 / angular_drag_nm_s_rad must be more than 4 ms"),
        ({"motor_thrust_max_n": 1.19 * THRUST_N}, "thrust to weight, must be 1.2 to 20 (it is 1.19)"),
        ({"motor_thrust_max_n": 20.1 * THRUST_N}, "thrust to weight, must be 1.2 to 20 (it is 20.1)"),
        ({"mass_kg": 2.0}, "thrust to weight"),
    ],
    ids=str,
)
def test_a_vehicle_that_cannot_be_flown_is_refused(vehicle, words):
    with pytest.raises(ConfigError) as caught:
        parse_section(MockConfig, {"vehicle": vehicle}, "mock.toml", "mock")
    assert caught.value.key == "mock.vehicle"
    assert words in caught.value.reason


@pytest.mark.parametrize("model", ["rigid_body", "paper"])
@pytest.mark.parametrize(
    "vehicle",
    [
        {"linear_drag_n_s_m": 249.0},
        {"angular_drag_nm_s_rad": 6.2},
        {"inertia_kg_m2": [1.01e-4, 1.01e-4, 1.01e-4]},
        {"inertia_kg_m2": [1.01e-4, 0.025, 0.03]},
        {"motor_thrust_max_n": 1.21 * THRUST_N},
        {"motor_thrust_max_n": 19.9 * THRUST_N},
    ],
    ids=str,
)
def test_a_vehicle_just_within_the_limits_stays_finite(pilot, model, vehicle):
    p = pilot(vehicle={"model": model, **vehicle}, wind_ned_m_s=[50.0, 50.0, 0.0]).run(1.1).heartbeat()
    p.command(400, 1)
    p.command(22)
    p.run(6.0)
    p.command(21)
    p.run(3.0)
    truth = p.truth
    state = (*truth.position_ned_m, *truth.velocity_ned_m_s, *truth.quaternion, *truth.rates_frd_rad_s)
    assert all(map(math.isfinite, state))
