"""Margins of the linear loop: closed forms, published figures of the ideal loop, and what margins promise."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavquad.analysis.loop import closed_loop
from mavquad.analysis.loop_spec import KINDS, Kind, LoopSpec, Noise, Path, beat, loop_spec
from mavquad.analysis.margins import DELAY_MAX_S, is_stable, margins, spectral_radius
from mavquad.analysis.noise_gain import noise_gain
from mavquad.control.params import LawParams
from mavquad.protocol.streams import StreamParams
from mavquad.types import Depth

FAST = StreamParams(position_hz=500.0, attitude_hz=500.0)
USUAL = StreamParams()
IDEAL = {
    "delay_s": 0.0,
    "lag_s": 0.0,
    "dead_time_s": 0.0,
    "thrust_lag_s": 0.0,
    "yaw_lag_s": 0.0,
    "yaw_dead_time_s": 0.0,
}


OMEGA0 = 2.5


def ideal(depth: str, **law: object) -> LawParams:
    return LawParams(depth=depth, measurements="position_yaw", observer_spread=1.0, omega0_rad_s=OMEGA0, **IDEAL, **law)


@pytest.mark.parametrize(
    ("depth", "ratio", "delay_ms"),
    [
        ("torque", 5, 126), ("torque", 10, 117), ("torque", 20, 101),
        ("rate", 5, 186), ("rate", 10, 154), ("rate", 20, 118),
        ("attitude", 5, 264), ("attitude", 10, 192), ("attitude", 20, 127),
    ],
)  # fmt: skip
def test_delay_margin_of_the_ideal_loop(depth: str, ratio: int, delay_ms: float) -> None:
    found = margins(loop_spec(ideal(depth, kappa_rad_s=ratio * OMEGA0), depth, "horizontal", FAST))
    assert found.delay_s * OMEGA0 * 1e3 == pytest.approx(delay_ms, rel=0.02)
    assert found.delay_from_phase_s == pytest.approx(found.delay_s, rel=0.01)


@pytest.mark.parametrize(("ratio", "phase_deg"), [(5, 18), (10, 26), (20, 35)])
def test_phase_margin_of_the_ideal_loop(ratio: int, phase_deg: float) -> None:
    found = margins(loop_spec(ideal("torque", kappa_rad_s=ratio * OMEGA0), "torque", "horizontal", FAST))
    assert found.phase_deg == pytest.approx(phase_deg, abs=0.6)


def test_double_integrator_in_closed_form() -> None:
    """State feedback, L = (2 s + 1) / s^2 in units of omega0: |L| = 1 at w^2 = 2 + sqrt 5, with phase margin atan 2 w."""
    found = margins(loop_spec(ideal("attitude", form="state_feedback"), "attitude", "horizontal", FAST))
    crossover = math.sqrt(2.0 + math.sqrt(5.0))
    phase = math.atan(2.0 * crossover)
    assert found.crossover_rad_s == pytest.approx(crossover * OMEGA0, rel=2e-3)
    assert found.phase_deg == pytest.approx(math.degrees(phase), rel=5e-3)
    assert found.delay_s == pytest.approx(phase / crossover / OMEGA0, rel=0.01)
    assert found.peak == pytest.approx(1.0, abs=0.01)
    assert found.gain_low == 0.0


def test_first_order_loop_in_closed_form() -> None:
    """x+ = x - g h (x + v): var x = g h / (2 - g h) var v, unstable from a gain of 2 / (g h) on."""
    law = ideal("rate", form="state_feedback", yaw_omega0_rad_s=2.0)
    spec = loop_spec(law, "rate", "yaw", USUAL, noise=Noise(angle_rad=0.01))
    step = 2.0 * 0.01
    gain = noise_gain(spec)
    assert gain.output == pytest.approx(0.01 * math.sqrt(step / (2.0 - step)), rel=1e-9)
    assert gain.command == pytest.approx(2.0 * 0.01 * math.sqrt(1.0 + step / (2.0 - step)), rel=1e-9)
    found = margins(spec)
    assert found.gain_high == pytest.approx(2.0 / step, rel=1e-3)
    assert found.slowest_s == pytest.approx(-0.01 / math.log(1.0 - step), rel=1e-9)
    assert found.eigenvalues[0] == pytest.approx(1.0 - step)


def test_observer_poles_are_those_of_the_closed_loop() -> None:
    """With the true delay told to the law the prediction is exact, and the observer's poles are placed where they are said."""
    law = LawParams(measurements="full", velocity_kappa_rad_s=7.0, rates_kappa_rad_s=21.0)
    spec = loop_spec(law, "torque", "horizontal", USUAL)
    moduli = [abs(value) for value in margins(spec).eigenvalues]
    for kappa, count in ((7.0, 2), (21.0, 2)):
        near = [m for m in moduli if abs(m - math.exp(-kappa * 0.01)) < 1e-5]
        assert len(near) >= count


GAINS = st.fixed_dictionaries(
    {
        "omega0_rad_s": st.floats(0.5, 4.0),
        "kappa_rad_s": st.floats(4.5, 20.0),
        "attitude_kappa_rad_s": st.floats(3.0, 25.0),
        "delay_s": st.sampled_from([0.0, 0.008, 0.025, 0.04]),
    }
)
SETS = st.sampled_from(["position_yaw", "position_attitude", "full"])
DEPTHS = st.sampled_from(["torque", "rate", "attitude"])
STREAMS = st.sampled_from([USUAL, StreamParams(position_hz=50.0, attitude_hz=100.0)])


@settings(max_examples=30, deadline=None, derandomize=True)
@given(gains=GAINS, measured=SETS, depth=DEPTHS, kind=st.sampled_from(KINDS), streams=STREAMS)
def test_margins_are_where_stability_ends(
    gains: dict, measured: str, depth: str, kind: str, streams: StreamParams
) -> None:
    spec = loop_spec(LawParams(measurements=measured, **gains), depth, kind, streams)
    found = margins(spec)
    assert found.stable == (spectral_radius(closed_loop(spec).a) < 1.0)
    if not found.stable:
        assert (found.phase_deg, found.delay_s, found.gain_low, found.gain_high) == (0.0, 0.0, 1.0, 1.0)
        assert math.isinf(found.peak)
        return
    assert is_stable(spec, 0.97 * found.delay_s)
    if found.delay_s < DELAY_MAX_S:
        assert not is_stable(spec, 1.03 * found.delay_s + 2e-4)
    if found.gain_high < 20.0:
        assert is_stable(spec, gain=1.0 + 0.97 * (found.gain_high - 1.0))
        assert not is_stable(spec, gain=1.0 + 1.03 * (found.gain_high - 1.0))
    if found.gain_low > 0.02:
        assert is_stable(spec, gain=1.0 - 0.97 * (1.0 - found.gain_low))
        assert not is_stable(spec, gain=1.0 - 1.03 * (1.0 - found.gain_low))
    # |1 + L| >= 1 / Ms bounds the others (Astrom and Murray, Feedback Systems, section 10.3).
    bound = 1.0 / found.peak
    assert math.radians(found.phase_deg) >= 2.0 * math.asin(min(1.0, 0.5 * bound)) * 0.98
    assert found.gain_low <= 1.0 / (1.0 + bound) * 1.02
    if bound < 0.98:
        assert found.gain_high >= 1.0 / (1.0 - bound) * 0.98


@settings(max_examples=15, deadline=None, derandomize=True)
@given(gains=GAINS, measured=SETS, depth=DEPTHS, kind=st.sampled_from(KINDS))
def test_two_ticks_to_a_beat_are_the_same_loop(gains: dict, measured: str, depth: str, kind: str) -> None:
    """At one rate, the loop over two ticks is the square of the loop over one, and has the same margins."""
    spec = loop_spec(LawParams(measurements=measured, **gains), depth, kind, USUAL)
    double = replace(spec, beat=replace(spec.beat, ticks=2))
    one, two = margins(spec), margins(double)
    assert two.stable == one.stable
    if one.stable:
        assert two.slowest_s == pytest.approx(one.slowest_s, rel=1e-3)
        assert two.phase_deg == pytest.approx(one.phase_deg, rel=0.02)
        assert two.gain_high == pytest.approx(one.gain_high, rel=0.02)
        assert two.peak == pytest.approx(one.peak, rel=0.02)
        a, b = noise_gain(spec), noise_gain(double)
        assert (b.output, b.command, b.physical) == pytest.approx((a.output, a.command, a.physical), rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_gain_is_linear_in_the_noise(kind: str) -> None:
    law = LawParams()
    once = noise_gain(loop_spec(law, "torque", kind, USUAL))
    twice = noise_gain(loop_spec(law, "torque", kind, USUAL, noise=Noise(0.006, 0.02, math.radians(0.2), 0.02)))
    assert twice.output == pytest.approx(2.0 * once.output)
    assert twice.physical == pytest.approx(2.0 * once.physical)


def test_an_unstable_loop_has_no_noise_gain() -> None:
    spec = _late(loop_spec(LawParams(), "torque", "horizontal", USUAL), 0.2)
    assert not margins(spec).stable
    with pytest.raises(ValueError, match="no steady state"):
        noise_gain(spec)


def _late(spec: LoopSpec, more_s: float) -> LoopSpec:
    return replace(spec, path=Path(spec.path.delay_s + more_s, spec.path.dead_time_s, spec.path.lag_s))


def test_more_delay_than_the_law_is_told_is_what_the_margin_is_spent_on() -> None:
    spec = loop_spec(LawParams(), "rate", "horizontal", USUAL)
    before, after = margins(spec), margins(_late(spec, 0.02))
    assert after.delay_s == pytest.approx(before.delay_s - 0.02, rel=0.03)


def test_the_clock_of_each_channel() -> None:
    slow = StreamParams(position_hz=50.0, attitude_hz=200.0)
    assert (beat("vertical", True, slow).tick_us, beat("vertical", True, slow).ticks) == (5_000, 4)
    assert (beat("vertical", True, slow).command_every, beat("vertical", True, slow).output_every) == (1, 4)
    assert beat("yaw", True, slow).ticks == 1
    assert (beat("vertical", False, slow).tick_us, beat("vertical", False, slow).ticks) == (20_000, 1)
    yaw = beat("yaw", False, slow)
    assert (yaw.tick_us, yaw.ticks, yaw.command_every, yaw.output_every) == (5_000, 4, 4, 1)
    yaw = beat("yaw", False, StreamParams(position_hz=200.0, attitude_hz=50.0))
    assert (yaw.tick_us, yaw.ticks, yaw.command_every, yaw.output_every) == (5_000, 4, 1, 4)


@pytest.mark.parametrize("depth", ["torque", "rate", "attitude"])
@pytest.mark.parametrize("kind", KINDS)
def test_state_feedback_has_wider_margins_than_output_feedback(depth: Depth, kind: Kind) -> None:
    """No observer stands between the measurement and the law, and none of its disturbances is a state."""
    yardstick, ours = (
        margins(loop_spec(LawParams(depth=depth, form=form), depth, kind, USUAL))
        for form in ("state_feedback", "output_feedback")
    )
    assert yardstick.stable
    assert yardstick.peak < ours.peak
    assert yardstick.phase_deg > ours.phase_deg
