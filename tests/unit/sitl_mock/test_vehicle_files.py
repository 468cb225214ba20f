"""Vehicles from files: those that come with the mock, one's own, and what is wrong with it."""

import json

import pytest

from mavquad.errors import ConfigError
from mavquad.schema import parse_section
from sitl_mock.config import MockConfig
from sitl_mock.config.vehicle import VehicleConfig, load_vehicle, vehicle_names


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


def test_sih_is_the_default():
    assert load_vehicle("sih") == VehicleConfig()


def test_every_vehicle_that_comes_with_it_can_be_flown():
    assert {"sih", "arducopter"} <= set(vehicle_names())
    for name in vehicle_names():
        assert 0.2 < load_vehicle(name).params().hover_thrust_norm < 0.8


def test_arducopter_as_seen():
    """FIRMWARE: hovers at PWM 1590 of 1150 to 1950, 75.5 N for 3 kg; motor "+"; 28 A in the recorded hover."""
    vehicle = load_vehicle("arducopter")
    assert 1150 + 800 * vehicle.params().hover_thrust_norm == pytest.approx(1590, abs=1)
    assert vehicle.params().thrust_to_weight == pytest.approx(2.57, abs=0.01)
    assert vehicle.frame == "plus"


@pytest.mark.parametrize(
    ("table", "mass_kg", "frame", "heading_deg"),
    [
        ({}, 1.0, "x", 0.0),
        ({"autopilot": "ardupilot"}, 3.0, "plus", 0.0),
        ({"autopilot": "ardupilot", "vehicle": {"heading_deg": 30.0}}, 3.0, "plus", 30.0),
        ({"autopilot": "ardupilot", "vehicle": json.loads(VehicleConfig().model_dump_json())}, 1.0, "x", 0.0),
        ({"vehicle": {"mass_kg": 1.5, "inertia_kg_m2": [0.02, 0.02, 0.03]}}, 1.5, "x", 0.0),
    ],
)
def test_each_autopilot_flies_its_own_vehicle(table, mass_kg, frame, heading_deg):
    vehicle = parse_section(MockConfig, table, "file").vehicle
    assert (vehicle.mass_kg, vehicle.frame, vehicle.heading_deg) == (mass_kg, frame, heading_deg)


def test_a_loaded_vehicle_is_taken_as_it_is():
    assert MockConfig(autopilot="ardupilot", vehicle=load_vehicle("sih")).vehicle.mass_kg == 1.0
    assert MockConfig(autopilot="ardupilot").vehicle == load_vehicle("arducopter")


def test_ones_own(tmp_path):
    vehicle = load_vehicle(written(tmp_path, "mass_kg = 1.4\npayload_kg = 0.3\nrotor_strengths = [1, 1, 0.9, 1]\n"))
    assert (vehicle.params().mass_kg, vehicle.params().payload_kg) == (1.4, 0.3)
    assert vehicle.params().rotor_strengths == (1.0, 1.0, 0.9, 1.0)
    assert vehicle.arm_m == 0.2


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("mas_kg = 1.0", "mas_kg", "did you mean mass_kg"),
        ("mass_kg = -1.0", "mass_kg", "greater than 0"),
        ("inertia_kg_m2 = [0.02, 0.02]", "inertia_kg_m2.2", "required"),
        ("inertia_kg_m2 = [0.02, nan, 0.02]", "inertia_kg_m2.1", "(given:"),
        ('frame = "y6"', "frame", "'x' or 'plus'"),
        ("thrust_curve = 1.5", "thrust_curve", "less than or equal to 1"),
        ("rotor_strengths = [1.0, 1.0, 1.0, 1.1]", "rotor_strengths.3", "less than or equal to 1"),
        ("mass_kg = 10.0", "", "thrust to weight"),
        ("payload_kg = 1.0", "", "payload_kg must be less than mass_kg"),
        ("payload_kg = 0.95", "", "without payload_kg thrust to weight"),
        ("battery_empty_v = 17.0", "", "battery_empty_v must be battery_full_v at most"),
        ("battery_capacity_ah = 1.0", "", "battery_capacity_ah needs hover_current_a"),
        ("battery_resistance_ohm = 1.0\nhover_current_a = 10.0", "", "battery_resistance_ohm takes too much"),
        ('model = "paper"\nframe = "plus"', "", "frame is not in the equations"),
        ('model = "paper"\nthrust_curve = 0.1', "", "thrust_curve is not in the equations"),
        ('model = "paper"\nrotor_drag_n_s_m = 0.1', "", "rotor_drag_n_s_m is not in the equations"),
        ('model = "paper"\nquadratic_drag_n_s2_m2 = 0.1', "", "quadratic_drag_n_s2_m2 is not in the equations"),
        ("mass_kg = ", "", "not a TOML file"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_key(tmp_path, text, key, reason):
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_vehicle(path)
    assert caught.value.key == key
    assert path in str(caught.value)
    assert reason in str(caught.value)


def test_no_such_vehicle(tmp_path):
    with pytest.raises(ConfigError, match=r"no vehicle of that name.*arducopter, .*sih"):
        load_vehicle("phantom")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_vehicle(str(tmp_path))
