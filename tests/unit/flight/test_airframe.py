"""The hover thrust: learned while the autopilot hovers, level or tilted."""

from __future__ import annotations

import math

import pytest

from mavquad.control.params import LawParams
from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.flight.law_flight import within_controls
from mavquad.types import Attitude


def attitude(roll_deg=0.0, pitch_deg=0.0):
    return Attitude(0, math.radians(roll_deg), math.radians(pitch_deg), 0.4, (0.0, 0.0, 0.0))


def test_nothing_known():
    assert HoverThrust(AirframeParams()).norm == 0.5


def test_a_few_samples_make_it_known():
    hover = HoverThrust(AirframeParams())
    for count in range(5):
        assert not hover.known, count
        hover.learn(0.6, attitude())
    assert hover.known
    assert HoverThrust(AirframeParams(hover_thrust_norm=0.4)).known


@pytest.mark.parametrize("thrust", [math.nan, math.inf, -0.2, 0.0, 0.01, 0.99, 1.0])
def test_what_no_hover_takes_is_not_learned(thrust):
    hover = HoverThrust(AirframeParams())
    for _ in range(9):
        hover.learn(thrust, attitude())
    assert not hover.known


def test_the_configured_figure_is_above_all():
    hover = HoverThrust(AirframeParams(hover_thrust_norm=0.37))
    hover.learn(0.6, attitude())
    assert hover.norm == 0.37


def test_the_mean_of_what_was_seen():
    hover = HoverThrust(AirframeParams())
    for thrust in (0.4, 0.5, 0.9):
        hover.learn(thrust, attitude())
    assert hover.norm == pytest.approx(0.6)


def test_the_latest_count_most():
    """A second of braking, then a second of hover, at 10 Hz: each 0.1 s keeps 0.4 / (0.4 + 0.1) of what was before."""
    hover = HoverThrust(AirframeParams())
    for tick in range(20):
        hover.learn(0.4 if tick < 10 else 0.5, attitude()._replace(stamp_us=100_000 * tick))
    assert hover.norm == pytest.approx(0.5 - 0.1 * 0.8**10)


@pytest.mark.parametrize(("roll_deg", "pitch_deg", "level"), [(60.0, 0.0, 0.4), (0.0, -60.0, 0.4), (30.0, 30.0, 0.6)])
def test_a_tilted_hover_takes_more_thrust_than_a_level_one(roll_deg, pitch_deg, level):
    hover = HoverThrust(AirframeParams())
    hover.learn(0.8, attitude(roll_deg, pitch_deg))
    assert hover.norm == pytest.approx(level)


@pytest.mark.parametrize("thrust", [math.nan, math.inf, 0.0, -0.3])
def test_nonsense_is_not_learned(thrust):
    hover = HoverThrust(AirframeParams())
    hover.learn(0.6, attitude())
    hover.learn(thrust, attitude())
    assert hover.norm == pytest.approx(0.6)


def test_restart_forgets():
    hover = HoverThrust(AirframeParams())
    hover.learn(0.6, attitude())
    hover.restart()
    assert hover.norm == 0.5
    hover.learn(0.3, attitude())
    assert hover.norm == pytest.approx(0.3)


def test_the_law_is_told_what_the_controls_cannot_say():
    airframe = AirframeParams(torque_scale_frd_rad_s2=(20.0, 113.0, 1.5))
    law = within_controls(LawParams(), airframe, hover_thrust_norm=0.6)
    assert law.limits.thrust_max_g == pytest.approx(0.9 / 0.6)
    assert law.saturation.roll_pitch_rad_s2 == 20.0
    assert law.limits.yaw_acceleration_max_deg_s2 == pytest.approx(math.degrees(1.5))
    assert within_controls(LawParams(), AirframeParams(), 0.44) == LawParams()


@pytest.mark.parametrize("scale", [(20.0, 113.0, 13.3), (113.0, 20.0, 13.3)])
def test_the_weaker_of_roll_and_pitch_bounds_both(scale):
    law = within_controls(LawParams(), AirframeParams(torque_scale_frd_rad_s2=scale), 0.44)
    assert law.saturation.roll_pitch_rad_s2 == 20.0


@pytest.mark.parametrize(
    ("hover_thrust_norm", "thrust_max_g"),
    [(0.3, 2.0), (0.45, 2.0), (0.5, 1.8), (0.75, 1.2), (0.86, 1.05), (0.95, 1.05)],
)
def test_the_greatest_thrust_leaves_a_tenth_to_turn_with_and_is_never_less_than_the_hover(
    hover_thrust_norm, thrust_max_g
):
    law = within_controls(LawParams(), AirframeParams(), hover_thrust_norm)
    assert law.limits.thrust_max_g == pytest.approx(thrust_max_g)


def test_the_laws_own_limits_stand_where_they_are_narrower():
    own = LawParams.model_validate(
        {
            "saturation": {"roll_pitch_rad_s2": 3.0},
            "limits": {"thrust_max_g": 1.1, "yaw_acceleration_max_deg_s2": 20.0},
        }
    )
    airframe = AirframeParams(torque_scale_frd_rad_s2=(20.0, 113.0, 1.5))
    assert within_controls(own, airframe, 0.6) == own
