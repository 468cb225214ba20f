"""The mixer against SERVO_OUTPUT_RAW recorded from PX4 1.13.3 (1000 + 1000 u), and its saturation."""

import math

import pytest

from sitl_mock.mixer import mix
from sitl_mock.plant import VehicleParams, VehicleState
from sitl_mock.quadcopter import RigidBody


@pytest.mark.parametrize(
    ("controls", "recorded"),
    [
        ((0.0, 0.0, 0.0, 0.3), [1300, 1300, 1300, 1300]),
        ((0.1, 0.0, 0.0, 0.3), [1229, 1370, 1370, 1229]),
        ((0.0, 0.1, 0.0, 0.3), [1370, 1229, 1370, 1229]),
        ((0.0, 0.0, 0.1, 0.3), [1400, 1400, 1200, 1200]),
    ],
)
def test_recorded_servo_outputs(controls, recorded):
    assert [1000 + 1000 * u for u in mix(*controls)] == pytest.approx(recorded, abs=1.0)


def test_thrust_gives_way_to_roll():
    u = mix(0.3, 0.0, 0.0, 1.0)
    assert max(u) == pytest.approx(1.0)
    assert u[1] - u[0] == pytest.approx(2 * 0.707107 * 0.3)


def test_no_thrust_is_added_for_roll():
    u = mix(0.3, 0.0, 0.0, 0.0)
    assert u == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=0.11)
    assert sum(u) < 0.25


def test_yaw_gives_way_before_thrust():
    u = mix(0.0, 0.0, 1.0, 0.5)
    assert u == pytest.approx((1.0, 1.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("controls", "expected"),
    [
        ((0.1, 0.0, 0.0, 0.3), (0.2, 0.4, 0.3, 0.3)),  # left up: rolls right
        ((0.0, 0.1, 0.0, 0.3), (0.3, 0.3, 0.4, 0.2)),  # front up: nose up
        ((0.0, 0.0, 0.1, 0.3), (0.4, 0.4, 0.2, 0.2)),  # right and left up: nose right
        ((0.03, 0.02, 0.01, 0.3), (0.28, 0.34, 0.31, 0.27)),
        ((0.3, 0.0, 0.0, 0.9), (0.4, 1.0, 0.7, 0.7)),  # thrust gives way
    ],
)
def test_plus(controls, expected):
    assert mix(*controls, "plus") == pytest.approx(expected)


@pytest.mark.parametrize("frame", ["x", "plus"])
def test_what_the_mixer_asks_for_is_what_the_vehicle_does(frame):
    """Roll, pitch and yaw torque together, at a hover: each turns its own axis, in proportion."""
    params = VehicleParams(frame=frame)
    hover = params.hover_thrust_norm
    start = VehicleState((0.0, 0.0, -50.0), motors=(hover,) * 4, on_ground=False)

    def turning(*torque):
        body = RigidBody(params, start)
        body.step(mix(*torque, hover, frame), (0.0, 0.0, 0.0))
        return body.state.rates_frd_rad_s

    together = turning(0.02, -0.05, 0.03)
    alone = [turning(0.02, 0.0, 0.0)[0], turning(0.0, -0.05, 0.0)[1], turning(0.0, 0.0, 0.03)[2]]
    assert together == pytest.approx(alone, rel=1e-3)
    assert [math.copysign(1, rate) for rate in together] == [1, -1, 1]
    assert together[1] == pytest.approx(-2.5 * together[0], rel=1e-3)


@pytest.mark.parametrize("frame", ["x", "plus"])
@pytest.mark.parametrize("thrust", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("torque", [(1.0, 0.0, 0.0), (1.0, -1.0, 1.0), (-0.4, 0.7, -1.0)])
def test_always_within_the_motors(torque, thrust, frame):
    assert all(0.0 <= u <= 1.0 for u in mix(*torque, thrust, frame))
