"""The world as a whole: what can happen to a vehicle, and that it happens the same way each time."""

import itertools
import math

import pytest

from mavquad.schema import parse_section
from sitl_mock.config import MockConfig
from sitl_mock.plant import TICK_US
from sitl_mock.world import World

HOVER = 0.4905
LIVELY = {"gusts_m_s": 1.0, "wind_ned_m_s": [2.0, -1.0, 0.0]}


def world(seed=1, **config):
    made = World(parse_section(MockConfig, config, "test"), seed)
    made.boot_us = 0
    return made


def run(made, level, seconds):
    commands = (level,) * 4 if isinstance(level, float) else level
    for _ in range(round(seconds * 1e6 / TICK_US)):
        made.boot_us += TICK_US
        made.step(commands, made.boot_us)
    return made


def in_the_air(**config):
    """A few metres up, near a hover."""
    made = run(world(**config), 1.2 * HOVER, 2.0)
    return run(made, HOVER, 1.0)


def upward_m_s2(made, level=HOVER):
    """What the next ticks accelerate it, its drag taken off."""
    run(made, level, 0.02)
    return -(made.state.acceleration_ned_m_s2[2] + made.state.velocity_ned_m_s[2])


@pytest.mark.parametrize("model", ["rigid_body", "paper"])
def test_it_is_lighter_without_its_payload(quiet, model):
    made = in_the_air(sensors=quiet, vehicle={"model": model, "payload_kg": 0.2})
    assert upward_m_s2(made) == pytest.approx(0.0, abs=0.01)
    made.drop_payload()
    # 20 N * 0.4905 on 0.8 kg; the drag per mass grows too
    run(made, HOVER, 0.02)
    velocity, acceleration = made.state.velocity_ned_m_s[2], made.state.acceleration_ned_m_s2[2]
    assert -(acceleration + velocity / 0.8) == pytest.approx(9.81 / 0.8 - 9.81, rel=0.01)
    before = made.state
    made.drop_payload()
    run(made, HOVER, 0.004)
    assert made.state.acceleration_ned_m_s2 == pytest.approx(before.acceleration_ned_m_s2, abs=0.02)


def test_a_payload_that_holds_it_down():
    made = run(world(vehicle={"payload_kg": 0.3}), 0.95 * HOVER, 1.0)
    assert made.state.on_ground
    made.drop_payload()
    assert not run(made, 0.95 * HOVER, 0.1).state.on_ground


@pytest.mark.parametrize("model", ["rigid_body", "paper"])
@pytest.mark.parametrize(
    ("rotor", "turning"),
    [(1, (1, -1, -1)), (2, (-1, 1, -1)), (3, (-1, -1, 1)), (4, (1, 1, 1))],
)
def test_it_turns_towards_a_weak_rotor(model, rotor, turning):
    made = in_the_air(vehicle={"model": model})
    made.weaken_rotor(rotor, 0.8)
    rates = run(made, HOVER, 0.1).state.rates_frd_rad_s
    assert [math.copysign(1, rate) for rate in rates] == list(turning)
    made.weaken_rotor(rotor, 1.0)
    assert run(made, HOVER, 0.1).state.rates_frd_rad_s[:2] == pytest.approx(rates[:2], rel=0.15)


def test_two_weak_rotors():
    made = in_the_air()
    made.weaken_rotor(1, 0.8)
    made.weaken_rotor(2, 0.8)
    assert run(made, HOVER, 0.1).state.rates_frd_rad_s[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert upward_m_s2(made) == pytest.approx(-0.1 * 9.81, rel=0.02)


def test_the_position_jumps_and_stays(quiet):
    made = in_the_air(sensors=quiet)
    n, e, d = made.estimate.position_ned_m
    velocity = made.estimate.velocity_ned_m_s
    assert made.estimate.reset_count == 0
    made.jump_position((1.0, -2.0, 0.5))
    made.jump_position((0.0, 0.0, 0.25))
    run(made, HOVER, 0.004)
    assert made.estimate.position_ned_m == pytest.approx((n + 1.0, e - 2.0, d + 0.75), abs=0.01)
    assert made.estimate.velocity_ned_m_s == pytest.approx(velocity, abs=0.01)
    assert made.estimate.reset_count == 2
    assert made.state.position_ned_m == pytest.approx((n, e, d), abs=0.01)


def test_a_drained_battery_is_seen_and_felt():
    made = in_the_air()
    assert made.estimate.battery == (16.2, 0.0, 1.0)
    made.drain_battery(0.5)
    run(made, HOVER, 0.04)
    assert made.estimate.battery == pytest.approx((15.1, 0.0, 0.5))
    assert upward_m_s2(made) == pytest.approx(9.81 * ((15.1 / 16.2) ** 2 - 1), rel=0.01)


def test_a_battery_sags_in_flight():
    vehicle = {"battery_resistance_ohm": 0.02, "battery_capacity_ah": 2.2, "hover_current_a": 10.0}
    made = world(vehicle=vehicle)
    full = made.estimate.battery
    run(made, 1.1 * HOVER, 10.0)
    flying = made.estimate.battery
    assert flying.current_a == pytest.approx(10.0 * 1.1**1.5, rel=0.01)
    assert flying.remaining == pytest.approx(1 - 10.0 * 1.1**1.5 * 10 / 3600 / 2.2, abs=2e-4)
    assert flying.voltage_v < full.voltage_v - 0.2
    thrust_g = upward_m_s2(made, 1.1 * HOVER) / 9.81 + 1
    assert thrust_g == pytest.approx(1.1 * (flying.voltage_v / 16.2) ** 2, rel=2e-3)


def history(seconds=3.0, seed=1, **config):
    made = world(seed, **config)
    seen = []
    commands = itertools.cycle([(0.51, 0.52, 0.53, 0.54), (0.55, 0.54, 0.53, 0.52)])
    for _ in range(round(seconds * 250)):
        made.boot_us += TICK_US
        made.step(next(commands), made.boot_us)
        e = made.estimate
        seen.append((made.state, e.position_ned_m, e.quaternion, e.rates_frd_rad_s, e.specific_force_frd_m_s2))
    return seen


@pytest.mark.parametrize("config", [{}, LIVELY, {**LIVELY, "gusts_model": "dryden"}], ids=["calm", "ou", "dryden"])
def test_the_same_seed_gives_the_same_world(config):
    assert history(**config) == history(**config)
    assert history(**config) != history(seed=2, **config)


def test_nobody_changes_the_world_by_looking():
    looked, unlooked = world(**LIVELY), world(**LIVELY)
    for _ in range(500):
        run(looked, 0.51, 0.004)
        _ = looked.estimate.euler_rad, looked.estimate.position_ned_m
        run(unlooked, 0.51, 0.004)
    assert looked.state == unlooked.state
    assert looked.estimate == unlooked.estimate


def test_a_heading_on_the_ground(quiet):
    made = run(world(sensors=quiet, vehicle={"heading_deg": 90.0}), 0.0, 0.1)
    assert made.estimate.euler_rad == pytest.approx((0.0, 0.0, math.pi / 2))
    assert made.estimate.specific_force_frd_m_s2 == pytest.approx((0.0, 0.0, -9.81))


@pytest.mark.parametrize("vehicle", [{"frame": "plus"}, {"thrust_curve": 0.3}, {"motor_time_constant_s": 0.0}], ids=str)
def test_px4_flies_it(pilot, vehicle):
    p = pilot(vehicle=vehicle).hover()
    p.run(5.0)
    assert p.truth.position_ned_m == pytest.approx((0.0, 0.0, -2.5), abs=0.3)
