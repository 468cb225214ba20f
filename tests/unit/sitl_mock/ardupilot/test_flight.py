"""A whole flight of the ArduCopter personality by a scripted pilot: takeoff, velocity, rates, return, landing."""

from __future__ import annotations

import math

from mavquad.protocol.codec import mavlink

GUIDED = 4


def test_a_flight(copter):
    vehicle = copter(seed=5, ready_s=5.0)
    vehicle.run(6.0).heartbeat()
    assert vehicle.mode(GUIDED) == vehicle.command(400, 1) == vehicle.command(22, 0, 0, 0, 0, 0, 0, 12) == [0]
    vehicle.run(14.0)
    assert abs(vehicle.truth.position_ned_m[2] + 12) < 0.5

    vehicle.stream(lambda v: v.local(0xDC7, velocity=(3.0, -1.0, 0.0)), 6.0)
    assert vehicle.truth.position_ned_m[0] > 10

    vehicle.set("GUID_OPTIONS", 8)
    vehicle.stream(lambda v: v.rates(yaw=0.5, thrust=0.366), 2.0)
    assert vehicle.truth.euler_rad[2] > 0.3

    assert vehicle.mode(6) == [0]
    vehicle.run(80.0)
    truth = vehicle.truth
    assert math.hypot(*truth.position_ned_m[:2]) < 0.5
    assert truth.landed and not truth.armed and not truth.crashed
    assert vehicle.texts()[-2].startswith("SIM Hit ground at 0.")
    assert vehicle.texts()[-1] == "Disarming motors"

    vehicle.mode(GUIDED)
    assert vehicle.command(400, 1) == [0]


def test_the_same_seed_gives_the_same_bytes(copter):
    def frames(seed):
        vehicle = copter(seed=seed).arm()
        vehicle.command(511, mavlink.MAVLINK_MSG_ID_ATTITUDE, 10_000)
        vehicle.command(22, 0, 0, 0, 0, 0, 0, 5)
        return vehicle.run(8.0).frames

    assert frames(3) == frames(3)
    assert frames(3) != frames(4)


def test_it_holds_its_place(copter):
    """RMS of the error against its own estimate over 20 s; the real one's was 1.84 cm."""
    vehicle = copter().hover()
    vehicle.run(10.0)
    vehicle.command(511, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20_000)
    vehicle.forget()
    places = vehicle.run(20.0).messages("LOCAL_POSITION_NED")
    mean = sum(m.x**2 + m.y**2 + (m.z + 10.0) ** 2 for m in places) / len(places)
    assert math.sqrt(mean) < 0.2


def test_it_holds_its_place_in_a_wind(copter):
    vehicle = copter(wind_ned_m_s=[6.0, -3.0, 0.0]).hover()
    vehicle.run(10.0)
    assert math.dist(vehicle.truth.position_ned_m, (0.0, 0.0, -10.0)) < 0.6
    assert vehicle.truth.euler_rad[1] > 0.05  # leans into it


def test_it_flies_px4s_vehicle_too(copter):
    """SIH's quadcopter: frame x, slow motors, no thrust curve."""
    vehicle = copter(vehicle={
        "frame": "x", "mass_kg": 1.0, "inertia_kg_m2": [0.025, 0.025, 0.030], "motor_thrust_max_n": 5.0,
        "motor_torque_max_nm": 0.1, "thrust_curve": 0.0, "arm_m": 0.2, "linear_drag_n_s_m": 1.0,
        "quadratic_drag_n_s2_m2": 0.0, "rotor_drag_n_s_m": 0.0, "angular_drag_nm_s_rad": 0.025,
        "motor_time_constant_s": 0.05,
    }).hover()  # fmt: skip
    vehicle.local(0xDF8, (4.0, 3.0, -8.0))
    vehicle.run(12.0)
    assert math.dist(vehicle.truth.position_ned_m, (4.0, 3.0, -8.0)) < 0.6
    assert max(map(abs, vehicle.truth.rates_frd_rad_s)) < 0.3
