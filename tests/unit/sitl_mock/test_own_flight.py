"""Whole flights in the autopilot's own modes, in virtual time; truth against what was asked."""

import math

import pytest

NAN = math.nan


def hover_rms_m(p, seconds):
    """RMS of the true distance from the mean point over a hover."""
    points = []
    for _ in range(round(seconds * 10)):
        p.heartbeat().run(0.1)
        points.append(p.truth.position_ned_m)
    middle = tuple(sum(axis) / len(points) for axis in zip(*points, strict=True))
    return math.sqrt(sum(math.dist(point, middle) ** 2 for point in points) / len(points))


@pytest.mark.parametrize("model", ["rigid_body", "paper"])
def test_takeoff_hover_land(pilot, model):
    p = pilot(vehicle={"model": model}).hover()
    assert p.truth.position_ned_m == pytest.approx((0.0, 0.0, -2.5), abs=0.3)
    # the estimate wanders by 5 cm per axis with 20 s of memory; the hold follows it
    assert hover_rms_m(p, 20.0) < 0.10
    p.heartbeat()
    p.forget()
    p.command(21)
    p.fly(9.0)
    assert p.truth.landed
    assert p.mock.armed
    p.fly(2.1)
    assert not p.mock.armed
    assert p.texts() == ["Landing at current position", "Landing detected", "Disarmed by landing"]
    assert not p.truth.crashed


def test_without_noise_it_stands_still(pilot, quiet):
    p = pilot(sensors=quiet).hover().run(5.0)
    assert hover_rms_m(p, 5.0) < 0.002
    assert p.truth.position_ned_m[2] == pytest.approx(-2.5, abs=0.01)


def test_hover_thrust_is_reported(pilot):
    p = pilot().hover().run(3.0)
    thrust = [m.thrust for m in p.messages("ATTITUDE_TARGET")]
    assert sum(thrust) / len(thrust) == pytest.approx(0.4905, abs=0.003)


def test_climbs_and_sinks_at_px4s_speeds(pilot, quiet):
    p = pilot(sensors=quiet).run(1.1)
    p.command(400, 1)
    p.command(22, 0, 0, 0, NAN, NAN, NAN, 32.5 + 8.0)
    p.fly(7.0)
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(-1.5, abs=0.1)
    p.fly(8.0)
    p.command(21)
    p.fly(8.0)
    assert 1.0 < -p.truth.position_ned_m[2] < 5.0
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(0.7, abs=0.1)
    while -p.truth.position_ned_m[2] > 0.5:
        p.fly(0.2)
    assert p.truth.velocity_ned_m_s[2] == pytest.approx(0.3, abs=0.1)


def test_wind_leaves_no_steady_offset(pilot, quiet):
    p = pilot(sensors=quiet, wind_ned_m_s=[4.0, -3.0, 0.0]).hover().fly(30.0)
    assert p.truth.position_ned_m[:2] == pytest.approx((0.0, 0.0), abs=0.05)
    # it leans against the wind: drag 1 N/(m/s), weight 9.81 N; specific force (-4, 3, -9.81)
    roll, pitch, _ = p.truth.euler_rad
    assert math.tan(pitch) == pytest.approx(4.0 / 9.81, abs=0.02)
    assert math.tan(roll) / math.cos(pitch) == pytest.approx(3.0 / 9.81, abs=0.02)


def test_landed_states_of_a_flight(pilot):
    p = pilot().run(1.1).heartbeat()
    p.command(400, 1)
    p.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
    p.fly(12.0)
    p.command(21)
    p.fly(12.0)
    states = [m.landed_state for m in p.messages("EXTENDED_SYS_STATE")]
    changes = [state for i, state in enumerate(states) if i == 0 or states[i - 1] != state]
    assert changes == [1, 3, 2, 4, 1]  # as recorded: on ground, takeoff, in air, landing, on ground


def test_return_flies_home_and_lands(pilot):
    p = pilot().hover()
    p.position()
    p.offboard()
    p.stream(lambda q: q.position(5.0, 0.0, -3.0), 8.0, hz=10)
    p.command(20)
    p.run(25.0)
    assert math.hypot(*p.truth.position_ned_m[:2]) < 0.6
    assert not p.mock.armed


def test_a_fall_is_a_crash(pilot):
    p = pilot().hover()
    p.command(400, 0, 21196)
    p.run(2.0).heartbeat()
    assert p.truth.crashed
    assert p.command(400, 1) == [1]


def test_heading_at_the_start(pilot, quiet):
    for model in ("rigid_body", "paper"):
        p = pilot(sensors=quiet, vehicle={"heading_deg": 90.0, "model": model}).run(0.1)
        assert p.messages("ATTITUDE")[-1].yaw == pytest.approx(math.pi / 2, abs=1e-6)


def test_same_seed_same_bytes(pilot):
    def flight(seed):
        p = pilot(seed=seed).run(1.1)
        p.command(400, 1)
        p.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
        return p.run(4.0).frames

    assert flight(7) == flight(7)
    assert flight(7) != flight(8)
