"""The impaired link: delay, jitter, loss, order and determinism, around an endpoint that echoes."""

import itertools
import statistics

import pytest

from mavquad.endpoint import GRID_US, NEVER_US, advance
from sitl_mock.autopilot import MockAutopilot
from sitl_mock.config import MockConfig
from sitl_mock.faults import ImpairedLink
from tests.unit.sitl_mock.echo import STEP_US, exchange, number


def test_latency_each_way():
    echo, back = exchange(100, latency_ms=10.0)
    assert [stamp - number(data) * STEP_US for stamp, data in echo.inputs] == [10_000] * 100
    assert [stamp - number(data) * STEP_US for stamp, data in back] == [20_000] * 100


def test_no_latency_is_at_once():
    _, back = exchange(10, latency_ms=0.0)
    assert [(stamp, number(data)) for stamp, data in back] == [(k * STEP_US, k) for k in range(1, 11)]


def test_jitter_is_uniform_and_reorders():
    echo, _ = exchange(3000, latency_ms=5.0, jitter_ms=40.0)
    delays_ms = [(stamp - number(data) * STEP_US) / 1000 for stamp, data in echo.inputs]
    assert min(delays_ms) >= 5.0 - 0.004
    assert max(delays_ms) <= 45.0 + 0.1
    assert statistics.fmean(delays_ms) == pytest.approx(25.0, abs=0.7)
    order = [number(data) for _, data in echo.inputs]
    assert order != sorted(order)
    assert sorted(order) == list(range(1, 3001))


def test_loss_each_way():
    echo, back = exchange(5000, latency_ms=1.0, loss=0.2)
    assert len(echo.inputs) / 5000 == pytest.approx(0.8, abs=0.02)
    assert len(back) / len(echo.inputs) == pytest.approx(0.8, abs=0.02)
    assert exchange(50, loss=1.0)[1] == []


def test_same_seed_same_fate():
    impaired = {"latency_ms": 5.0, "jitter_ms": 20.0, "loss": 0.1}
    assert exchange(500, **impaired)[1] == exchange(500, **impaired)[1]
    assert exchange(500, **impaired)[1] != exchange(500, seed=2, **impaired)[1]


def test_inner_inputs_have_strictly_increasing_stamps_on_the_grid():
    # many frames within a jitter of few grid steps collide
    echo, back = exchange(2000, spacing_us=4, latency_ms=0.1, jitter_ms=0.02)
    stamps = [stamp for stamp, _ in echo.inputs]
    assert len(stamps) == 2000
    assert all(b > a for a, b in itertools.pairwise(stamps))
    assert all(stamp % GRID_US == 0 for stamp in stamps)
    assert all(stamp % GRID_US == 0 for stamp, _ in back)


def test_inner_deadlines_fire_at_their_own_time():
    echo, _ = exchange(100, latency_ms=7.0)
    assert echo.ticks == list(range(4000, 4000 * (len(echo.ticks) + 1), 4000))


def test_a_dead_endpoint_behind_it_waits_for_nothing():
    config = MockConfig.model_validate({"faults": ({"kind": "die", "at_s": 0.5},)})
    impaired = ImpairedLink(MockAutopilot(config, 1, 0), config.link, 1)
    last = max(stamp for stamp, _ in advance(impaired, 3_000_000))
    assert 0.48e6 < last <= 0.52e6
    assert impaired.next_deadline_us() == NEVER_US


def test_through_the_link_telemetry_is_late_by_its_latency():
    config = MockConfig()
    plain = list(advance(MockAutopilot(config, 1, 0), 1_000_000))
    late = list(advance(ImpairedLink(MockAutopilot(config, 1, 0), config.link, 1), 1_010_000))
    assert late == [(stamp + 10_000, frame) for stamp, frame in plain]
