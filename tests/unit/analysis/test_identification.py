"""Known truth: dead time, lag and gain come back; without excitation there is a reason instead."""

import numpy as np
import pytest

from mavquad.analysis.identification import AxisFit, Refused, Signal, identify
from mavquad.analysis.identification_model import LaggedCommand
from mavquad.analysis.identification_windows import NO_FILTER, Projection, Windows, cut

SECONDS = 30.0
WHOLE = [(0.0, SECONDS)]
GAIN = {"static": 1.05, "integrating": 113.0}
NOISE = {"static": 0.02, "integrating": 0.02}


def truth(kind, dead_s, lag_s, seed, noise=None, seconds=SECONDS, answer_hz=100.0):
    """Random steps of 0.25 s, sent with jitter; white noise, an offset and a drift on the answer."""
    rng = np.random.default_rng(seed)
    sent_s = np.arange(0.0, seconds, 0.01) + rng.uniform(0.0, 0.004, round(seconds * 100))
    steps = np.repeat(rng.normal(0.0, 0.3 if kind == "static" else 0.05, round(seconds * 4)), 25)
    model = LaggedCommand(sent_s, steps, lag_s)
    times_s = np.arange(0.3, seconds, 1.0 / answer_hz)
    clean = GAIN[kind] * (model.at if kind == "static" else model.integral)(times_s - dead_s)
    sd = NOISE[kind] if noise is None else noise
    answer = clean + 0.1 + 0.02 * times_s + rng.normal(0.0, sd, len(times_s))
    return Signal(sent_s, steps), Signal(times_s, answer)


def fitted(result) -> AxisFit:
    assert isinstance(result, AxisFit), result
    return result


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("dead_s", "lag_s"), [(0.012, 0.03), (0.04, 0.06), (0.16, 0.24)])
@pytest.mark.parametrize("kind", ["static", "integrating"])
def test_it_finds_what_is_there(kind, dead_s, lag_s, seed) -> None:
    fit = fitted(identify(*truth(kind, dead_s, lag_s, seed), WHOLE, kind))
    assert fit.dead_s.value == pytest.approx(dead_s, abs=0.003)
    assert fit.lag_s.value == pytest.approx(lag_s, rel=0.05)
    assert fit.total_s.value == pytest.approx(dead_s + lag_s, rel=0.04)
    assert fit.gain.value == pytest.approx(GAIN[kind], rel=0.03)
    assert fit.explained > 0.9


def test_a_plant_without_lag() -> None:
    fit = fitted(identify(*truth("static", 0.05, 0.0, 1), WHOLE, "static"))
    assert fit.dead_s.value == pytest.approx(0.05, abs=0.003)
    assert fit.lag_s.value < 0.003


def test_damping_is_told_from_the_gain() -> None:
    command, answer = truth("integrating", 0.02, 0.05, 1, noise=0.0)
    damped = np.zeros(len(answer.values))
    drive = np.diff(answer.values - 0.1 - 0.02 * answer.times_s)
    for k, step in enumerate(drive):  # y' = drive - 2 y, exactly over 10 ms but for the drive's shape within it
        damped[k + 1] = damped[k] * np.exp(-0.02) + step * (1.0 - np.exp(-0.02)) / 0.02
    noisy = damped + np.random.default_rng(5).normal(0.0, 0.02, len(damped))
    fit = fitted(identify(command, Signal(answer.times_s, noisy), WHOLE, "integrating"))
    assert fit.damping_1_s is not None
    assert fit.damping_1_s.value == pytest.approx(2.0, abs=0.1)
    assert fit.gain.value == pytest.approx(113.0, rel=0.02)
    assert fit.lag_s.value == pytest.approx(0.05, rel=0.05)


def test_errors_are_of_the_size_of_the_errors() -> None:
    fits = [fitted(identify(*truth("static", 0.04, 0.06, seed, noise=0.1), WHOLE, "static")) for seed in range(12)]
    for name, value in (("dead_s", 0.04), ("lag_s", 0.06), ("total_s", 0.1), ("gain", 1.05)):
        estimates = [getattr(fit, name) for fit in fits]
        in_errors = [(estimate.value - value) / estimate.error for estimate in estimates]
        assert 0.4 < np.sqrt(np.mean(np.square(in_errors))) < 1.8, name


def closed_loop(seed: int):
    """The command answers the disturbance: u = reference - 3 (answer 30 ms ago), the disturbance coloured (0.3 s)."""
    rng = np.random.default_rng(seed)
    reference = np.repeat(rng.normal(0.0, 0.15, 120), 25)
    times_s = np.arange(3000) * 0.01
    colour = np.exp(-0.01 / 0.3)
    disturbance = state = 0.0
    commands, answers = np.zeros(3000), np.zeros(3000)
    for k in range(3000):
        disturbance = colour * disturbance + rng.normal(0.0, 0.01)
        past = commands[k - 4] if k >= 4 else 0.0
        state = past + (state - past) * np.exp(-0.01 / 0.06)
        answers[k] = state + disturbance
        commands[k] = reference[k] - 0.8 * (answers[k - 3] + rng.normal(0.0, 0.01) if k >= 3 else 0.0)
    return Signal(times_s, commands), Signal(times_s, answers + rng.normal(0.0, 0.01, 3000))


def test_feedback_of_the_disturbance_does_not_mislead_it() -> None:
    # The state at k holds the command of k - 4 over the step that ends there: in force from 30 ms after it was sent.
    fits = [fitted(identify(*closed_loop(seed), WHOLE, "static")) for seed in range(6)]
    assert np.mean([fit.dead_s.value for fit in fits]) == pytest.approx(0.03, abs=0.001)
    assert np.mean([fit.lag_s.value for fit in fits]) == pytest.approx(0.06, rel=0.05)
    assert np.mean([fit.gain.value for fit in fits]) == pytest.approx(1.0, rel=0.03)


def test_gaps_and_stretches_apart() -> None:
    command, answer = truth("static", 0.04, 0.06, 3, seconds=60.0)
    kept = np.random.default_rng(1).uniform(size=len(answer.times_s)) > 0.2
    kept &= (answer.times_s < 20.0) | (answer.times_s > 21.5)
    spoilt = np.where((answer.times_s > 35.0) & (answer.times_s < 45.0), 7.0 * np.sin(answer.times_s), answer.values)
    holes = Signal(answer.times_s[kept], spoilt[kept])
    fit = fitted(identify(command, holes, [(0.5, 35.0), (45.5, 59.0)], "static"))
    assert fit.dead_s.value == pytest.approx(0.04, abs=0.003)
    assert fit.lag_s.value == pytest.approx(0.06, rel=0.05)
    inside = (answer.times_s >= 0.5) & (answer.times_s <= 59.0) & ~((answer.times_s > 35.0) & (answer.times_s < 45.5))
    assert fit.samples == np.count_nonzero(kept & inside)
    assert fit.seconds < 34.5 - 1.5 + 13.5


def test_a_blow_now_and_then_does_not_speak_louder_than_the_rest() -> None:
    command, answer = truth("static", 0.04, 0.06, 4)
    struck = answer.values.copy()
    for at in range(200, 2800, 400):
        struck[at : at + 12] += 3.0
    fit = fitted(identify(command, Signal(answer.times_s, struck), WHOLE, "static"))
    assert fit.dead_s.value == pytest.approx(0.04, abs=0.003)
    assert fit.lag_s.value == pytest.approx(0.06, rel=0.08)


def test_the_model_is_that_of_the_samples() -> None:
    command, answer = truth("static", 0.04, 0.06, 1)
    fit = fitted(identify(command, answer, WHOLE, "static"))
    assert fit.times_s.shape == fit.answer.shape == fit.model.shape == (fit.samples,)
    assert np.std(fit.answer - fit.model) == pytest.approx(fit.residual, rel=1e-6)
    # White noise of 0.02, and a drift of 0.02 a second over windows of 30 / 7 s, whose deviation is a 12th root of it.
    assert fit.residual == pytest.approx(np.hypot(0.02, 0.02 * (29.7 / 7) / np.sqrt(12.0)), rel=0.1)
    assert fit.command_sd == pytest.approx(0.3, rel=0.2)


def refusal(command, answer, spans=WHOLE, kind="static") -> str:
    result = identify(command, answer, spans, kind)
    assert isinstance(result, Refused), result
    return result.reason


def test_a_command_that_never_changes() -> None:
    command, answer = truth("static", 0.04, 0.06, 1)
    assert "never changes: no excitation" in refusal(Signal(command.times_s, 0.0 * command.values + 0.2), answer)


def test_an_answer_that_never_changes() -> None:
    command, answer = truth("static", 0.04, 0.06, 1)
    assert "answer never changes" in refusal(command, Signal(answer.times_s, 0.0 * answer.values))


@pytest.mark.parametrize("kind", ["static", "integrating"])
def test_an_answer_that_is_only_noise(kind) -> None:
    command, answer = truth(kind, 0.04, 0.06, 1)
    noise = np.random.default_rng(3).normal(0.0, 0.1, len(answer.values))
    assert refusal(command, Signal(answer.times_s, noise), kind=kind)


@pytest.mark.parametrize(("noise", "words"), [(2.0, "the command explains 2% of"), (1.0, "the gain is known within")])
def test_a_command_too_small_for_the_noise(noise, words) -> None:
    assert f"too little excitation: {words}" in refusal(*truth("static", 0.04, 0.06, 1, noise=noise))


def test_a_slow_command_tells_the_gain_but_not_the_time() -> None:
    command, answer = truth("static", 0.04, 0.06, 1)
    slow = 0.3 * np.sin(0.8 * command.times_s)
    late = 0.3 * np.sin(0.8 * (answer.times_s - 0.1)) + np.random.default_rng(2).normal(0.0, 0.3, len(answer.values))
    reason = refusal(Signal(command.times_s, slow), Signal(answer.times_s, late))
    assert "dead time and lag together are known within" in reason


def test_an_answer_the_wrong_way_round() -> None:
    command, answer = truth("static", 0.04, 0.06, 1)
    assert "against the command" in refusal(command, Signal(answer.times_s, -answer.values))


def test_an_answer_that_comes_later_than_is_searched() -> None:
    command, answer = truth("static", 0.66, 0.02, 1)
    assert "within the range searched" in refusal(command, answer)


@pytest.mark.parametrize("spans", [[], [(0.0, 1.0)], [(40.0, 50.0)]])
def test_too_little_data(spans) -> None:
    assert "too little data" in refusal(*truth("static", 0.04, 0.06, 1), spans=spans)


def test_no_data_at_all() -> None:
    command, _ = truth("static", 0.04, 0.06, 1)
    assert "too little data" in refusal(command, Signal(np.zeros(0), np.zeros(0)))


def test_windows_are_of_equal_length_and_end_at_gaps() -> None:
    times_s = np.concatenate((np.arange(0.0, 10.0, 0.1), np.arange(11.0, 13.0, 0.1)))
    windows, used = cut(times_s, [(0.0, 12.0)], 4.0, 0.3, 5, 0)
    assert windows.count == 3
    # 9.9 s are two windows of 4.95 s; the second behind the gap, up to the span's end.
    assert np.bincount(windows.index).tolist() == [50, 50, 11]
    assert times_s[used][-1] == pytest.approx(12.0)


def test_a_projected_column_is_free_of_each_windows_line() -> None:
    times_s = np.arange(0.0, 8.0, 0.1)
    windows = Windows(times_s, np.repeat([0, 1], 40), 1)
    lines = np.where(windows.index == 0, 3.0 - 2.0 * times_s, 5.0 + 7.0 * times_s)
    for filter_ in (NO_FILTER, np.array([0.6, -0.2])):
        weights = np.random.default_rng(1).uniform(0.1, 1.0, 80 - 2 * len(filter_))
        assert np.abs(Projection(windows, filter_, weights)(lines)).max() < 1e-9
        assert np.abs(Projection(windows, filter_, weights)(lines + np.sin(9.0 * times_s))).max() > 0.1
