"""What acted, taken from what moved; and a controller that is told so."""

from __future__ import annotations

import math

import pytest

from mavquad.analysis.open_loop import Acted, Motion, OpenLoop
from mavquad.control.controller import Controller
from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.types import Attitude, Position, ReferencePoint

LAW = LawParams()
HERE = ReferencePoint((0.0,) * 5, (0.0,) * 5, (0.0,) * 5, (0.0,) * 5)


def rolling(t_us, roll=0.0, pitch=0.0, yaw=0.0, rates=(0.0, 0.0, 0.0)):
    return Attitude(t_us, roll, pitch, yaw, rates)


def test_at_depth_attitude_the_angles_come_a_dead_time_and_a_lag_later():
    tune = tuning(LAW, "attitude")
    spec = tune.horizontal.spec
    later_us = spec.dead_us + round(spec.lag_s * 1e6)
    motion = Motion([rolling(0, 0.0, 0.4), rolling(later_us * 2, 0.2, 0.0)], [])
    acted = motion.acted(tune, 0)
    assert acted.inputs[2:] == pytest.approx((0.1, 0.2))
    cosines = math.cos(0.0) * math.cos(0.4)  # of the tilt when the command arrives
    assert acted.inputs[0] == pytest.approx(GRAVITY_M_S2 / cosines)


@pytest.mark.parametrize(("depth", "wanted"), [("rate", (0.5, -1.0)), ("torque", (2.0, -4.0))])
def test_rates_and_their_slopes(depth, wanted):
    tune = tuning(LAW, depth)
    spec = tune.horizontal.spec
    at_us = 1_000_000 - spec.dead_us - round(spec.lag_s * 1e6)
    moves = [rolling(750_000), rolling(1_250_000, rates=(1.0, -2.0, 0.0))]
    assert Motion(moves, []).acted(tune, at_us).inputs[2:] == pytest.approx(wanted)


def test_yaw_goes_the_short_way_round_and_its_rate_is_that_of_the_angle():
    tune = tuning(LAW, "attitude")
    spec = tune.yaw.spec
    at_us = 500_000 - spec.dead_us - round(spec.lag_s * 1e6)
    lying = {"roll": math.pi / 2, "rates": (0.0, 0.6, 9.0)}  # on its side it is pitching that turns the heading
    acted = Motion([rolling(0, yaw=3.1, **lying), rolling(1_000_000, yaw=-3.1, **lying)], []).acted(tune, at_us)
    assert acted.yaw_rad == pytest.approx(math.pi)
    assert acted.inputs[1] == pytest.approx(0.6)


def test_thrust_lies_on_lines_between_commands_and_stays_beyond_them():
    tune = tuning(LAW, "rate")
    motion = Motion([rolling(0)], [(1_000_000, 9.0), (2_000_000, 11.0)])
    assert motion.acted(tune, 1_500_000).thrust == pytest.approx((10.0, 2.0))
    assert motion.acted(tune, 1_500_000).inputs[0] == pytest.approx(2.0)
    assert motion.acted(tune, 0).thrust == (9.0, 0.0)
    assert motion.acted(tune, 3_000_000).thrust == (11.0, 0.0)


def step(controller, k, x=0.3):
    now_us = k * 10_000
    controller.observe_attitude(Attitude(now_us, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)))
    controller.observe_position(Position(now_us, (x, 0.0, 0.0), (0.0, 0.0, 0.0)))
    return controller.command(lambda _: HERE)


def begun(kind, depth):
    return kind(LAW, depth, Position(0, (0.3, 0.0, 0.0), (0.0,) * 3), rolling(0), GRAVITY_M_S2)


@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
def test_told_that_its_own_commands_acted_it_is_the_controller(depth):
    plain, told = begun(Controller, depth), begun(OpenLoop, depth)
    for k in range(1, 60):
        assert step(plain, k) == step(told, k)
        told.instead(Acted(told.trace.inputs))
    assert plain.trace == told.trace


@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
def test_a_vehicle_held_by_somebody_else_does_not_wind_it_up(depth):
    """It stands still 0.3 m off: the answer must not grow, as that of a law that believes in its own commands does."""
    motion = Motion([rolling(0), rolling(10_000_000)], [])
    told, alone = begun(OpenLoop, depth), begun(Controller, depth)
    answers, grown = [], []
    for k in range(1, 400):
        step(told, k), step(alone, k)
        told.instead(motion.acted(tuning(LAW, depth), told.arrives_us))
        answers.append(told.trace.inputs[3])
        grown.append(alone.trace.inputs[3])
    assert answers[-1] == pytest.approx(answers[150], rel=1e-3)
    assert answers[-1] < -0.01  # towards the reference: nose up, southwards
    assert abs(grown[-1]) > 3.0 * abs(answers[-1])
