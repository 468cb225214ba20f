"""The hover thrust: learned while the autopilot hovers, level or tilted."""

from __future__ import annotations

import math

import pytest

from mavquad.flight.airframe import AirframeParams, HoverThrust
from mavquad.types import Attitude


def attitude(roll_deg=0.0, pitch_deg=0.0):
    return Attitude(0, math.radians(roll_deg), math.radians(pitch_deg), 0.4, (0.0, 0.0, 0.0))


def test_nothing_known():
    assert HoverThrust(AirframeParams()).norm == 0.5


def test_the_vehicles_parameter_before_anything_is_learned():
    hover = HoverThrust(AirframeParams())
    hover.from_parameter = 0.42
    assert hover.norm == 0.42
    hover.learn(0.6, attitude())
    assert hover.norm == pytest.approx(0.6)


def test_the_configured_figure_is_above_all():
    hover = HoverThrust(AirframeParams(hover_thrust_norm=0.37))
    hover.from_parameter = 0.42
    hover.learn(0.6, attitude())
    assert hover.norm == 0.37


def test_the_mean_of_what_was_seen():
    hover = HoverThrust(AirframeParams())
    for thrust in (0.4, 0.5, 0.9):
        hover.learn(thrust, attitude())
    assert hover.norm == pytest.approx(0.6)


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
