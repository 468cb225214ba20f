"""Recovery of the performance of state feedback (Freidovich and Khalil, 2008), which the paper's stability rests on."""

from __future__ import annotations

import math

import pytest

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Depth
from tests.unit.control.ideal import distances_m, output_feedback, quiet, state_feedback
from tests.unit.control.plant import Vehicle, fly

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")


@pytest.mark.parametrize("depth", DEPTHS)
def test_output_feedback_recovers_the_state_feedback_as_kappa_grows(depth: Depth) -> None:
    """What is unknown to it, friction and the true input gain, is found faster: the distance goes with 1 / kappa."""
    link = quiet(200.0)
    yardstick = state_feedback(depth, link)
    gaps = [max(distances_m(output_feedback(depth, link, kappa), yardstick)) for kappa in (4.0, 8.0, 16.0, 32.0)]
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[2] < 0.3 * gaps[0]
    assert gaps[-1] < 0.15 * gaps[0]
    assert gaps[-1] < 0.05


@pytest.mark.parametrize(
    ("depth", "axis"),
    [
        ("torque", 0),
        ("torque", 1),
        ("torque", 2),
        *((depth, axis) for depth in ("rate", "attitude") for axis in range(3)),
    ],
)
def test_the_yardstick_itself_settles_as_its_polynomial_says(depth: Depth, axis: int) -> None:
    """State feedback that knows everything makes the error linear: a step is answered with r poles at -2 rad/s."""
    flight, goal = state_feedback(depth, quiet(200.0)), (1.5, -0.9, 0.6)[axis]
    length = {"torque": 4, "rate": 3, "attitude": 2}[depth]
    for time_s, where in zip(flight.time_s, flight.truth, strict=True):
        assert where[axis] == pytest.approx(goal * _step_response(length, 2.0, time_s), abs=0.03 * abs(goal))


def _step_response(order: int, omega0: float, time_s: float) -> float:
    """Of omega0^r / (s + omega0)^r."""
    x = omega0 * time_s
    return 1.0 - math.exp(-x) * sum(x**k / math.factorial(k) for k in range(order))


@pytest.mark.parametrize("thrust_lag_s", [0.05, 0.005])
@pytest.mark.parametrize("form", ["state_feedback", "output_feedback"])
def test_a_thrust_of_little_lag_is_held(form: str, thrust_lag_s: float) -> None:
    assert _height_off_m(form, thrust_lag_s) < 0.002


@pytest.mark.parametrize("form", ["state_feedback", "output_feedback"])
def test_a_thrust_without_lag_is_held(form: str) -> None:
    assert _height_off_m(form, 0.0) < 0.002


def _height_off_m(form: str, thrust_lag_s: float) -> float:
    """After a step of 2 cm, in the set full, on rotors without lag."""
    vehicle = Vehicle(rotor_lag_s=0.0, drag_n_s_m=0.0, angular_drag=0.0)
    settings = {"lag_s": 0.0, "delay_s": 0.0, "friction_1_s": 0.0, "angular_friction_1_s": 0.0}
    params = LawParams(form=form, thrust_lag_s=thrust_lag_s, omega0_rad_s=2.0, **settings)
    goal = hold(Pose((0.0, 0.0, 0.02), 0.0))
    return fly(params, lambda _: goal, 10.0, vehicle=vehicle, link=quiet(200.0)).max_m(6.0)
