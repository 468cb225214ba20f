"""The wind: steady without gusts, gusts of the given size and memory, the same for the same seed; flights in it."""

import math
import statistics

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.config import MockConfig
from sitl_mock.geometry import tilt_rad
from sitl_mock.plant import VehicleState
from sitl_mock.wind import Gusts, wind_of

HERE = VehicleState()


def gusts(sd=2.0, time_s=1.0, seed=1, steps=100_000, steady=(0.0, 0.0, 0.0)):
    wind = Gusts(steady, sd, time_s, seed, dt_s=0.02)
    return [wind.step(HERE) for _ in range(steps)]


def test_without_gusts_the_wind_is_steady():
    wind = wind_of(MockConfig(wind_ned_m_s=(3.0, -2.0, 1.0)), 1)
    assert {wind.step(HERE) for _ in range(100)} == {(3.0, -2.0, 1.0)}


def test_gusts_have_their_size_around_the_steady_wind_and_leave_the_vertical_alone():
    north, east, down = zip(*gusts(steady=(3.0, -2.0, 1.0)), strict=True)
    assert statistics.fmean(north) == pytest.approx(3.0, abs=0.25)
    assert statistics.fmean(east) == pytest.approx(-2.0, abs=0.25)
    assert statistics.stdev(north) == pytest.approx(2.0, rel=0.1)
    assert statistics.stdev(east) == pytest.approx(2.0, rel=0.1)
    assert set(down) == {1.0}
    assert statistics.correlation(north, east) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("time_s", [0.5, 2.0])
def test_gusts_forget_in_their_correlation_time(time_s):
    north = [wind[0] for wind in gusts(time_s=time_s)]
    lag = round(time_s / 0.02)
    assert statistics.correlation(north[:-lag], north[lag:]) == pytest.approx(math.exp(-1), abs=0.1)


def test_gusts_start_as_they_go_on():
    first = [Gusts((0.0, 0.0, 0.0), 2.0, 1.0, seed).step(HERE)[0] for seed in range(500)]
    assert statistics.stdev(first) == pytest.approx(2.0, rel=0.1)


def test_same_seed_same_gusts():
    assert gusts(seed=5, steps=50) == gusts(seed=5, steps=50)
    assert gusts(seed=5, steps=50) != gusts(seed=6, steps=50)


def test_the_size_of_the_gusts_changes_nothing_else(pilot):
    """What the estimator draws is the same with and without them: on the ground the frames are equal."""

    def frames(**config):
        return pilot(**config).run(2.0).frames

    assert frames() == frames(gusts_m_s=3.0, gusts_time_s=0.5)


def test_gusts_move_the_vehicle_the_same_way_each_time(pilot, quiet):
    def place(**config):
        return pilot(sensors=quiet, **config).fly_to_hover().truth.position_ned_m

    calm, gusty = place(), place(gusts_m_s=2.0)
    assert math.dist(calm, gusty) > 0.05
    assert place(gusts_m_s=2.0) == gusty


# Not 0.7 kg in gusts: to touch down leaning by 55 degrees tips it over now and then.
@pytest.mark.parametrize(
    ("mass_kg", "lean_deg", "gusts_m_s"),
    [(0.7, 49.4, 0.0), (0.85, 43.8, 0.0), (1.0, 39.2, 0.0), (1.0, 39.2, 1.5), (1.3, 32.1, 0.0), (1.3, 32.1, 1.5)],
)
def test_its_own_flight_in_strong_wind(pilot, mass_kg, lean_deg, gusts_m_s):
    """8 m/s of wind push with 8 N: at 0.7 kg it has to lean by atan(8 / 6.87), with the motors of 1 kg."""
    p = pilot(wind_ned_m_s=[8.0, 0.0, 0.0], vehicle={"mass_kg": mass_kg}, gusts_m_s=gusts_m_s)
    p.send(mavlink.MAVLink_param_set_message(1, 1, b"MPC_TILTMAX_AIR", 60.0, mavlink.MAV_PARAM_TYPE_REAL32))
    p.fly_to_hover()
    leans = []
    for _ in range(30):
        p.run(1.0).heartbeat()
        leans.append(math.degrees(tilt_rad(p.truth.quaternion)))
    assert statistics.fmean(leans[10:]) == pytest.approx(lean_deg, abs=1.5)
    assert p.truth.position_ned_m == pytest.approx((0.0, 0.0, -2.5), abs=0.3 + gusts_m_s)
    p.command(21)
    p.fly(25.0)
    assert p.texts()[-1] == "Disarmed by landing"
    assert not p.truth.crashed
    assert math.hypot(*p.truth.position_ned_m[:2]) < 1.0 + gusts_m_s
