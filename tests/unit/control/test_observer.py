"""The extended observer of one chain: with the paper's one row, and with further rows."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest

from mavquad.control.actuation import advance, interval
from mavquad.control.observer import Chain, ChainSpec, Row, moduli, rows, usable
from mavquad.control.params import LawParams
from mavquad.control.tuning import tuning
from mavquad.types import Depth

NO_INPUT = ((0, (0.0, 0.0, 0.0, 0.0)),)
KAPPAS = {0: 6.0, 1: 9.0, 2: 13.0, 3: 11.0}
SLOPES = (0, 1, 2)
"""Derivatives of the acceleration's offset that are estimated besides."""
ROW_SETS = [(0,), (0, 1), (0, 2), (0, 1, 2), (0, 2, 3), (0, 1, 2, 3)]
"""Indices of the states that are measured: position alone (the paper) up to all of them."""


def _single(length: int, kappa: float = 8.0, powers: tuple[float, ...] = ()) -> ChainSpec:
    return ChainSpec(length, (Row(0, kappa, powers or (1.0,) * (length + 1)),), 0.05)


def _spec(length: int, indices: tuple[int, ...], spread: float = 1.0, slopes: int = 0) -> ChainSpec:
    """Slopes as many as the chain has states for: what they stand for is in those, too."""
    kappas = {i: KAPPAS[i] for i in indices if i < length}
    return ChainSpec(length, rows(length, kappas, spread, {2: min(slopes, length - 2)}), 0.05)


def _truth(start: list[float], time_s: float, index: int = 0) -> float:
    """A state of a chain with a constant disturbance, in closed form."""
    return sum(c * time_s**k / math.factorial(k) for k, c in enumerate(start[index:]))


def _predict(chain: Chain, from_us: int, to_us: int, commands: tuple = NO_INPUT) -> None:
    chain.predict(chain.span(commands, from_us, to_us), 0)


def _update(chain: Chain, from_us: int, to_us: int, measured: float, commands: tuple = NO_INPUT) -> None:
    """The paper's one row."""
    _predict(chain, from_us, to_us, commands)
    chain.correct(0, measured - chain.predicted(0), to_us)


# ---------------------------------------------------------------- one row, the paper's


def _follow(length: int, start: list[float], guess: tuple[float, ...], seed: int, duration_s: float) -> tuple:
    rng = random.Random(seed)
    chain, now = Chain(_single(length), guess, 0), 0
    while now < duration_s * 1e6:
        then = now + rng.choice((4_000, 10_000, 12_000, 36_000))
        _update(chain, now, then, _truth(start, then * 1e-6))
        now = then
    return chain, now


@pytest.mark.parametrize("length", [1, 2, 3, 4])
def test_converges_from_a_grid_of_starts_with_irregular_samples(length: int) -> None:
    start = [0.5, -0.3, 0.2, 0.1, -0.05][: length + 1]
    for signs in itertools.product((-1.0, 1.0), repeat=length + 1):
        chain, now = _follow(length, start, tuple(2.0 * s for s in signs), 3, 6.0)
        assert chain.values[0] == pytest.approx(_truth(start, now * 1e-6), abs=1e-6)
        assert chain.sigma == pytest.approx(start[-1], abs=1e-6)


def test_learns_a_constant_disturbance_beside_a_known_input() -> None:
    commands = ((0, (3.0, 0.0, 0.0, 0.0)), (500_000, (-2.0, 0.0, 0.0, 0.0)))
    truth, lagged = [0.0, 0.0, 0.0, 0.0, 0.7], 0.0
    chain = Chain(_single(4, 10.0, (0.8, 1.0, 1.0, 1.2, 1.5)), (0.1, 0.0, 0.0, 0.0, 0.0), 0)
    for now in range(10_000, 4_000_000, 10_000):
        truth, lagged = advance(truth, lagged, interval(4, 0.05, commands, now - 10_000, now), 0)
        _update(chain, now - 10_000, now, truth[0], commands)
    assert chain.values == pytest.approx(truth, abs=1e-6)
    assert chain.lagged == pytest.approx(lagged)


def test_the_dead_time_shifts_the_input() -> None:
    """The input of 30 ms before acts now."""
    commands = ((0, (0.0,) * 4), (100_000, (5.0,) * 4))
    late = Chain(ChainSpec(2, rows(2, {0: 8.0}, 1.0), 0.0, 30_000), (0.0,) * 3, 0)
    late.predict(late.span(commands, 0, 130_000), 0)
    assert late.values == [0.0, 0.0, 0.0]
    late.predict(late.span(commands, 130_000, 150_000), 0)
    assert late.values == pytest.approx([0.5 * 5.0 * 0.02**2, 5.0 * 0.02, 0.0])


def test_a_second_look_at_the_same_moment_changes_nothing() -> None:
    chain = Chain(_single(4), (1.0, 2.0, 3.0, 4.0, 5.0), 10_000)
    _update(chain, 10_000, 10_000, 1.7)
    assert chain.values == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_an_older_measurement_is_refused() -> None:
    chain = Chain(_single(4), (0.0,) * 5, 10_000)
    assert chain.measured_before(0, 9_999)
    assert chain.measured_before(0, 10_000)
    assert not chain.measured_before(0, 10_001)
    chain.correct(0, 1.0, 9_999)
    assert chain.values == [0.0] * 5
    assert chain.measured_before(0, 10_000)  # what it knows of its latest moment has not gone back either


def test_zero_in_zero_out_and_signs() -> None:
    chain = Chain(_single(4), (0.0,) * 5, 0)
    chain.correct(0, 0.0, 10_000)
    assert chain.values == [0.0] * 5
    chain.correct(0, 1.0, 20_000)
    assert all(v > 0.0 for v in chain.values)


@pytest.mark.parametrize("gap_us", [300_000, 2_000_000])
def test_a_gap_of_a_third_of_a_second_is_bridged(gap_us: int) -> None:
    """And one of two seconds: the prediction is exact, and K of the whole gap leaves it there."""
    start = [0.5, -0.3, 0.2, 0.1, -0.05]
    chain, now = _follow(4, start, (0.0,) * 5, 5, 6.0)
    _update(chain, now, now + gap_us, _truth(start, (now + gap_us) * 1e-6))
    assert chain.values[0] == pytest.approx(_truth(start, (now + gap_us) * 1e-6), abs=1e-5)
    assert chain.sigma == pytest.approx(start[-1], abs=1e-5)


def test_after_a_gap_of_two_seconds_the_measurement_is_believed() -> None:
    """With a wrong estimate: poles of exp(-kappa 2 s) leave nothing of it, and no derivative jumps by more than it must."""
    chain = Chain(_single(4), (1.0, 0.0, 0.0, 0.0, 0.0), 0)
    _update(chain, 0, 2_000_000, 0.0)
    assert chain.values[0] == pytest.approx(0.0, abs=1e-5)
    assert max(abs(v) for v in chain.values) < 10.0


def test_moduli_are_a_geometric_progression_around_one() -> None:
    assert moduli(1, 3.0) == (1.0,)
    assert moduli(3, 2.0) == pytest.approx((0.5, 1.0, 2.0))
    assert math.prod(moduli(4, 1.7)) == pytest.approx(1.0)


# ---------------------------------------------------------------- several rows


def _shape(spec: ChainSpec) -> list[tuple[int, int]]:
    return [(row.index, len(row.moduli)) for row in spec.rows]


def test_the_rows_cut_the_chain_into_stretches() -> None:
    """Each has one modulus more than it has states: that of its offset, or of sigma; and one for each slope of an offset."""
    assert _shape(_spec(4, (0,))) == [(0, 5)]
    assert _shape(_spec(4, (0, 2))) == [(0, 3), (2, 3)]
    assert _shape(_spec(4, (0, 1, 2, 3))) == [(0, 2), (1, 2), (2, 2), (3, 2)]
    assert _shape(_spec(3, (0, 1))) == [(0, 2), (1, 3)]
    assert _shape(_spec(4, (0, 2), slopes=1)) == [(0, 4), (2, 3)]
    assert _shape(_spec(4, (0, 1, 2, 3), slopes=2)) == [(0, 2), (1, 4), (2, 2), (3, 2)]
    assert _shape(_spec(2, (0, 1), slopes=1)) == [(0, 2), (1, 2)]


def _state(chain: Chain) -> list[float]:
    return [*chain.values, *(d for drift in chain.drifts for d in drift)]


def _chain(spec: ChainSpec, state: list[float]) -> Chain:
    """With this state: values, then the disturbances."""
    chain, rest = Chain(spec, tuple(state[: spec.length + 1]), 0), state[spec.length + 1 :]
    for drift in chain.drifts:
        drift[:], rest = rest[: len(drift)], rest[len(drift) :]
    return chain


def _powers(spec: ChainSpec) -> list[int]:
    """Which derivative of the output, by its unit, each number of the state is."""
    drifts = Chain(spec, (0.0,) * (spec.length + 1), 0).drifts
    own = [row.index + k for row, drift in zip(spec.rows[1:], drifts, strict=True) for k in range(len(drift))]
    return [*range(spec.length + 1), *own]


def _error_dynamics(spec: ChainSpec, cycle: list[tuple[int, ...]], dt_us: int) -> np.ndarray:
    """The joint update over one cycle of samples as a matrix, by superposition: what is measured is zero throughout.

    `cycle` has, for each sample, the rows that it measures.
    """
    columns = []
    for unit in np.eye(len(_powers(spec))):
        chain = _chain(spec, list(unit))
        _warm(chain, cycle, dt_us)
        for at, measured in enumerate(cycle, start=len(cycle) + 1):
            _predict(chain, (at - 1) * dt_us, at * dt_us)
            for row in measured:
                chain.correct(row, -chain.predicted(row), at * dt_us)
        columns.append(_state(chain))
    return np.array(columns).T


def _warm(chain: Chain, cycle: list[tuple[int, ...]], dt_us: int) -> None:
    """A cycle of corrections by nothing: only the moments of the last measurements move."""
    for at, measured in enumerate(cycle, start=1):
        for row in measured:
            chain.correct(row, 0.0, at * dt_us)


def _scaled(matrix: np.ndarray, spec: ChainSpec, dt_us: int) -> np.ndarray:
    """In units of h^k of each state: eigenvalues do not care, the computer does."""
    scale = np.diag([(dt_us * 1e-6) ** k for k in _powers(spec)])
    return scale @ matrix @ np.linalg.inv(scale)


def _placed(spec: ChainSpec, cycle: list[tuple[int, ...]], dt_us: int) -> list[float]:
    """What the poles over one cycle should be."""
    return sorted(
        math.exp(-row.kappa_rad_s * modulus * len(cycle) * dt_us * 1e-6)
        for place, row in enumerate(spec.rows)
        if any(place in measured for measured in cycle)
        for modulus in row.moduli
    )


@pytest.mark.parametrize("length", [2, 3, 4])
@pytest.mark.parametrize("indices", ROW_SETS)
@pytest.mark.parametrize("dt_us", [4_000, 20_000])
@pytest.mark.parametrize("slopes", SLOPES)
def test_every_stretch_has_its_own_poles(length: int, indices: tuple[int, ...], dt_us: int, slopes: int) -> None:
    spec = _spec(length, indices, 1.5, slopes)
    cycle = [tuple(range(len(spec.rows)))]
    found = np.linalg.eigvals(_scaled(_error_dynamics(spec, cycle, dt_us), spec, dt_us))
    assert np.abs(found.imag).max() < 1e-5
    assert sorted(found.real) == pytest.approx(_placed(spec, cycle, dt_us), abs=1e-5)


@pytest.mark.parametrize(
    ("depth", "slopes"),
    [
        *(("torque", slopes) for slopes in SLOPES),
        ("rate", 0),
        *(("rate", slopes) for slopes in SLOPES[1:]),
        *(("attitude", slopes) for slopes in SLOPES),
    ],
)
@pytest.mark.parametrize("measurements", ["position_attitude", "full"])
def test_every_configuration_has_the_poles_of_its_stretches(depth: Depth, slopes: int, measurements: str) -> None:
    params = LawParams(measurements=measurements, wind_slopes=slopes, observer_spread=1.5)
    for channel in (tuning(params, depth).horizontal, tuning(params, depth).yaw):
        spec, cycle = channel.spec, [tuple(range(len(channel.spec.rows)))]
        found = np.linalg.eigvals(_scaled(_error_dynamics(spec, cycle, 10_000), spec, 10_000))
        assert sorted(found.real) == pytest.approx(_placed(spec, cycle, 10_000), abs=1e-5)


@pytest.mark.parametrize("length", [3, 4])
@pytest.mark.parametrize("indices", ROW_SETS[2:])
@pytest.mark.parametrize("every", [2, 4])
@pytest.mark.parametrize("slopes", SLOPES)
def test_every_stretch_has_its_own_poles_at_its_own_rate(
    length: int, indices: tuple[int, ...], every: int, slopes: int
) -> None:
    """Rows of the position stream come every so many samples only: poles over the cycle are those of the cycle's time."""
    spec, dt_us = _spec(length, indices, 1.5, slopes), 5_000
    fast = tuple(place for place, row in enumerate(spec.rows) if row.index >= 2)
    cycle = [fast] * (every - 1) + [tuple(range(len(spec.rows)))]
    found = np.linalg.eigvals(_scaled(_error_dynamics(spec, cycle, dt_us), spec, dt_us))
    assert sorted(found.real) == pytest.approx(_placed(spec, cycle, dt_us), abs=1e-5)


@pytest.mark.parametrize("indices", ROW_SETS[1:])
@pytest.mark.parametrize("slopes", SLOPES)
def test_the_errors_are_block_triangular(indices: tuple[int, ...], slopes: int) -> None:
    """What a row sees is disturbed by the rows after it, never by those before: no state of an earlier stretch moves it.

    The states that it shares with their disturbances enter as what the row measures, no otherwise.
    """
    spec, dt_us = _spec(4, indices, slopes=slopes), 10_000
    matrix = _scaled(_error_dynamics(spec, [tuple(range(len(spec.rows)))], dt_us), spec, dt_us)
    units = np.eye(len(_powers(spec)))
    for place, row in enumerate(spec.rows[1:], start=1):
        sees = np.array([_chain(spec, list(unit)).predicted(place) for unit in units])
        sees = sees / np.array([(dt_us * 1e-6) ** k for k in _powers(spec)])
        after = sees @ matrix / np.abs(sees).max()
        assert np.abs(after[: row.index]).max() < 1e-15
        first = sum(len(_chain(spec, list(units[0])).drifts[k]) for k in range(place - 1))
        drift = _chain(spec, list(units[0])).drifts[place - 1]
        for k in range(len(drift)):
            both = after[row.index + k] + after[spec.length + 1 + first + k]
            assert both == pytest.approx(0.0, abs=1e-12)


def _schedule(seed: int, duration_s: float, count: int) -> list[tuple[int, list[int]]]:
    """Irregular moments, each with some of the rows; gaps up to 2 s."""
    rng, now, moments = random.Random(seed), 0, []
    while now < duration_s * 1e6:
        now += rng.choice((2_000, 4_000, 10_000, 10_000, 36_000, 400_000 if rng.random() < 0.02 else 10_000))
        if rng.random() < 0.003:
            now += 2_000_000
        moments.append((now, [row for row in range(count) if rng.random() < 0.6]))
    return moments


@pytest.mark.parametrize("indices", ROW_SETS)
@pytest.mark.parametrize(("seed", "slopes"), [(1, 0), (2, 0), (3, 1), (4, 2)])
def test_random_schedules_converge_with_every_offset_found(indices: tuple[int, ...], seed: int, slopes: int) -> None:
    spec = _spec(4, indices, slopes=slopes)
    offsets = [0.0, 0.4, -1.5, 2.5][: len(spec.rows)]
    start = [0.5, -0.3, 0.02, 0.001, -0.0002]
    chain, now = Chain(spec, (-1.0, 1.0, 1.0, -1.0, 1.0), 0), 0
    for then, measured in _schedule(seed, 20.0, len(spec.rows)):
        _predict(chain, now, then)
        now = then
        for row in measured:
            value = _truth(start, now * 1e-6, spec.rows[row].index) - offsets[row]
            chain.correct(row, value - chain.predicted(row), now)
    assert chain.values == pytest.approx([_truth(start, now * 1e-6, k) for k in range(5)], abs=1e-4)
    assert [chain.offset(row) for row in range(len(offsets))] == pytest.approx(offsets, abs=1e-3)


@pytest.mark.parametrize("indices", [(0, 2), (0, 1, 2), (0, 2, 3), (0, 1, 2, 3)])
@pytest.mark.parametrize("slopes", SLOPES)
def test_an_offset_that_grows_is_followed_where_its_slope_is_estimated(indices: tuple[int, ...], slopes: int) -> None:
    """At rest, in a wind that grows by 0.5 m/s^3 and is held: with a slope the place is exact; without, it is drawn off."""
    spec = _spec(4, indices, slopes=slopes)
    chain, slope = Chain(spec, (0.0,) * 5, 0), 0.5
    for now in range(10_000, 8_000_000, 10_000):
        _predict(chain, now - 10_000, now)
        for place, row in enumerate(spec.rows):
            said = {2: slope * now * 1e-6, 3: slope}.get(row.index, 0.0)
            chain.correct(place, said - chain.predicted(place), now)
    if slopes:
        assert chain.values == pytest.approx([0.0] * 5, abs=1e-4)
        assert chain.offset(indices.index(2)) == pytest.approx(-slope * now * 1e-6, abs=1e-4)
    else:
        assert max(map(abs, chain.values[:3])) > 1e-3


@pytest.mark.parametrize("indices", ROW_SETS)
def test_a_disturbance_beside_every_row_leaves_no_steady_error(indices: tuple[int, ...]) -> None:
    """At rest, each further row tells something constant and wrong: the place is found, and what is wrong named."""
    spec = _spec(4, indices)
    wrong = [0.0, -0.7, 0.8, 5.0][: len(spec.rows)]
    chain = Chain(spec, (0.3, 0.0, 0.0, 0.0, 0.0), 0)
    for now in range(10_000, 10_000_000, 10_000):
        _predict(chain, now - 10_000, now)
        for row, said in enumerate(wrong):
            chain.correct(row, said - chain.predicted(row), now)
    assert chain.values == pytest.approx([0.0] * 5, abs=1e-6)
    assert [chain.offset(row) for row in range(len(wrong))] == pytest.approx([-w for w in wrong], abs=1e-6)


@pytest.mark.parametrize("slopes", SLOPES)
def test_what_a_row_learns_of_the_next_does_not_change_what_that_one_predicts(slopes: int) -> None:
    chain = Chain(_spec(4, (0, 2, 3), slopes=slopes), (0.0, 0.0, 1.0, 0.5, 0.0), 0)
    chain.drifts[0][0] = 0.3
    before, states = [chain.predicted(row) for row in (1, 2)], list(chain.values)
    chain.correct(0, 0.25, 10_000)
    assert [chain.predicted(row) for row in (1, 2)] == pytest.approx(before, abs=1e-12)
    assert chain.values[:3] != pytest.approx(states[:3])
    assert (chain.values[3:] == states[3:]) == (slopes == 0)  # those belong to the next stretch, but for the slopes


def test_a_little_earlier_the_row_would_have_measured_this() -> None:
    """A late measurement is held against the estimate of its own moment."""
    start = [0.5, -0.3, 0.2, 0.1, -0.05]
    chain = Chain(_spec(4, (0, 2)), tuple(_truth(start, 1.0, k) for k in range(5)), 0)
    chain.drifts[0][0] = 0.3
    # The input and sigma are left out of it: 30 ms of a snap of 0.05 are nothing.
    assert chain.predicted(0, 30_000) == pytest.approx(_truth(start, 0.97), abs=1e-7)
    assert chain.predicted(1, 30_000) == pytest.approx(_truth(start, 0.97, 2) - 0.3, abs=1e-4)
    assert chain.predicted(0) != chain.predicted(0, 30_000)


def test_what_is_too_late_to_be_of_use() -> None:
    assert usable(1_000_000, 900_000)
    assert usable(900_000, 1_000_000)
    assert not usable(899_999, 1_000_000)
