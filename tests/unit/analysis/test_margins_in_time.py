"""The linear loop against the real controller on a vehicle of its own, sample by sample."""

from dataclasses import replace

import numpy as np
import pytest

from mavquad.analysis.loop import closed_loop
from mavquad.analysis.loop_spec import KINDS, LoopSpec, Path, loop_spec
from mavquad.analysis.margins import margins, spectral_radius
from mavquad.analysis.noise_gain import noise_gain
from mavquad.control.params import LawParams
from mavquad.protocol.streams import StreamParams
from tests.unit.analysis.level_flight import SMALL, response

USUAL = StreamParams()
CASES = [
    (depth, measured)
    for depth in ("torque", "rate", "attitude")
    for measured in ("position_yaw", "position_attitude", "full")
]


def law_of(measured: str, **more: object) -> LawParams:
    return LawParams(measurements=measured, friction_1_s=0.0, angular_friction_1_s=0.0, **more)


def specs_of(law: LawParams, depth: str, streams: StreamParams = USUAL, late_s: float = 0.0) -> dict[str, LoopSpec]:
    specs = {kind: loop_spec(law, depth, kind, streams) for kind in KINDS}
    return {k: replace(s, path=replace(s.path, delay_s=s.path.delay_s + late_s)) for k, s in specs.items()}


def paths_of(specs: dict[str, LoopSpec]) -> dict[str, Path]:
    return {kind: spec.path for kind, spec in specs.items()}


def by_matrices(spec: LoopSpec, ticks: int, gain: float = 1.0) -> np.ndarray:
    """The plant's output from the start that the flight has: off by `SMALL`, and the observer knows it."""
    loop = closed_loop(spec)
    a = loop.with_gain(gain)
    x = np.zeros(len(a))
    x[0] = x[spec.plant_length + 1] = SMALL
    found = []
    for _ in range(ticks // spec.beat.ticks):
        found.append(loop.outputs[0, : len(a)] @ x)
        x = a @ x
    return np.array(found)


def assert_alike(flown: list[float], found: np.ndarray, ticks: int, within: float) -> None:
    picked = np.array(flown)[::ticks]
    assert np.abs(picked - found).max() < within * np.abs(found).max()


@pytest.mark.parametrize(("depth", "measured"), CASES)
@pytest.mark.parametrize("late_s", [0.0, 0.05])
def test_matrices_move_as_the_controller_does(depth: str, measured: str, late_s: float) -> None:
    law = law_of(measured)
    specs = specs_of(law, depth, late_s=late_s)
    flown = response(law, depth, paths_of(specs), 250)
    for kind, spec in specs.items():
        # At depth attitude the first turn of yaw is over the whole delay, in the controller's own clock.
        within = 0.03 if kind == "yaw" and depth == "attitude" else 1e-4
        assert_alike(flown[kind], by_matrices(spec, 250), 1, within)


@pytest.mark.parametrize(("depth", "measured"), CASES)
def test_positions_at_half_the_rate_of_attitudes(depth: str, measured: str) -> None:
    law = law_of(measured)
    # A delay that the law is not told of: without one nothing is ever corrected, and no rate of corrections would show.
    specs = specs_of(law, depth, StreamParams(position_hz=50.0, attitude_hz=100.0), late_s=0.03)
    flown = response(law, depth, paths_of(specs), 250, position_every=2)
    for kind, spec in specs.items():
        if kind == "yaw" and depth == "attitude":
            continue
        each = 1 if spec.beat.tick_us == 10_000 else 2
        assert_alike(flown[kind], by_matrices(spec, 250 // each), each * spec.beat.ticks, 1e-4)


@pytest.mark.parametrize("kind", ["vertical", "horizontal"])
@pytest.mark.parametrize("measured", ["position_yaw", "full"])
def test_a_plant_with_another_gain(kind: str, measured: str) -> None:
    law = law_of(measured)
    specs = specs_of(law, "torque")
    flown = response(law, "torque", paths_of(specs), 250, gains={kind: 0.8})
    assert_alike(flown[kind], by_matrices(specs[kind], 250, 0.8), 1, 1e-4)


@pytest.mark.parametrize("kind", ["vertical", "horizontal"])
@pytest.mark.parametrize(("depth", "measured"), [c for c in CASES if c[0] != "attitude"])
def test_what_is_called_stable_converges_and_what_is_not_diverges(depth: str, measured: str, kind: str) -> None:
    law = law_of(measured)
    spec = specs_of(law, depth)[kind]
    margin_s = margins(spec).delay_s
    for late_s, diverges in ((0.7 * margin_s, False), (1.7 * margin_s, True)):
        late = replace(spec, path=replace(spec.path, delay_s=spec.path.delay_s + late_s))
        paths = paths_of(specs_of(law, depth)) | {kind: late.path}
        flown = np.abs(response(law, depth, paths, 700)[kind])
        assert (spectral_radius(closed_loop(late).a) > 1.0) == diverges
        assert (flown[-150:].max() > 1.5 * flown[200:350].max()) == diverges
        assert (flown[-150:].max() < 0.7 * flown[200:350].max()) == (not diverges)


@pytest.mark.parametrize("depth", ["torque", "rate"])
def test_noise_in_flight_is_what_the_covariance_says(depth: str) -> None:
    law = law_of("full")
    specs = specs_of(law, depth)
    scale = 1e-5
    flown = response(
        law, depth, paths_of(specs), 3000,
        noise=tuple(scale * n for n in (0.003, 0.01, np.radians(0.1), 0.01)), start=0.0,
    )  # fmt: skip
    for kind in ("vertical", "horizontal", "yaw"):
        rms = np.sqrt(np.mean(np.square(flown[kind][500:])))
        assert rms == pytest.approx(scale * noise_gain(specs[kind]).output, rel=0.3)
