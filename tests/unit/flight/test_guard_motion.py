"""Speed, and jumps of the estimate: a motion that the velocity and the rates explain is none."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavquad.flight.guard_motion import JumpMonitor, JumpParams, SpeedParams, fast
from mavquad.types import Attitude, Position

STILL = (0.0, 0.0, 0.0)


def position(at_s=0.0, place=STILL, velocity=STILL):
    return Position(round(at_s * 1e6), place, velocity)


def attitude(at_s=0.0, yaw_deg=0.0, roll_deg=0.0, pitch_deg=0.0, rates=STILL):
    return Attitude(round(at_s * 1e6), *map(math.radians, (roll_deg, pitch_deg, yaw_deg)), rates)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_in_every_direction(axis, sign):
    def at(speed_m_s):
        return fast(
            SpeedParams(limit_m_s=5.0), position(velocity=tuple(sign * speed_m_s * (i == axis) for i in range(3)))
        )

    assert at(5.0) is None
    assert at(5.01).name == "speed"


def test_speed_is_that_of_all_three_axes_and_words_and_reaction_say_it():
    tripped = fast(SpeedParams(limit_m_s=6.9, reaction="land"), position(velocity=(2.0, -3.0, 6.0)))
    assert (tripped.words, tripped.reaction) == ("7.0 m/s, 6.9 allowed", "land")
    assert fast(SpeedParams(limit_m_s=7.1), position(velocity=(2.0, -3.0, 6.0))) is None


def test_zero_is_off():
    off = JumpMonitor(JumpParams(position_m=0.0, velocity_m_s=0.0, yaw_deg=0.0))
    off.take_position(position())
    off.take_attitude(attitude())
    assert off.take_position(position(0.01, (50.0, 0.0, 0.0), (0.0, 50.0, 0.0))) is None
    assert off.take_attitude(attitude(0.01, yaw_deg=90.0)) is None
    assert fast(SpeedParams(limit_m_s=0.0), position(velocity=(99.0, 0.0, 0.0))) is None


def jump(first, second):
    monitor = JumpMonitor(JumpParams(position_m=0.5, velocity_m_s=3.0, yaw_deg=20.0))
    take = monitor.take_position if isinstance(first, Position) else monitor.take_attitude
    assert take(first) is None
    return take(second)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_position_that_jumps(axis, sign):
    def by(distance_m):
        return jump(position(), position(0.01, tuple(sign * distance_m * (i == axis) for i in range(3))))

    assert by(0.5) is None
    assert by(0.52).words == "the autopilot's estimate was reset: the position jumped by 0.5 m, 0.5 allowed"


def test_a_way_that_the_velocity_explains_is_no_jump():
    velocity = (3.0, -4.0, 12.0)
    assert jump(position(0.0, (1.0, 2.0, 3.0), velocity), position(0.1, (1.3, 1.6, 4.2), velocity)) is None
    assert jump(position(0.0, (1.0, 2.0, 3.0), velocity), position(0.1, (0.7, 2.4, 1.8), velocity)).name == "jump"


def test_a_velocity_that_jumps():
    assert jump(position(), position(0.01, STILL, (0.0, 3.2, 0.0))) is None  # 3 and what 25 m/s^2 make of 10 ms
    assert "the velocity jumped by 3.0 m/s" in jump(position(), position(0.01, STILL, (0.0, -3.26, 0.0))).words


@given(st.lists(st.tuples(*[st.floats(-24.0 / math.sqrt(3.0), 24.0 / math.sqrt(3.0))] * 3), min_size=1, max_size=50))
def test_no_flight_within_its_acceleration_is_a_jump(accelerations):
    """Pieces of constant acceleration, 4 ms each, seen every fifth: what A dt^2 / 4 allows is never exceeded."""
    monitor = JumpMonitor(JumpParams(position_m=1e-6, velocity_m_s=1e-6))
    place, velocity, dt_s = [0.0] * 3, [1.0, 2.0, 3.0], 0.004
    for step, acceleration in enumerate(accelerations):
        if step % 5 == 0:
            assert monitor.take_position(position(step * dt_s, tuple(place), tuple(velocity))) is None
        for axis in range(3):
            place[axis] += velocity[axis] * dt_s + 0.5 * acceleration[axis] * dt_s**2
            velocity[axis] += acceleration[axis] * dt_s


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("start_deg", [0.0, 175.0, -175.0])
def test_a_yaw_that_jumps_also_across_the_half_circle(sign, start_deg):
    def by(turn_deg):
        end_deg = (start_deg + sign * turn_deg + 180.0) % 360.0 - 180.0
        return jump(attitude(0.0, start_deg), attitude(0.01, end_deg))

    assert by(19.9) is None
    assert "the yaw jumped by 21 degrees, 20 allowed" in by(21.0).words


def test_a_turn_that_the_rates_explain_is_no_jump():
    rates = (0.0, 0.0, math.radians(300.0))
    assert jump(attitude(0.0, 0.0, rates=rates), attitude(0.1, 30.0, rates=rates)) is None
    assert jump(attitude(0.0, 0.0, rates=rates), attitude(0.1, -30.0, rates=rates)).name == "jump"


def test_hours_after_its_boot_as_well():
    rates = (0.0, 0.0, math.radians(300.0))
    assert jump(attitude(7200.0, 0.0, rates=rates), attitude(7200.1, 30.0, rates=rates)) is None
    assert jump(attitude(7200.0), attitude(7200.01, 21.0)).name == "jump"
    assert jump(position(7200.0), position(7200.01, (0.0, 1.0, 0.0))).name == "jump"


def test_leaning_it_is_pitch_rate_that_turns_the_yaw():
    """Rolled by 90 degrees the body's y axis is vertical: q is the rate of yaw then."""
    rates = (0.0, math.radians(300.0), 0.0)
    leaning = {"roll_deg": 90.0, "rates": rates}
    assert jump(attitude(0.0, 0.0, **leaning), attitude(0.1, 30.0, **leaning)) is None
    assert jump(attitude(0.0, 0.0, rates=rates), attitude(0.1, 30.0, rates=rates)).name == "jump"


def test_nothing_is_said_across_a_long_gap_nor_of_a_clock_that_went_back():
    far = (100.0, 0.0, 0.0)
    assert jump(position(), position(1.0, far)) is None
    assert jump(position(5.0), position(0.0, far)) is None
    assert jump(attitude(), attitude(1.0, 90.0)) is None


def test_each_sample_is_compared_with_the_one_before_it():
    monitor = JumpMonitor(JumpParams())
    for step in range(100):
        assert monitor.take_position(position(step * 0.01, (0.4 * step, 0.0, 0.0), STILL)) is None  # 40 m by now
