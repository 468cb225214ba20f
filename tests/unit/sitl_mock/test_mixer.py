"""The mixer against SERVO_OUTPUT_RAW recorded from PX4 1.13.3 (1000 + 1000 u), and its saturation."""

import pytest

from sitl_mock.mixer import mix


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


@pytest.mark.parametrize("thrust", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("torque", [(1.0, 0.0, 0.0), (1.0, -1.0, 1.0), (-0.4, 0.7, -1.0)])
def test_always_within_the_motors(torque, thrust):
    assert all(0.0 <= u <= 1.0 for u in mix(*torque, thrust))
