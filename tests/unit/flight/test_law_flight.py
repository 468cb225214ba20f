"""The hand-over: what the observer knows when the law takes control."""

import math

import pytest

from mavquad.control.model import GRAVITY_M_S2
from mavquad.control.params import LawParams
from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.law_flight import WATCHED_US, LawFlight
from mavquad.flight.mission import MissionParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Attitude, AttitudeTarget, Position

STEP_US = 10_000
WIND_M_S2 = 1.0
HOVER = 0.5


def blown(depth, watched_s, seconds=2.0):
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
    """It leans and speeds up by its own command: no wind is seen."""
    airframe, params = AirframeParams(hover_thrust_norm=HOVER), LawParams(friction_1_s=0.0)
    law = LawFlight(params, airframe, MissionParams(), StreamParams(), HoverThrust(airframe))
    law.choose(params, depth)
    lean_rad, thrust = 0.1, HOVER / math.cos(0.1)
    push_m_s2 = GRAVITY_M_S2 * math.tan(lean_rad)
    for k in range(200):
        stamp_us, t = 1_000_000 + k * STEP_US, k * STEP_US * 1e-6
        attitude = Attitude(stamp_us, 0.0, lean_rad, 0.0, (0.0, 0.0, 0.0))
        position = Position(stamp_us, (0.5 * push_m_s2 * t * t, 0.0, 5.0), (push_m_s2 * t, 0.0, 0.0))
        if k % 10 == 0:
            law.watch(AttitudeTarget(stamp_us, (0.0, lean_rad, 0.0), (0.0, 0.0, 0.0), thrust), position, attitude)
        law.take_attitude(attitude)
        law.take_position(position)
    row = law.step(position, attitude, 0, "engaging")
    assert row.wind == pytest.approx((0.0, 0.0, 0.0), abs=0.05)


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_commands_that_do_not_act_are_not_told_to_the_observer(depth):
    law, position, attitude = blown(depth, 2.0)
    rows = [law.step(position, attitude, 0, "engaging") for _ in range(20)]
    assert rows[0].controls == rows[-1].controls
    assert rows[0].zeta_hat == rows[-1].zeta_hat
