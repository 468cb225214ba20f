"""The default law in closed loop with the plant of these tests: SIH's vehicle, noisy pose, 25 ms of delay, 50 ms of lag."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, ReferenceParams, end_us, hold, plan_leg, sample
from mavquad.types import ReferencePoint
from tests.unit.control.plant import Flight, Link, Vehicle, fly

QUIET = Link(white_m=0.0, wander_m=0.0, yaw_white_rad=0.0, rate_white_rad_s=0.0)
HOVER = hold(Pose((0.0, 0.0, 0.0), 0.0))
DIAGONAL_WIND = (2.1, -2.1, 0.0)


def box() -> tuple[Callable[[float], ReferencePoint], float]:
    """5 s of hover, a 2 m box with a quarter turn in one of its corners, half a second of hold after each leg."""
    quarter = math.pi / 2
    poses = [
        Pose((0.0, 0.0, 0.0), 0.0),
        Pose((2.0, 0.0, 0.0), 0.0),
        Pose((2.0, 2.0, 0.0), 0.0),
        Pose((2.0, 2.0, 0.0), quarter),
        Pose((0.0, 2.0, 0.0), quarter),
        Pose((0.0, 0.0, 0.0), quarter),
    ]
    legs, start_us = [], 5_000_000
    for origin, goal in itertools.pairwise(poses):
        legs.append(plan_leg(ReferenceParams(), start_us, origin, goal))
        start_us = end_us(legs[-1]) + 500_000

    def reference(time_s: float) -> ReferencePoint:
        stamp_us = round(time_s * 1e6)
        begun = [leg for leg in legs if leg.start_us <= stamp_us]
        return sample(begun[-1] if begun else legs[0], stamp_us)

    return reference, start_us * 1e-6 + 2.0


def _box_flight(**conditions: object) -> Flight:
    reference, duration_s = box()
    return fly(LawParams(), reference, duration_s, **conditions)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_hover_is_quiet(seed: int) -> None:
    flight = fly(LawParams(), lambda _: HOVER, 18.0, seed=seed)
    assert flight.rms_m(5.0) < 0.030
    assert flight.max_m(5.0) < 0.07
    assert flight.yaw_rms(5.0) < math.radians(0.1)


@pytest.mark.parametrize("seed", [1, 2])
def test_box_in_calm(seed: int) -> None:
    flight = _box_flight(seed=seed)
    assert flight.rms_m(5.0) < 0.035
    assert flight.max_m(5.0) < 0.08


@pytest.mark.parametrize(
    "conditions",
    [
        {},
        {"link": Link(delay_s=0.035, loss=0.02), "vehicle": Vehicle(rotor_lag_s=0.065)},
        {"link": Link(delay_s=0.015, loss=0.02), "vehicle": Vehicle(rotor_lag_s=0.035)},
        {"vehicle": Vehicle(mass_kg=1.15, inertia=(0.029, 0.029, 0.0345))},
        {"vehicle": Vehicle(mass_kg=0.85, inertia=(0.021, 0.021, 0.0255))},
        {"link": Link(rate_hz=50.0)},
        {"link": Link(white_m=0.006)},
    ],
)
def test_box_in_wind_with_what_the_law_does_not_know(conditions: dict) -> None:
    flight = _box_flight(wind=DIAGONAL_WIND, seed=7, **conditions)
    assert not flight.crashed
    assert flight.rms_m(5.0) < 0.045
    assert flight.max_m(5.0) < 0.12
    assert flight.error_m[-1] == pytest.approx((0.0, 0.0, 0.0), abs=0.05)


def test_no_offset_remains_in_wind_or_with_a_wrong_mass() -> None:
    for conditions in ({"wind": (3.0, 0.0, 0.5)}, {"vehicle": Vehicle(mass_kg=1.15)}):
        flight = fly(LawParams(), lambda _: HOVER, 16.0, link=QUIET, **conditions)
        assert flight.max_m(12.0) < 1e-3


@pytest.mark.parametrize(("link", "end_m"), [(QUIET, 1e-6), (Link(), 0.08)])
def test_a_gap_in_the_measurements_is_survived(link: Link, end_m: float) -> None:
    """For 0.3 s the vehicle goes on with the last, noisy, torque; then the observer predicts over the whole gap."""
    flight = fly(LawParams(), lambda _: HOVER, 22.0, blackout_s=(8.0, 8.3), wind=DIAGONAL_WIND, link=link)
    assert not flight.crashed
    assert flight.max_m(18.0) < end_m


def test_attitudes_that_come_later_or_earlier_than_positions() -> None:
    flight = fly(LawParams(), lambda _: HOVER, 12.0, link=Link(attitude_offset_us=5_000))
    assert flight.max_m(5.0) < 0.08


def test_turning_for_ever_keeps_the_place() -> None:
    rate = 0.8

    def turning(time_s: float) -> ReferencePoint:
        still = (0.0,) * 5
        ramp = max(time_s - 2.0, 0.0)
        yaw = rate * ramp * ramp / (ramp + 2.0)
        slope = rate * ramp * (ramp + 4.0) / (ramp + 2.0) ** 2
        return ReferencePoint(still, (yaw, slope, 0.0, 0.0, 0.0), still, still)

    flight = fly(LawParams(), turning, 40.0, link=QUIET)
    assert flight.max_m(5.0) < 0.05
    assert abs(flight.yaw_error[-1]) < 0.05


def test_state_feedback_flies_the_box_in_calm() -> None:
    reference, duration_s = box()
    flight = fly(LawParams(form="state_feedback"), reference, duration_s, link=QUIET)
    assert flight.max_m(5.0) < 0.01
