"""The hand-over: what the observer knows when the law takes control."""

import math

import pytest

from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.law_flight import WATCHED_US, LawFlight
from mavquad.flight.mission import MissionParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Attitude, AttitudeTarget, Position

STEP_US = 10_000
WIND_M_S2 = 1.0
HOVER = 0.5


def blown(depth, watched_s, seconds=2.0, steps=False):
    """A level vehicle that the wind pushes north, by the autopilot's command not to lean; watched for the first seconds."""
    airframe = AirframeParams(hover_thrust_norm=HOVER)
    params = LawParams(friction_1_s=0.0)
    law = LawFlight(params, airframe, MissionParams(), StreamParams(), HoverThrust(airframe))
    law.choose(params, depth)
    for k in range(round(seconds / (STEP_US * 1e-6))):
        stamp_us, t = 1_000_000 + k * STEP_US, k * STEP_US * 1e-6
        attitude = Attitude(stamp_us, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
        position = Position(stamp_us, (0.5 * WIND_M_S2 * t * t, 0.0, 5.0), (WIND_M_S2 * t, 0.0, 0.0))
        if k % 10 == 0 and t <= watched_s:
            law.watch(AttitudeTarget(stamp_us, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), HOVER), position, attitude)
        law.take_attitude(attitude)
        law.take_position(position)
        if steps:
            law.step(position, attitude, 0, "engaging")
    return law, position, attitude


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_the_observer_knows_the_wind_at_the_hand_over_where_it_watched(depth):
    law, position, attitude = blown(depth, 2.0)
    waiting = law.step(position, attitude, 0, "engaging")
    law.in_control = True
    begun = law.step(position, attitude, 0, "flying")
    for row in (waiting, begun):
        assert row.wind[0] == pytest.approx(WIND_M_S2, abs=0.05)
        assert row.zeta_hat[2][1] == pytest.approx(2.0 * WIND_M_S2, abs=0.05)
    assert begun.reference[2] == begun.measured[2]
    assert not law.watches


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_where_nothing_was_shown_for_long_it_starts_afresh(depth):
    seconds = WATCHED_US * 1e-6 + 0.5
    law, position, attitude = blown(depth, 0.2, seconds + 0.2)
    row = law.step(position, attitude, 0, "engaging")
    assert row.wind[0] == pytest.approx(0.0, abs=1e-6)
    assert not law.watches


def test_at_depth_torque_it_starts_afresh():
    law, position, attitude = blown("torque", 2.0)
    assert not law.watches
    assert law.step(position, attitude, 0, "engaging").wind[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_what_the_autopilot_commands_is_no_disturbance(depth):
    """It begins to lean by its own command, at 0.2 rad/s: the observer knows why."""
    airframe, params = AirframeParams(hover_thrust_norm=HOVER), LawParams(friction_1_s=0.0)
    law = LawFlight(params, airframe, MissionParams(), StreamParams(), HoverThrust(airframe))
    law.choose(params, depth)
    tune = tuning(params, depth).horizontal.spec
    ahead_s = tune.dead_us * 1e-6 + tune.lag_s
    speed = place = 0.0
    for k in range(150):
        stamp_us, t = 1_000_000 + k * STEP_US, k * STEP_US * 1e-6
        lean_rad, rate = leaning(t)
        push_m_s2 = GRAVITY_M_S2 * math.tan(lean_rad)
        place, speed = place + speed * 0.01 + push_m_s2 * 5e-5, speed + push_m_s2 * 0.01
        attitude = Attitude(stamp_us, 0.0, lean_rad, 0.0, (0.0, rate, 0.0))
        position = Position(stamp_us, (place, 0.0, 5.0), (speed, 0.0, 0.0))
        if k % 2 == 0:
            angle_rad, turning = leaning(t + ahead_s)
            thrust = HOVER / math.cos(angle_rad)
            target = AttitudeTarget(stamp_us, (0.0, angle_rad, 0.0), (0.0, turning, 0.0), thrust)
            law.watch(target, position, attitude)
        law.take_attitude(attitude)
        law.take_position(position)
    row = law.step(position, attitude, 0, "engaging")
    assert row.sigma[2] == pytest.approx(0.0, abs=0.3)  # of the 2 m/s^3, or m/s^2, that were commanded


def leaning(t):
    """Pitch and its rate: level for half a second, then on and on."""
    return (0.0, 0.0) if t < 0.5 else (0.2 * (t - 0.5), 0.2)


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_commands_that_do_not_act_are_not_told_to_the_observer(depth):
    (law, position, attitude), (other, _, _) = blown(depth, 2.0), blown(depth, 2.0, steps=True)
    row, stepped = (each.step(position, attitude, 0, "engaging") for each in (law, other))
    assert max(map(abs, row.controls[:3])) > 0.1  # it would brake
    assert row == stepped
