"""The composed controller, one step at a time, at every depth: starts, stamps, signs, limits, evidence."""

from __future__ import annotations

import copy
import itertools
import math
import random

import pytest

from mavquad.control.controller import Controller
from mavquad.control.euler import body_acceleration, body_rates, euler_rates, trig
from mavquad.control.inversion import to_world
from mavquad.control.params import LawParams, LimitParams
from mavquad.control.reference import Pose, hold
from mavquad.control.tuning import tuning
from mavquad.types import (
    Attitude,
    AttitudeCommand,
    Depth,
    LawCommand,
    Position,
    RateCommand,
    ReferencePoint,
    TorqueCommand,
    Vec3,
)

G = 9.81
FORMS = ("output_feedback", "state_feedback")
DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
MEASUREMENTS = ("position_yaw", "position_attitude", "full")
DECOUPLINGS = ("attitude", "constant")
LENGTHS = {"torque": 4, "rate": 3, "attitude": 2}
EVERY = list(itertools.product(DEPTHS, MEASUREMENTS, DECOUPLINGS, ("output_feedback",))) + [
    (depth, "full", decoupling, "state_feedback") for depth in DEPTHS for decoupling in DECOUPLINGS
]
"""Depth, measurement set, decoupling, form."""
PAPER = {"depth": "torque", "measurements": "position_yaw", "decoupling": "constant", "yaw_padding": 2}

OUTPUT_FEEDBACK = [law[:3] for law in EVERY if law[3] == "output_feedback"]

every_law = pytest.mark.parametrize(("depth", "measurements", "decoupling", "form"), EVERY)
every_depth = pytest.mark.parametrize("depth", DEPTHS)
both_forms = pytest.mark.parametrize("form", FORMS)


def _position(stamp_us: int, x: float = 0.0, y: float = 0.0, z: float = 0.0, velocity: Vec3 = (0.0,) * 3) -> Position:
    return Position(stamp_us, (x, y, z), velocity)


def _attitude(
    stamp_us: int, yaw: float = 0.0, roll: float = 0.0, pitch: float = 0.0, rates: Vec3 = (0.0,) * 3
) -> Attitude:
    return Attitude(stamp_us, roll, pitch, yaw, rates)


def _hold(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> ReferencePoint:
    return hold(Pose((x, y, z), yaw))


def _step(law: Controller, position: Position, attitude: Attitude, point: ReferencePoint) -> LawCommand:
    law.observe_attitude(attitude)
    law.observe_position(position)
    return law.command(lambda _: point)


def _begin(params: LawParams, depth: Depth, yaw: float = 0.0, thrust: float = G) -> Controller:
    return Controller(params, depth, _position(0), _attitude(0, yaw), thrust)


def _turn(command: LawCommand, yaw_rad: float = 0.0) -> Vec3:
    """What it asks of roll, pitch and yaw; at depth attitude the yaw beyond the one given."""
    if isinstance(command, TorqueCommand):
        return command.angular_acceleration_flu_rad_s2
    if isinstance(command, RateCommand):
        return command.rates_flu_rad_s
    return command.roll_rad, command.pitch_rad, command.yaw_rad - yaw_rad


def _error(law: Controller) -> tuple[float, ...]:
    """Reference minus measured, as the evidence has it: z, yaw, x, y."""
    assert law.trace is not None
    return tuple(a - b for a, b in zip(law.trace.reference, law.trace.measured, strict=True))


def _memory(law: Controller) -> list[list[float]]:
    """All numbers that the next step starts from."""
    return [[*c.values, *(d for drift in c.drifts for d in drift), c.lagged] for c in law.estimator.chains]


# ---------------------------------------------------------------- the start


@every_law
@pytest.mark.parametrize("thrust", [8.5, G, 11.0])
@pytest.mark.parametrize("yaw", [-3.0, 0.0, 1.2])
def test_the_first_commands_hold_the_hover(
    depth: Depth, measurements: str, decoupling: str, form: str, yaw: float, thrust: float
) -> None:
    if form == "state_feedback":
        thrust = G  # eq. (6) counts on T = g at rest; what is wrong with it shows as an acceleration
    params = LawParams(form=form, measurements=measurements, decoupling=decoupling)
    law = Controller(params, depth, _position(1_000_000, 1.0, -2.0, 3.0), _attitude(1_000_000, yaw), thrust)
    assert _turn(law.command_given, yaw) == (0.0, 0.0, 0.0)
    assert law.command_given.specific_thrust_m_s2 == thrust
    for k in range(5):
        stamp = 1_000_000 + 10_000 * k
        command = _step(law, _position(stamp, 1.0, -2.0, 3.0), _attitude(stamp, yaw), _hold(1.0, -2.0, 3.0, yaw))
        assert _turn(command, yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        assert command.specific_thrust_m_s2 == pytest.approx(thrust, abs=1e-6)
        assert law.trace is not None
        assert law.trace.limits_active == ()


@pytest.mark.parametrize(("depth", "measurements", "decoupling"), OUTPUT_FEEDBACK)
@pytest.mark.parametrize("yaw", [0.0, 2.2])
def test_in_wind_the_first_commands_hold_the_tilt(depth: Depth, measurements: str, decoupling: str, yaw: float) -> None:
    """25 degrees of lean hold the place against a wind: nothing moves at the hand-over.

    b(0, yaw) at depth attitude takes angles for their tangents, and has a bump of that size. State feedback, which takes
    what leans for what accelerates, knows of no wind.
    """
    roll, pitch = -0.3, 0.3
    thrust = G / math.cos(roll) / math.cos(pitch)
    params = LawParams(measurements=measurements, decoupling=decoupling)
    law = Controller(params, depth, _position(0), _attitude(0, yaw, roll, pitch), thrust)
    held = (roll, pitch, 0.0) if depth == "attitude" else (0.0, 0.0, 0.0)
    crude = depth == "attitude" and decoupling == "constant"
    for k in range(8):
        command = _step(law, _position(10_000 * k), _attitude(10_000 * k, yaw, roll, pitch), _hold(yaw=yaw))
        assert _turn(command, yaw) == pytest.approx(held, abs=0.04 if crude else 1e-6)
        assert command.specific_thrust_m_s2 == pytest.approx(G if crude else thrust, abs=1e-6)


@pytest.mark.parametrize("depth", ["torque", "rate"])
def test_a_moving_start_is_no_bump(depth: Depth) -> None:
    """Handed over at 1 m/s, on a reference that goes on like that: friction is held as before, nothing turns.

    At depth attitude what holds the friction is sigma at the start, whatever the reference does.
    """
    velocity, friction = 1.0, 1.0
    pitch = math.atan2(friction * velocity, G)
    law = Controller(
        LawParams(friction_1_s=friction),
        depth,
        _position(0, velocity=(velocity, 0.0, 0.0)),
        _attitude(0, pitch=pitch),
        G / math.cos(pitch),
    )
    still = (0.0,) * 5
    for k in range(8):
        x = velocity * 0.01 * k
        point = ReferencePoint(still, still, (x, velocity, 0.0, 0.0, 0.0), still)
        command = _step(
            law, _position(10_000 * k, x, velocity=(velocity, 0.0, 0.0)), _attitude(10_000 * k, pitch=pitch), point
        )
        # The reference is read at the stamp and carried on by its own derivatives: there is no error at any time.
        assert _turn(command) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


# ---------------------------------------------------------------- signs


def _response(depth: Depth, form: str, start_yaw: float, decoupling: str = "auto", **goal: float) -> tuple[Vec3, float]:
    """The command 50 ms after the start, the vehicle at rest at the origin and the reference elsewhere."""
    law = _begin(LawParams(form=form, decoupling=decoupling), depth, start_yaw)
    for k in range(6):
        stamp = 10_000 * k
        command = _step(law, _position(stamp), _attitude(stamp, start_yaw), _hold(**{"yaw": start_yaw, **goal}))
    return _turn(command, start_yaw), command.specific_thrust_m_s2


@every_depth
@both_forms
@pytest.mark.parametrize("decoupling", DECOUPLINGS)
def test_direction_on_each_axis(depth: Depth, form: str, decoupling: str) -> None:
    lean = 0.02 if depth == "attitude" else 1e-9  # holding the height while leaning costs thrust at once there
    (p, q, r), thrust = _response(depth, form, 0.0, decoupling, x=0.1)
    assert q > 0.01  # x forward: nose down is positive pitch in FLU
    assert (p, r) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert thrust == pytest.approx(G, abs=lean)
    (p, q, r), thrust = _response(depth, form, 0.0, decoupling, y=0.1)
    assert p < -0.01  # y left: left side down is negative roll in FLU
    assert (q, r) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert thrust == pytest.approx(G, abs=lean)
    (p, q, r), thrust = _response(depth, form, 0.0, decoupling, z=0.1)
    assert thrust > G + 1e-5
    assert (p, q, r) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    (p, q, r), thrust = _response(depth, form, 0.0, decoupling, yaw=0.1)
    assert r > 1e-3
    assert (p, q, thrust) == pytest.approx((0.0, 0.0, G), abs=1e-9)


@every_depth
@both_forms
@pytest.mark.parametrize("decoupling", DECOUPLINGS)
def test_the_goal_is_seen_from_the_body(depth: Depth, form: str, decoupling: str) -> None:
    (p, q, _), _ = _response(depth, form, math.pi / 2, decoupling, x=0.1)
    assert p > 0.01  # looking along y, x is to the right
    assert q == pytest.approx(0.0, abs=1e-9)
    (p, q, _), _ = _response(depth, form, math.pi, decoupling, x=0.1)
    assert q < -0.01
    assert p == pytest.approx(0.0, abs=1e-6)
    one, _ = _response(depth, form, 0.0, decoupling, x=0.1, y=-0.05)
    turned, _ = _response(
        depth, form, 0.7, decoupling, x=0.1 * math.cos(0.7) + 0.05 * math.sin(0.7),
        y=0.1 * math.sin(0.7) - 0.05 * math.cos(0.7),
    )  # fmt: skip
    assert turned == pytest.approx(one, abs=1e-9)


@pytest.mark.parametrize(("depth", "gamma"), [("torque", 16.0), ("rate", 8.0), ("attitude", 4.0)])
def test_magnitude_of_the_first_answer(depth: Depth, gamma: float) -> None:
    """At rest, the pitch input is gamma_1 e / g, from the measured state without a prediction in the way."""
    law = _begin(LawParams(form="state_feedback", omega0_rad_s=2.0, kappa_rad_s=8.0), depth)
    command = _step(law, _position(0), _attitude(0), _hold(x=0.1))
    wanted = gamma * 0.1 / G
    assert _turn(command)[1] == pytest.approx(math.atan(wanted) if depth == "attitude" else wanted)
    assert law.trace is not None
    assert _error(law) == pytest.approx((0.0, 0.0, 0.1, 0.0))
    assert law.trace.demanded == pytest.approx((0.0, 0.0, gamma * 0.1, 0.0))


def test_at_depth_attitude_the_yaw_rate_is_integrated_to_the_angle_sent() -> None:
    """From the angle at the start on, at the rate that was asked for until then, wrapped."""
    law = Controller(LawParams(delay_s=0.0), "attitude", _position(0), _attitude(0, 3.1), G)
    sent, before_us, rate = 3.1, 0, 0.0
    for stamp in (0, 10_000, 24_000, 40_000, 90_000, 2_000_000):
        command = _step(law, _position(stamp), _attitude(stamp, 3.1), _hold(yaw=3.1 + 0.5))
        assert isinstance(command, AttitudeCommand)
        assert law.trace is not None
        sent += min((stamp - before_us) * 1e-6, 0.1) * rate
        before_us, rate = stamp, law.trace.inputs[1]
        assert command.yaw_rad == pytest.approx(math.remainder(sent, 2 * math.pi), abs=1e-12)
        assert abs(command.yaw_rad) <= math.pi


def test_at_depth_attitude_the_angle_sent_does_not_run_away_from_the_vehicle() -> None:
    """A vehicle that does not turn at all, asked to for 10 s; then the other way, which it is told soon."""
    law = Controller(LawParams(), "attitude", _position(0), _attitude(0, 1.0), G)
    for k in range(1000):
        command = _step(law, _position(10_000 * k), _attitude(10_000 * k, 1.0), _hold(yaw=2.5))
        assert isinstance(command, AttitudeCommand)
        assert abs(math.remainder(command.yaw_rad - 1.0, 2 * math.pi)) <= 0.7 + 1e-9
    assert math.remainder(command.yaw_rad - 1.0, 2 * math.pi) == pytest.approx(0.7)


def test_at_depth_attitude_the_thrust_leans_where_it_should_whatever_the_yaw_sent() -> None:
    """The vehicle is turned by something else: the force is still the one that was meant."""
    law = Controller(LawParams(friction_1_s=0.0, delay_s=0.0), "attitude", _position(0), _attitude(0, 0.0), G)
    for k in range(1, 30):
        command = _step(law, _position(10_000 * k), _attitude(10_000 * k, 0.02 * k), _hold(2.0, -1.0, 0.5))
    assert isinstance(command, AttitudeCommand)
    assert law.trace is not None
    assert abs(command.yaw_rad - 0.58) > 0.05
    t = trig(command.roll_rad, command.pitch_rad, command.yaw_rad)
    force = to_world(t, (0.0, 0.0, command.specific_thrust_m_s2))
    wz, _, wx, wy = law.trace.demanded
    assert force == pytest.approx((wx, wy, wz + G), abs=1e-9)


def _tilted(depth: Depth, decoupling: str, yaw_off: float = 0.4) -> tuple[Controller, Attitude, LawCommand]:
    """One command at 35 degrees of lean, turning, with something to do about place and yaw."""
    law = _begin(LawParams(decoupling=decoupling, delay_s=0.0, lag_s=0.0, dead_time_s=0.0), depth)
    attitude = _attitude(10_000, 0.3, 0.5, -0.4, (0.8, -0.6, 0.4))
    return law, attitude, _step(law, _position(10_000), attitude, _hold(1.0, -0.5, 0.2, 0.3 + yaw_off))


def test_euler_accelerations_are_turned_into_the_bodys_on_the_wire() -> None:
    """The paper's u2, u3, u4 are derivatives of angles; products of the rates and all."""
    law, attitude, command = _tilted("torque", "constant")
    t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    assert law.trace is not None
    _, yaw, roll, pitch = law.trace.inputs
    rates = euler_rates(t, attitude.rates_flu_rad_s)
    assert _turn(command) == pytest.approx(body_acceleration(t, rates, (roll, pitch, yaw)))
    assert _turn(command) != pytest.approx((roll, pitch, yaw), abs=0.05)


def test_euler_rates_are_turned_into_the_bodys_on_the_wire() -> None:
    law, attitude, command = _tilted("rate", "constant")
    t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    assert law.trace is not None
    _, yaw, roll, pitch = law.trace.inputs
    assert _turn(command) == pytest.approx(body_rates(t, (roll, pitch, yaw)))


@pytest.mark.parametrize("depth", ["torque", "rate"])
def test_the_turn_about_the_body_gives_the_yaw_that_was_asked_for(depth: Depth) -> None:
    """In the body's form roll and pitch are as inverted, and what they do to the yaw is taken off."""
    law, attitude, command = _tilted(depth, "attitude")
    t = trig(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)
    assert law.trace is not None
    _, yaw, roll, pitch = law.trace.inputs
    about_x, about_y, _ = _turn(command)
    assert (about_x, about_y) == (roll, pitch)
    assert euler_rates(t, _turn(command))[2] == pytest.approx(yaw)


# ---------------------------------------------------------------- stamps


def _disturbed(params: LawParams, depth: Depth = "torque", steps: int = 40, seed: int = 5) -> tuple[Controller, int]:
    rng = random.Random(seed)
    law, stamp = _begin(params, depth), 0
    for _ in range(steps):
        stamp += rng.choice((8_000, 10_000, 12_000))
        where = [rng.uniform(-0.05, 0.05) for _ in range(3)]
        lean = [rng.uniform(-0.05, 0.05) for _ in range(2)]
        _step(law, _position(stamp, *where), _attitude(stamp, 0.1, *lean), _hold())
    return law, stamp


@every_depth
@both_forms
def test_a_stamp_seen_already_changes_no_estimate(depth: Depth, form: str) -> None:
    law, stamp = _disturbed(LawParams(form=form), depth)
    position, attitude = _position(stamp + 10_000, 0.1), _attitude(stamp + 10_000, 0.1)
    first = _step(law, position, attitude, _hold())
    memory, kept = _memory(law), len(law.estimator.commands)
    assert not law.observe_attitude(attitude)
    assert not law.observe_position(position)
    assert law.command(lambda _: _hold()) == first
    assert _memory(law) == memory
    assert len(law.estimator.commands) == kept
    assert law.estimator.stale == 0


@every_depth
def test_a_second_look_at_the_same_moment_answers_for_the_first(depth: Depth) -> None:
    """Asked twice between two measurements, the law has said the last thing only: the one before leaves no trace."""
    (once, stamp), (twice, _) = (_disturbed(LawParams(), depth) for _ in range(2))
    for law in (once, twice):
        law.observe_position(_position(stamp + 10_000, 0.1))
    twice.command(lambda _: _hold(x=3.0, z=2.0))
    assert once.command(lambda _: _hold()) == twice.command(lambda _: _hold())
    assert once.estimator.commands == twice.estimator.commands
    for law in (once, twice):
        law.observe_position(_position(stamp + 20_000, 0.1))
    assert once.command(lambda _: _hold()) == twice.command(lambda _: _hold())
    assert _memory(once) == _memory(twice)


@every_depth
@both_forms
def test_older_stamps_are_refused_and_counted(depth: Depth, form: str) -> None:
    law, stamp = _disturbed(LawParams(form=form), depth)
    given, memory = law.command_given, _memory(law)
    assert not law.observe_position(_position(stamp - 4_000, 9.0))
    assert law.estimator.stale == 1
    assert not law.observe_attitude(_attitude(stamp - 4_000, 3.0))
    assert law.estimator.stale == 2
    assert not law.observe_attitude(_attitude(stamp, 3.0))
    assert law.estimator.stale == 2
    assert _memory(law) == memory
    assert law.command(lambda _: _hold()) == given


def test_yaw_is_corrected_between_positions() -> None:
    """The paper's set: an attitude says something of the yaw, and of nothing else."""
    law, stamp = _disturbed(LawParams(measurements="position_yaw"))
    z, yaw, x, y = _memory(law)
    assert law.observe_attitude(_attitude(stamp + 4_000, 0.3))
    after = _memory(law)
    assert after[1][0] > yaw[0]
    assert [after[k] for k in (0, 2, 3)] == [z, x, y]
    assert (law.estimator.yaw_us, law.estimator.stamp_us) == (stamp + 4_000, stamp)
    law.observe_position(_position(stamp + 10_000))
    assert (law.estimator.yaw_us, law.estimator.stamp_us) == (stamp + 4_000, stamp + 10_000)
    law.command(lambda _: _hold())
    assert law.trace is not None
    assert law.trace.stamp_us == stamp + 10_000


@every_depth
def test_the_reference_is_read_at_the_latest_moment(depth: Depth) -> None:
    law, stamp = _disturbed(LawParams(), depth)
    asked: list[int] = []
    law.observe_attitude(_attitude(stamp + 4_000))
    law.command(lambda at_us: asked.append(at_us) or _hold())
    assert asked == [stamp + 4_000]


@every_depth
def test_the_error_is_that_of_the_positions_own_moment(depth: Depth) -> None:
    """The reference moves at 1 m/s, the vehicle is on it; attitudes go on after the last position."""
    still = (0.0,) * 5

    def moving(stamp_us: int) -> ReferencePoint:
        return ReferencePoint(still, still, (stamp_us * 1e-6, 1.0, 0.0, 0.0, 0.0), still)

    law = _begin(LawParams(), depth)
    for k in range(1, 30):
        law.observe_attitude(_attitude(10_000 * k))
        if k < 26:
            law.observe_position(_position(10_000 * k, 0.01 * k))
        law.command(moving)
        assert _error(law) == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=1e-12)


# ---------------------------------------------------------------- yaw


@every_depth
def test_yaw_follows_through_many_turns(depth: Depth) -> None:
    """Twelve turns at 3 rad/s: the estimate is continuous, the error stays that of a constant rate."""
    law, rate = _begin(LawParams(), depth), 3.0
    for k in range(1, 2500):
        yaw = rate * 0.01 * k
        reference = ReferencePoint((0.0,) * 5, (yaw, rate, 0.0, 0.0, 0.0), (0.0,) * 5, (0.0,) * 5)
        attitude = Attitude(10_000 * k, 0.0, 0.0, math.remainder(yaw, 2 * math.pi), (0.0, 0.0, rate))
        command = _step(law, _position(10_000 * k), attitude, reference)
        assert abs(_error(law)[1]) < 1e-9
        assert depth != "attitude" or abs(command.yaw_rad) <= math.pi
    assert law.estimator.chains[1].values[0] == pytest.approx(75.0, abs=0.2)


@every_depth
@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_a_reference_some_turns_off_is_the_same_reference(depth: Depth, turns: int) -> None:
    law = _begin(LawParams(), depth, 3.1)
    _step(law, _position(0), _attitude(0, 3.1), _hold(yaw=-3.1 + 2 * math.pi * turns))
    assert law.trace is not None
    assert _error(law)[1] == pytest.approx(2 * math.pi - 6.2)
    assert law.trace.demanded[1] > 0.0


# ---------------------------------------------------------------- limits


def _random_inputs(law: Controller, seed: int, steps: int = 400) -> list[LawCommand]:
    """Anything finite: jumps, tumbling, gaps of seconds, stamps that go back."""
    rng, stamp, commands = random.Random(seed), 0, []
    for _ in range(steps):
        stamp += rng.choice((0, 4_000, 10_000, 300_000, -5_000, 3_000_000))
        size = rng.choice((0.01, 1.0, 1e3))
        position = Position(stamp, *(tuple(rng.gauss(0.0, size) for _ in range(3)) for _ in range(2)))
        roll, pitch, yaw = rng.uniform(-4, 4), rng.choice((rng.uniform(-4, 4), math.pi / 2)), rng.uniform(-4, 4)
        attitude = Attitude(stamp, roll, pitch, yaw, tuple(rng.gauss(0.0, size) for _ in range(3)))
        commands.append(_step(law, position, attitude, _hold(*(rng.gauss(0.0, size) for _ in range(4)))))
    return commands


def _numbers(law: Controller, command: LawCommand) -> list[float]:
    trace = law.trace
    assert trace is not None
    told = [v for chain in _memory(law) for v in chain]
    return [*_turn(command), command.specific_thrust_m_s2, *told, *trace.demanded, *trace.inputs, *trace.measured]


@every_law
def test_nothing_finite_gives_nan(depth: Depth, measurements: str, decoupling: str, form: str) -> None:
    params = LawParams(form=form, measurements=measurements, decoupling=decoupling)
    law = _begin(params, depth)
    for command in _random_inputs(law, 8):
        assert all(math.isfinite(v) for v in _numbers(law, command))
        assert 0.3 * G <= command.specific_thrust_m_s2 <= 2.0 * G


@every_law
@pytest.mark.parametrize("seed", [1, 2])
def test_inputs_are_within_their_levels(depth: Depth, measurements: str, decoupling: str, form: str, seed: int) -> None:
    params = LawParams(form=form, measurements=measurements, decoupling=decoupling)
    law, tune = _begin(params, depth), tuning(params, depth)
    thrust_level, yaw_level, level = tune.levels
    rng = random.Random(seed)
    for k in range(1, 200):
        size = rng.choice((0.1, 3.0, 100.0))
        where, goal = ([rng.gauss(0.0, size) for _ in range(3)] for _ in range(2))
        stamp = 10_000 * k
        command = _step(law, _position(stamp, *where), _attitude(stamp, rng.uniform(-3, 3)), _hold(*goal))
        assert law.trace is not None
        thrust, yaw, roll, pitch = law.trace.inputs
        assert abs(thrust) <= thrust_level * (1 + 1e-12)
        assert abs(yaw) <= yaw_level * (1 + 1e-12)
        assert max(abs(roll), abs(pitch)) <= level * (1 + 1e-12)
        assert 0.3 * G <= command.specific_thrust_m_s2 <= 2.0 * G


def _largest_lean(params: LawParams, speed_m_s: float) -> float:
    """Of the attitudes commanded on the way to goals far off, which themselves move north at some speed."""
    law, rng, most, still = _begin(params, "attitude"), random.Random(2), 0.0, (0.0,) * 5
    for k in range(1, 300):
        stamp = 10_000 * k
        where = [rng.gauss(0.0, 0.2) for _ in range(3)]
        x, y, z = (rng.gauss(0.0, 30.0) for _ in range(3))
        point = ReferencePoint((z, *still[1:]), still, (x, speed_m_s, 0.0, 0.0, 0.0), (y, *still[1:]))
        command = _step(law, _position(stamp, *where), _attitude(stamp, 0.02 * k), point)
        assert isinstance(command, AttitudeCommand)
        most = max(most, math.acos(math.cos(command.roll_rad) * math.cos(command.pitch_rad)))
    return most


@pytest.mark.parametrize("measurements", MEASUREMENTS)
@pytest.mark.parametrize("speed_m_s", [0.0, 5.0])
def test_at_depth_attitude_the_command_leans_no_more_than_the_limit(measurements: str, speed_m_s: float) -> None:
    """Whatever is asked for, in whatever wind the observer believes to be."""
    params = LawParams(measurements=measurements, limits=LimitParams(tilt_max_deg=30.0))
    assert _largest_lean(params, speed_m_s) == pytest.approx(math.radians(30.0), abs=1e-6)


def test_state_feedback_leans_no_more_than_the_limit() -> None:
    params = LawParams(form="state_feedback", limits=LimitParams(tilt_max_deg=30.0))
    assert _largest_lean(params, 0.0) == pytest.approx(math.radians(30.0), abs=1e-6)


@every_depth
@pytest.mark.parametrize("decoupling", DECOUPLINGS)
def test_the_observer_hears_what_was_realised(depth: Depth, decoupling: str) -> None:
    """Asked for the sky, thrust stops at its ceiling and the observer is told so: no windup in it or in the integrators."""
    law = _begin(LawParams(decoupling=decoupling, limits=LimitParams(thrust_max_g=1.2)), depth)
    active: set[str] = set()
    for k in range(300):
        command = _step(law, _position(10_000 * k), _attitude(10_000 * k), _hold(z=5.0))
        assert law.trace is not None
        active |= set(law.trace.limits_active)
        assert command.specific_thrust_m_s2 <= 1.2 * G + 1e-9
        realised = law.trace.inputs[0] - (G if depth == "attitude" else 0.0)
        assert law.estimator.commands[-1][1][0] == pytest.approx(realised, abs=1e-12)
    assert "climb_speed" in active
    # At depth attitude it is the acceleration aimed at that stops there; elsewhere the drive of the integrators as well.
    assert active & {"thrust", "climb_acceleration"}
    assert command.specific_thrust_m_s2 == pytest.approx(1.2 * G, abs=1e-2)
    assert law.estimator.thrust.value_m_s2 == pytest.approx(1.2 * G, abs=1e-2)
    for k in range(300, 360):
        command = _step(law, _position(10_000 * k), _attitude(10_000 * k), _hold(z=-5.0))
    assert command.specific_thrust_m_s2 < 1.15 * G


def test_a_saturated_roll_is_what_the_observer_hears_of() -> None:
    law = _begin(LawParams(), "rate")
    for k in range(60):
        _step(law, _position(10_000 * k, y=-8.0 * k), _attitude(10_000 * k), _hold())
        assert law.trace is not None
        if "saturation_roll" in law.trace.limits_active:
            break
    roll = law.trace.inputs[2]
    assert abs(roll) < 3.5
    # Level, so that y''' is -T p.
    told = law.estimator.commands[-1][1][3]
    assert told == pytest.approx(-law.command_given.specific_thrust_m_s2 * roll)
    assert abs(told) < 0.9 * abs(law.trace.demanded[3])


# ---------------------------------------------------------------- gaps, and the same again


@every_law
def test_a_gap_of_two_seconds_is_bridged(depth: Depth, measurements: str, decoupling: str, form: str) -> None:
    """At rest at its goal before and after: the vehicle held still, and the law finds nothing to do about it."""
    law = _begin(LawParams(form=form, measurements=measurements, decoupling=decoupling), depth)
    for stamp in (10_000, 20_000, 30_000, 2_030_000, 2_040_000, 4_040_000):
        command = _step(law, _position(stamp), _attitude(stamp), _hold())
        assert _turn(command) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        assert command.specific_thrust_m_s2 == pytest.approx(G, abs=1e-6)


@pytest.mark.parametrize("depth", ["torque", "rate"])
def test_thrust_does_not_go_on_integrating_through_a_gap(depth: Depth) -> None:
    """The vehicle held the last one: 0.1 s of the drive at most, however long nothing was measured."""
    law = _begin(LawParams(), depth)
    for k in range(8):
        before = _step(law, _position(10_000 * k), _attitude(10_000 * k), _hold(z=0.3)).specific_thrust_m_s2
    assert law.trace is not None
    drive = law.trace.inputs[0]
    after = _step(law, _position(3_000_000), _attitude(3_000_000), _hold(z=0.3)).specific_thrust_m_s2
    assert before < after < G + 3.0
    if depth == "rate":
        assert after - before == pytest.approx(0.1 * drive)


@every_law
def test_the_same_input_gives_the_same_bits(depth: Depth, measurements: str, decoupling: str, form: str) -> None:
    params = LawParams(form=form, measurements=measurements, decoupling=decoupling)
    (one, _), (two, _) = (_disturbed(params, depth, 100, seed=2) for _ in range(2))
    assert _memory(one) == _memory(two)
    assert one.trace == two.trace
    assert one.command_given == two.command_given
    assert _random_inputs(_begin(params, depth), 3, 60) == _random_inputs(_begin(params, depth), 3, 60)


def test_the_papers_own_form_is_a_configuration() -> None:
    tune = tuning(LawParams(**PAPER), "torque")
    assert [len(tune.vertical.spec.rows), len(tune.horizontal.spec.rows), len(tune.yaw.spec.rows)] == [1, 1, 1]
    assert tune.constant_gain
    assert (tune.yaw.spec.length, tune.yaw.integrators, tune.vertical.integrators) == (4, 2, 2)
    assert tune.yaw.gammas != tune.vertical.gammas  # a bandwidth of its own


@pytest.mark.parametrize("depth", ["rate", "attitude"])
def test_other_gains_in_flight_change_no_estimate_and_act_at_once(depth: Depth) -> None:
    usual, low = LawParams(), LawParams(omega0_rad_s=1.0, kappa_rad_s=3.0, dead_time_s=0.2)
    law, _ = _disturbed(usual, depth)
    memory, same, other = _memory(law), copy.deepcopy(law), copy.deepcopy(law)
    same.retune(usual)
    other.retune(low)
    assert _memory(other) == memory
    commands = [each.command(lambda _: _hold(x=0.2, y=0.2)) for each in (law, same, other)]
    assert commands[0] == commands[1]
    assert math.hypot(*_turn(commands[2])[:2]) < 0.7 * math.hypot(*_turn(commands[0])[:2])
    assert other.estimator.chains[2].spec == tuning(low, depth).horizontal.spec
