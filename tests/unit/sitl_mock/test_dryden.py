"""Dryden's gusts against the spectra and scales of MIL-F-8785C, low altitude."""

import math

import numpy as np
import pytest
from scipy import signal

from sitl_mock.dryden import Dryden
from sitl_mock.plant import VehicleState

DT_S = 0.02
SPEED = 20.0
# 30 m are 98.425 ft: 0.177 + 0.000823 h = 0.2580038
SCALE_M, SIZE = 30.0 / 0.2580038**1.2, 0.2580038**-0.4


def gusts(steps=300_000, seed=1, height_m=30.0, speed=SPEED, steady=(0.0, 0.0, 0.0), sd=1.0, dt_s=DT_S):
    """Of a vehicle that flies east."""
    vehicle = VehicleState((0.0, 0.0, -height_m), (0.0, speed, 0.0))
    wind = Dryden(steady, sd, seed, dt_s)
    return np.array([wind.step(vehicle) for _ in range(steps)])


@pytest.fixture(scope="module")
def long():
    return gusts()


def test_sizes(long):
    # 300 to 1500 memories: 5 %
    assert long.std(axis=0) == pytest.approx([SIZE, SIZE, 1.0], rel=0.07)
    assert long.mean(axis=0) == pytest.approx([0.0] * 3, abs=0.25)
    assert np.corrcoef(long.T) == pytest.approx(np.eye(3), abs=0.12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_spectra(long, axis):
    """One-sided densities in (m/s)^2/Hz: 4 s^2 T / (1 + x^2) along, 2 s^2 T (1 + 3 x^2) / (1 + x^2)^2 across, down."""
    hz, density = signal.welch(long[:, axis], 1 / DT_S, nperseg=1 << 14)
    memory_s, sd = (30.0 / SPEED, 1.0) if axis == 2 else (SCALE_M / SPEED, SIZE)
    x = 2 * math.pi * hz * memory_s
    along, across = 4 * memory_s / (1 + x**2), 2 * memory_s * (1 + 3 * x**2) / (1 + x**2) ** 2
    expected = sd**2 * (along if axis == 0 else across)
    for low, high in [(0.01, 0.05), (0.05, 0.2), (0.2, 1.0), (1.0, 4.0)]:
        band = (hz >= low) & (hz < high)
        assert density[band].mean() == pytest.approx(expected[band].mean(), rel=0.15), (low, high)


def test_stronger_sideways_near_the_ground():
    def ratio(height_m):
        found = gusts(100_000, height_m=height_m, speed=40.0).std(axis=0)
        return found[0] / found[2]

    assert ratio(1.0) == pytest.approx((0.177 + 0.000823 * 10) ** -0.4, rel=0.1)  # as at 10 ft
    assert ratio(300.0) == pytest.approx((0.177 + 0.000823 * 984) ** -0.4, rel=0.35)


def test_along_is_the_way_the_wind_blows():
    """The gusts along change more slowly at low frequencies than those across: to the east here."""
    wind = gusts(100_000, steady=(0.0, 10.0, 0.0), speed=-10.0)
    across, along, _ = (np.correlate(part, part, "full") for part in (wind - wind.mean(axis=0)).T[:, ::50])
    middle = len(across) // 2
    lag = round(SCALE_M / 20.0 / DT_S / 50)
    assert along[middle + lag] / along[middle] > across[middle + lag] / across[middle] + 0.1
    assert wind.mean(axis=0) == pytest.approx([0.0, 10.0, 0.0], abs=0.4)


def test_it_starts_as_it_goes_on():
    first = np.array([gusts(1, seed, dt_s=0.004)[0] for seed in range(600)])
    assert first.std(axis=0) == pytest.approx([SIZE, SIZE, 1.0], rel=0.1)


def test_a_hover_in_calm_air_has_slow_gusts():
    # 10 ft and 1 m/s at least: 3 s for the vertical ones
    slow = gusts(100_000, height_m=0.0, speed=0.0, dt_s=0.1)[:, 2]
    lag = 30  # one memory of them: exp(-1) (1 - 1/2)
    assert np.corrcoef(slow[:-lag], slow[lag:])[0, 1] == pytest.approx(0.5 * math.exp(-1), abs=0.06)


def test_the_same_seed_the_same_gusts():
    assert np.array_equal(gusts(1000, seed=4), gusts(1000, seed=4))
    assert not np.array_equal(gusts(1000, seed=4), gusts(1000, seed=5))
