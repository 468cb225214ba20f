"""The four chains together: streams, offsets of the rows, what is late, what is old."""

from __future__ import annotations

import itertools
import math
import random

import pytest

from mavquad.control.estimator import YAW, Estimator, X, Y, Z
from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.types import Attitude, Depth, Position, Vec3

G = 9.81
DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
LEVEL = (0.0, 0.0)
LEAN = (-0.2, 0.3)
"""Roll and pitch that hold the place against a wind."""


def _place(stamp_us: int, where: Vec3 = (0.0,) * 3, velocity: Vec3 = (0.0,) * 3) -> Position:
    return Position(stamp_us, where, velocity)


def _angles(stamp_us: int, lean: tuple[float, float] = LEVEL, yaw: float = 0.0, rates: Vec3 = (0.0,) * 3) -> Attitude:
    return Attitude(stamp_us, *lean, yaw, rates)


def _estimator(
    depth: Depth = "torque", lean: tuple[float, float] = LEVEL, thrust: float = G, **settings: object
) -> Estimator:
    return Estimator(tuning(LawParams(**settings), depth), _place(0), _angles(0, lean), thrust)


def _push(lean: tuple[float, float], thrust: float) -> Vec3:
    """T r3 - g e3 at yaw 0."""
    roll, pitch = lean
    return (
        thrust * math.sin(pitch) * math.cos(roll),
        -thrust * math.sin(roll),
        thrust * math.cos(pitch) * math.cos(roll) - G,
    )


def _rested(
    estimator: Estimator, lean: tuple[float, float], velocity: Vec3 = (0.0,) * 3, seconds: float = 12.0
) -> None:
    """The vehicle hangs still at the origin; attitudes at 100 Hz, positions at half of that."""
    for k in range(1, round(seconds * 100)):
        estimator.observe_attitude(_angles(10_000 * k, lean))
        if k % 2 == 0:
            estimator.observe_position(_place(10_000 * k, velocity=velocity))


# ---------------------------------------------------------------- offsets


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("measurements", ["position_attitude", "full"])
def test_a_constant_wind_becomes_the_offset_of_the_acceleration(depth: Depth, measurements: str) -> None:
    """The vehicle leans and stays where it is: the wind takes what the thrust gives; the place is not drawn off."""
    thrust = G / math.cos(LEAN[0]) / math.cos(LEAN[1]) + 0.4
    estimator = _estimator(depth, LEVEL, thrust, measurements=measurements)
    _rested(estimator, LEAN)
    push = _push(LEAN, thrust)
    for axis, channel in enumerate((X, Y, Z)):
        chain = estimator.chains[channel]
        assert chain.values[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
        if depth != "attitude":
            assert chain.values[2:] == pytest.approx([0.0] * (len(chain.values) - 2), abs=1e-5)
            assert estimator.wind()[(channel + 1) // 2] == pytest.approx(-push[axis], abs=1e-5)


def test_at_depth_attitude_the_wind_is_sigma() -> None:
    """The input is the acceleration itself; what is beside it is what the thrust did not make."""
    estimator = _estimator("attitude", LEAN, 11.0)
    push = _push(LEAN, 11.0)
    assert estimator.wind() == pytest.approx((-push[2], -push[0], -push[1]))
    _rested(estimator, LEAN, seconds=3.0)
    assert estimator.wind() == pytest.approx((-push[2], -push[0], -push[1]))
    assert estimator.chains[X].values[:2] == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("measurements", ["position_yaw", "position_attitude", "full"])
@pytest.mark.parametrize("depth", DEPTHS)
def test_from_the_start_a_wind_that_is_held_moves_nothing(depth: Depth, measurements: str) -> None:
    thrust = G / math.cos(LEAN[0]) / math.cos(LEAN[1])
    estimator = _estimator(depth, LEAN, thrust, measurements=measurements)
    before = [list(chain.values) for chain in estimator.chains]
    _rested(estimator, LEAN, seconds=0.5)
    for chain, values in zip(estimator.chains, before, strict=True):
        assert chain.values == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_velocity_that_is_always_wrong_becomes_the_offset_of_its_row(depth: Depth) -> None:
    estimator = _estimator(depth, measurements="full")
    bias = (0.4, -0.3, 0.2)
    _rested(estimator, LEVEL, velocity=bias)
    for axis, channel in enumerate((X, Y, Z)):
        chain = estimator.chains[channel]
        assert chain.values == pytest.approx([0.0] * len(chain.values), abs=1e-5)
        assert chain.offset(1) == pytest.approx(-bias[axis], abs=1e-5)


def test_without_such_rows_there_is_no_wind_to_tell_apart() -> None:
    estimator = _estimator("torque", LEAN, 11.0, measurements="position_yaw")
    _rested(estimator, LEAN, seconds=1.0)
    assert estimator.wind() == (0.0, 0.0, 0.0)


def test_friction_of_the_motion_is_no_wind() -> None:
    """At 2 m/s the lean that holds the friction of 0.8 / s: the thrust's share is all, and d is the friction's."""
    estimator = Estimator(
        tuning(LawParams(measurements="full", friction_1_s=0.8), "torque"),
        _place(0, velocity=(2.0, 0.0, 0.0)),
        _angles(0, (0.0, math.atan(1.6 / G))),
        math.hypot(G, 1.6),
    )
    for k in range(1, 600):
        estimator.observe_attitude(_angles(10_000 * k, (0.0, math.atan(1.6 / G))))
        estimator.observe_position(_place(10_000 * k, (0.02 * k, 0.0, 0.0), (2.0, 0.0, 0.0)))
    chain = estimator.chains[X]
    assert chain.values[1:] == pytest.approx([2.0, 0.0, 0.0, 0.0], abs=1e-6)
    assert [chain.offset(row) for row in range(4)] == pytest.approx([0.0] * 4, abs=1e-6)
    assert estimator.wind()[1] == pytest.approx(-1.6, abs=1e-6)


# ---------------------------------------------------------------- streams and stamps


def test_two_streams_of_one_stamp_are_two_corrections_without_time_between() -> None:
    estimator = _estimator()
    estimator.observe_attitude(_angles(10_000, (0.0, 0.02)))
    before = list(estimator.chains[X].values)
    assert estimator.stamp_us == 10_000
    assert estimator.observe_position(_place(10_000, (0.1, 0.0, 0.0)))
    after = estimator.chains[X].values
    assert estimator.stamp_us == 10_000
    assert after[0] > before[0]  # corrected with the K of the time since the last position
    memory = list(after)
    assert not estimator.observe_position(_place(10_000, (0.3, 0.0, 0.0)))
    assert list(estimator.chains[X].values) == memory
    assert estimator.stale == 0


def test_either_order_of_two_streams_of_one_stamp_will_do() -> None:
    """The rows of a chain know of each other through the prediction only: nearly the same, never an error of a sample."""
    one, two = _estimator(), _estimator()
    rng = random.Random(4)
    for k in range(1, 300):
        position = _place(10_000 * k, tuple(rng.gauss(0.0, 0.01) for _ in range(3)))
        attitude = _angles(10_000 * k, (rng.gauss(0.0, 0.01), rng.gauss(0.0, 0.01)))
        one.observe_attitude(attitude)
        one.observe_position(position)
        two.observe_position(position)
        two.observe_attitude(attitude)
    for channel in (X, Y, Z):
        assert one.chains[channel].values[:2] == pytest.approx(two.chains[channel].values[:2], abs=0.02)


def test_a_position_older_than_the_attitude_is_still_used() -> None:
    """Positions come 30 ms late of a vehicle at 1 m/s: what they say is said of their own moment."""
    estimator = Estimator(
        tuning(LawParams(measurements="full", friction_1_s=0.0), "torque"),
        _place(0, velocity=(1.0, 0.0, 0.0)),
        _angles(0),
        G,
    )
    for k in range(1, 400):
        assert estimator.observe_attitude(_angles(10_000 * k))
        if k > 3:
            then = 10_000 * (k - 3)
            assert estimator.observe_position(_place(then, (then * 1e-6, 0.0, 0.0), (1.0, 0.0, 0.0)))
    assert estimator.stamp_us == 3_990_000
    assert estimator.chains[X].values == pytest.approx([3.99, 1.0, 0.0, 0.0, 0.0], abs=1e-6)
    assert estimator.stale == 0


def test_an_attitude_older_than_the_position_is_still_used() -> None:
    estimator = _estimator(measurements="position_attitude")
    for k in range(1, 400):
        estimator.observe_position(_place(10_000 * k))
        assert k < 3 or estimator.observe_attitude(_angles(10_000 * (k - 2), LEAN))
    push = _push(LEAN, G)
    assert estimator.chains[X].offset(1) == pytest.approx(-push[0], abs=1e-3)
    assert estimator.stale == 0


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("measurements", ["position_yaw", "position_attitude", "full"])
def test_older_than_the_last_of_their_kind_are_refused(depth: Depth, measurements: str) -> None:
    estimator = _estimator(depth, measurements=measurements)
    for k in range(1, 20):
        estimator.observe_attitude(_angles(10_000 * k + 5_000))
        estimator.observe_position(_place(10_000 * k))
    before = [(list(chain.values), [list(d) for d in chain.drifts]) for chain in estimator.chains]
    assert not estimator.observe_position(_place(189_000, (9.0, 9.0, 9.0)))
    assert not estimator.observe_position(_place(190_000, (9.0, 9.0, 9.0)))
    assert not estimator.observe_attitude(_angles(194_000, LEAN, 2.0))
    assert not estimator.observe_attitude(_angles(195_000, LEAN, 2.0))
    assert [(list(chain.values), [list(d) for d in chain.drifts]) for chain in estimator.chains] == before
    assert estimator.stale == 2


@pytest.mark.parametrize("depth", ["torque", "rate"])
@pytest.mark.parametrize("late_ms", [20, 60, 90])
def test_positions_may_be_much_later_than_attitudes(depth: Depth, late_ms: int) -> None:
    """A swing of 30 cm, no commands: what a late position corrects has gone on since its own moment."""
    estimator, largest = _estimator(depth, friction_1_s=0.0), 0.0
    for k in range(1, 1200):
        now, then = 0.01 * k, 0.01 * k - 1e-3 * late_ms
        estimator.observe_attitude(_angles(10_000 * k, (0.0, math.atan2(-0.3 * math.sin(now), G))))
        if then > 0.0:
            velocity = (0.3 * math.cos(then), 0.0, 0.0)
            estimator.observe_position(_place(round(then * 1e6), (0.3 * math.sin(then), 0.0, 0.0), velocity))
        if k > 600:
            largest = max(largest, abs(estimator.chains[X].values[0] - 0.3 * math.sin(now)))
    assert estimator.stale == 0
    assert largest < 1e-3


def test_a_position_too_late_to_be_of_use_is_refused() -> None:
    """Newer than the last one, but the attitudes have gone on for more than 0.1 s."""
    estimator = _estimator()
    for k in range(1, 30):
        estimator.observe_attitude(_angles(10_000 * k))
    before = [list(chain.values) for chain in estimator.chains]
    assert not estimator.observe_position(_place(150_000, (9.0, 9.0, 9.0)))
    assert [list(chain.values) for chain in estimator.chains] == before
    assert estimator.observe_position(_place(190_000, (0.1, 0.0, 0.0)))


def test_a_position_too_late_to_be_of_use_is_counted() -> None:
    estimator = _estimator()
    for k in range(1, 30):
        estimator.observe_attitude(_angles(10_000 * k))
    estimator.observe_position(_place(150_000, (9.0, 9.0, 9.0)))
    assert estimator.stale == 1


def test_yaw_has_a_moment_of_its_own() -> None:
    estimator = _estimator(measurements="position_yaw")
    estimator.observe_attitude(_angles(10_000, yaw=0.1))
    assert (estimator.yaw_us, estimator.stamp_us) == (10_000, 0)
    estimator.observe_position(_place(30_000))
    assert (estimator.yaw_us, estimator.stamp_us) == (10_000, 30_000)
    assert estimator.observe_attitude(_angles(20_000, yaw=0.1))  # older than the position, newer than the last attitude
    assert estimator.yaw_us == 20_000


def test_the_start_knows_streams_of_different_moments() -> None:
    for position_us, attitude_us in itertools.permutations((0, 40_000)):
        estimator = Estimator(
            tuning(LawParams(), "torque"),
            _place(position_us, (1.0, 2.0, 3.0)),
            _angles(attitude_us, LEAN, 0.4),
            G / math.cos(LEAN[0]) / math.cos(LEAN[1]),
        )
        for k in range(5, 200):
            estimator.observe_attitude(_angles(10_000 * k, LEAN, 0.4))
            estimator.observe_position(_place(10_000 * k, (1.0, 2.0, 3.0)))
            assert [estimator.chains[c].values[0] for c in (X, Y, Z)] == pytest.approx([1.0, 2.0, 3.0], abs=1e-9)
            assert estimator.chains[YAW].values[0] == pytest.approx(0.4)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("measurements", ["position_yaw", "position_attitude", "full"])
@pytest.mark.parametrize("seed", [1, 2])
def test_any_schedule_converges(depth: Depth, measurements: str, seed: int) -> None:
    """A constant motion of 0.5 m/s, seen by streams that are irregular, late and full of gaps."""
    estimator = _estimator(depth, measurements=measurements, friction_1_s=0.0)
    rng, now = random.Random(seed), 0

    def where(stamp_us: int) -> Vec3:
        return (0.5 * stamp_us * 1e-6, -0.2, 0.1)

    for _ in range(2500):
        now += rng.choice((1_000, 4_000, 10_000, 10_000, 20_000))
        now += 2_000_000 if rng.random() < 0.001 else 0
        if rng.random() < 0.7:
            estimator.observe_attitude(_angles(now, yaw=0.3, rates=(0.0, 0.0, 0.0)))
        if rng.random() < 0.5:
            then = now - rng.choice((0, 0, 15_000, 60_000))
            estimator.observe_position(_place(then, where(then), (0.5, 0.0, 0.0)))
    stamp_us = estimator.stamp_us
    for channel, wanted in ((X, [where(stamp_us)[0], 0.5]), (Y, [-0.2, 0.0]), (Z, [0.1, 0.0])):
        assert estimator.chains[channel].values[:2] == pytest.approx(wanted, abs=1e-4)
    assert estimator.chains[YAW].values[0] == pytest.approx(0.3, abs=1e-6)


# ---------------------------------------------------------------- state feedback


@pytest.mark.parametrize("depth", DEPTHS)
def test_state_feedback_copies_what_is_measured(depth: Depth) -> None:
    estimator = _estimator(depth, form="state_feedback", friction_1_s=0.5)
    lean, rates, velocity = (0.1, -0.2), (0.3, 0.4, 0.5), (1.0, 2.0, 3.0)
    estimator.observe_attitude(_angles(10_000, lean, 0.0, rates))
    estimator.observe_position(_place(10_000, (4.0, 5.0, 6.0), velocity))
    push = _push(lean, G)
    for axis, channel in enumerate((X, Y, Z)):
        values = estimator.chains[channel].values
        assert values[-1] == 0.0
        assert values[:2] == pytest.approx([4.0 + axis, velocity[axis]])
        if depth != "attitude":
            assert values[2] == pytest.approx(push[axis] - 0.5 * velocity[axis])
    # At depth attitude the law itself adds the friction that it knows of.
    assert estimator.wind() == pytest.approx((0.0,) * 3 if depth == "attitude" else (-1.5, -0.5, -1.0))


def test_state_feedback_carries_an_older_position_on() -> None:
    estimator = _estimator(form="state_feedback")
    estimator.observe_position(_place(10_000, (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)))
    estimator.observe_attitude(_angles(30_000))
    assert estimator.chains[X].values[0] == pytest.approx(1.04)
