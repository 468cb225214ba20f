"""The default law flown at each depth: SIH's vehicle with plain inner loops, noisy pose, delay, lag, wind."""

from __future__ import annotations

import math

import pytest

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Depth, ReferencePoint
from tests.unit.control.ideal import quiet
from tests.unit.control.plant import Link, Vehicle, fly

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
QUIET = quiet(100.0, 0.025)
HOVER = hold(Pose((0.0, 0.0, 0.0), 0.0))
STRONG_WIND = (5.7, -5.7, 0.0)

every_depth = pytest.mark.parametrize("depth", DEPTHS)


def _wave(size: float, rate: float, time_s: float) -> tuple[float, ...]:
    return tuple(size * rate**k * math.sin(rate * time_s + 0.5 * k * math.pi) for k in range(5))


def eight(time_s: float) -> ReferencePoint:
    """x = 1.25 sin t, z = 0.75 sin 2t."""
    still = (0.0,) * 5
    return ReferencePoint(_wave(0.75, 2.0, time_s), still, _wave(1.25, 1.0, time_s), still)


@pytest.mark.parametrize(
    ("depth", "hover_m", "eight_m"), [("torque", 0.035, 0.045), ("rate", 0.030, 0.032), ("attitude", 0.030, 0.045)]
)
def test_hover_and_figure_eight(depth: Depth, hover_m: float, eight_m: float) -> None:
    hover = fly(LawParams(), lambda _: HOVER, 12.0, depth=depth)
    assert hover.rms_m(5.0) < hover_m
    assert hover.yaw_rms(5.0) < math.radians(1.0)
    assert fly(LawParams(), eight, 12.0, depth=depth).rms_m(5.0) < eight_m


@pytest.mark.parametrize(("depth", "most_m"), [("torque", 0.022), ("rate", 0.008), ("attitude", 0.040)])
def test_figure_eight_without_noise(depth: Depth, most_m: float) -> None:
    assert fly(LawParams(), eight, 12.0, depth=depth, link=QUIET).rms_m(5.0) < most_m


@every_depth
@pytest.mark.parametrize(
    ("yaw", "mass_kg", "known"),
    [(0.0, 1.0, True), (2.0, 0.7, True), (-2.5, 1.3, True), (-2.5, 0.7, False), (2.0, 1.3, False)],
)
def test_recovers_from_eight_metres_off_in_strong_wind(depth: Depth, yaw: float, mass_kg: float, known: bool) -> None:
    """8 m/s of wind lean the vehicle by 40 degrees; `known` is whether the hover thrust was learned for this mass."""
    hover_control = 0.4905 * (mass_kg if known else 1.0)
    params = LawParams()
    most = min(params.limits.thrust_max_g, 0.9 / hover_control)
    params = params.model_copy(update={"limits": params.limits.model_copy(update={"thrust_max_g": most})})
    holding = 9.81 * math.hypot(1.0, math.hypot(*STRONG_WIND) / 9.81 / mass_kg) * (1.0 if known else mass_kg)
    goal = hold(Pose((8.0, -3.0, 2.0), yaw))
    flight = fly(
        params, lambda _: goal, 13.0, depth=depth, vehicle=Vehicle(mass_kg=mass_kg, hover_control=hover_control),
        wind=STRONG_WIND, start_yaw=yaw, trim_m_s2=holding,
    )  # fmt: skip
    assert not flight.crashed
    assert flight.max_m(11.5) < (0.10 if known else 0.15)
    assert max(flight.tilt) < math.radians(60.0)


@pytest.mark.parametrize("measurements", ["full", "position_attitude"])
def test_torque_with_lag_and_delay(measurements: str) -> None:
    """Rotors of 50 ms, 100 Hz, 30 ms of delay, of which the law knows 25."""
    params = LawParams(measurements=measurements)
    conditions = {"vehicle": Vehicle(rotor_lag_s=0.05), "link": Link(rate_hz=100.0, delay_s=0.030)}
    assert fly(params, lambda _: HOVER, 10.0, **conditions).rms_m(5.0) < 0.035
    assert fly(params, eight, 10.0, **conditions).rms_m(5.0) < 0.060


@every_depth
def test_a_steady_wind_leaves_no_offset(depth: Depth) -> None:
    """The law begins at rest in calm: a wind that nobody held is found, and so is a mass that nobody told of."""
    for conditions in ({"wind": (4.0, -2.0, 0.5), "trim_m_s2": 9.81}, {"vehicle": Vehicle(mass_kg=1.2)}):
        flight = fly(LawParams(), lambda _: HOVER, 13.0, depth=depth, link=QUIET, **conditions)
        assert not flight.crashed
        assert flight.max_m(12.0) < 2e-3


@every_depth
@pytest.mark.parametrize("measurements", ["position_attitude", "full"])
def test_attitudes_at_200_hz_and_positions_at_50(depth: Depth, measurements: str) -> None:
    link = Link(rate_hz=200.0, attitude_per_position=4)
    params = LawParams(measurements=measurements)
    assert fly(params, lambda _: HOVER, 9.0, depth=depth, link=link).rms_m(4.0) < 0.045
    quiet_link = Link(200.0, 4, white_m=0.0, wander_m=0.0, yaw_white_rad=0.0, rate_white_rad_s=0.0)
    assert fly(params, eight, 9.0, depth=depth, link=quiet_link).rms_m(4.0) < 0.080


@every_depth
def test_a_gap_is_survived_at_every_depth(depth: Depth) -> None:
    flight = fly(LawParams(), lambda _: HOVER, 10.0, depth=depth, blackout_s=(3.0, 3.3), wind=(2.1, -2.1, 0.0))
    assert not flight.crashed
    assert flight.max_m(8.0) < 0.12


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_a_gap_of_two_seconds_is_survived_where_the_vehicle_holds_itself(depth: Depth) -> None:
    """It drifts, with the last rate or attitude held; then the law brings it back."""
    flight = fly(LawParams(), lambda _: HOVER, 12.0, depth=depth, blackout_s=(3.0, 5.0), link=QUIET)
    assert not flight.crashed
    assert flight.max_m(11.0) < 0.01


@every_depth
@pytest.mark.parametrize("turn_deg", [90.0, -170.0])
def test_a_turn_on_the_spot(depth: Depth, turn_deg: float) -> None:
    goal = hold(Pose((0.0, 0.0, 0.0), math.radians(turn_deg)))
    duration_s = 16.0 if depth == "attitude" else 10.0  # the autopilot's own yaw loop is slow, and limited in rate
    flight = fly(LawParams(), lambda _: goal, duration_s, depth=depth, link=QUIET, wind=(2.0, 0.0, 0.0))
    assert flight.max_m(1.0) < 0.05
    assert abs(flight.yaw_error[-1]) < math.radians(2.0)


def test_a_padded_yaw_is_flyable_on_rotors_without_lag() -> None:
    """The paper's yaw chain of length 4, on the vehicle that the paper has in mind."""
    params = LawParams(depth="torque", measurements="position_yaw", decoupling="constant", yaw_padding=2, lag_s=0.0,
                       yaw_lag_s=0.0, thrust_lag_s=0.0, delay_s=0.0)  # fmt: skip
    goal = hold(Pose((0.3, -0.2, 0.1), 0.3))
    flight = fly(params, lambda _: goal, 14.0, vehicle=Vehicle(rotor_lag_s=0.0), link=quiet(100.0))
    assert flight.max_m(12.0) < 0.01
    assert max(map(abs, flight.yaw_error[-200:])) < math.radians(0.5)


@every_depth
def test_the_same_seed_is_the_same_flight(depth: Depth) -> None:
    one, two = (fly(LawParams(), eight, 2.0, depth=depth, seed=4) for _ in range(2))
    assert one.truth == two.truth
    assert one.commands == two.commands
