"""What the law does about the autopilot's inner loop as it is found, on loops that are known."""

import math
import random

import pytest

from mavquad.control.params import LawParams
from mavquad.control.response import Late, ResponseMeter
from mavquad.control.tuning import tuning
from mavquad.flight.inner_loop import FIRST_SLOWER, MOST_SLOWER, PATIENCE_US, InnerLoop
from mavquad.types import Attitude, AttitudeCommand, Depth, RateCommand

LAW = LawParams().of("arducopter")
STEP_US = 10_000
OWN_S = 0.07
"""What ArduCopter's rate loop is told to take."""


def shaken(
    loop: InnerLoop, delay_s: float, depth: Depth = "rate", seconds: float = 1.2, size: float = 0.2
) -> list[LawParams]:
    """The laws that it calls for while commands shake a lag of 0.4 behind a dead time of 0.6 of this delay."""
    rng, value, asked, found = random.Random(2), [0.0, 0.0], (0.0, 0.0), []
    behind: list[tuple[float, float]] = [(0.0, 0.0)] * round(0.6 * delay_s * 100)
    left = math.exp(-0.01 / (0.4 * delay_s))
    for k in range(round(100 * seconds)):
        stamp_us = 1_000_000 + k * STEP_US
        roll, pitch = (each + rng.gauss(0.0, 0.005) for each in value)
        rates = (roll, pitch, 0.0)
        attitude = Attitude(stamp_us, roll, pitch, 0.0, rates if depth == "rate" else (9.0, 9.0, 0.0))
        better = loop.answer(attitude)
        if better is not None:
            found.append(better)
        asked = (0.8 * asked[0] + rng.gauss(0.0, size), 0.8 * asked[1] + rng.gauss(0.0, size))
        loop.command(
            RateCommand((*asked, 0.0), 9.81) if depth == "rate" else AttitudeCommand(*asked, 0.0, 9.81), stamp_us
        )
        behind.append(asked)
        value = [left * each + (1.0 - left) * late for each, late in zip(value, behind.pop(0), strict=True)]
    return found


def omega0(law: LawParams, depth: Depth = "rate") -> float:
    return law.omega0_rad_s or law.own(depth).omega0_rad_s


def counted_s(law: LawParams) -> float:
    spec = tuning(law, "rate").horizontal.spec
    return spec.dead_us * 1e-6 + spec.lag_s


def test_it_begins_gently_and_goes_on_as_told_where_the_loop_is_as_told() -> None:
    loop = InnerLoop(LAW, LAW, "rate")
    assert omega0(loop.law) == pytest.approx(omega0(LAW) / FIRST_SLOWER)
    assert shaken(loop, OWN_S) == [LAW]
    assert loop.words == ""


def test_a_slower_loop_is_counted_on_and_every_gain_lowered() -> None:
    loop = InnerLoop(LAW, LAW, "rate")
    law = shaken(loop, 0.15)[0]
    assert counted_s(law) == pytest.approx(0.15, rel=0.15)
    slower = omega0(LAW) / omega0(law)
    assert slower == pytest.approx((counted_s(law) + 0.025) / (OWN_S + 0.025), abs=0.01)
    for row, usual in zip(
        tuning(law, "rate").horizontal.spec.rows, tuning(LAW, "rate").horizontal.spec.rows, strict=True
    ):
        assert row.kappa_rad_s == pytest.approx(usual.kappa_rad_s / slower)
    assert "ms after a command, 70 expected: gains divided by" in loop.words


def test_a_quicker_loop_is_counted_on_and_no_gain_raised() -> None:
    own = LawParams().of("px4")
    loop = InnerLoop(own, own, "rate")
    law = shaken(loop, 0.045)[0]
    assert counted_s(law) < 0.065
    assert omega0(law) == omega0(own)
    assert loop.words.endswith("gains as they were")


def test_a_quicker_loop_is_nothing_at_depth_attitude() -> None:
    law = shaken(InnerLoop(LAW, LAW, "attitude"), 0.1, "attitude")[0]
    assert law == LAW


def test_depth_attitude_goes_by_the_attitude() -> None:
    law = shaken(InnerLoop(LAW, LAW, "attitude"), 0.32, "attitude", 2.0)[-1]
    assert omega0(law, "attitude") < omega0(LAW, "attitude") / 1.25


def test_a_loop_beyond_reason_lowers_them_no_further() -> None:
    law = shaken(InnerLoop(LAW, LAW, "rate"), 0.4, seconds=4.0)[-1]
    assert omega0(law) >= omega0(LAW) / MOST_SLOWER - 1e-9


def test_a_peak_lowers_them_too_and_no_further(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = InnerLoop(LAW, LAW, "rate")
    told = iter([Late(OWN_S, 0.001, 0.0, 1.5, 0.1), *[Late(0.2, 0.001, 0.0, 3.0, 0.1)] * 2])
    monkeypatch.setattr(ResponseMeter, "answer", lambda *_: next(told))
    attitude = Attitude(1_000_000, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    found = [loop.answer(attitude) for _ in range(3)]
    slower = [law and omega0(LAW) / omega0(law) for law in found]
    # The first at once; then what two in a row ask for.
    assert slower == [pytest.approx(1.25), None, pytest.approx(MOST_SLOWER)]


def test_where_nothing_moves_it_goes_on_as_told_after_a_while() -> None:
    loop = InnerLoop(LAW, LAW, "rate")
    assert shaken(loop, 0.15, seconds=PATIENCE_US * 1e-6 - 0.1, size=0.0) == []
    assert shaken(InnerLoop(LAW, LAW, "rate"), 0.15, seconds=PATIENCE_US * 1e-6 + 0.2, size=0.0) == [LAW]


@pytest.mark.parametrize(("depth", "least"), [("rate", 0.02), ("attitude", 0.005)])
def test_of_next_to_no_motion_nothing_is_learned(monkeypatch: pytest.MonkeyPatch, depth: Depth, least: float) -> None:
    """A real ArduCopter in a calm hover moves as much by itself as by command."""
    moved = iter([0.9 * least, 1.1 * least])
    monkeypatch.setattr(ResponseMeter, "answer", lambda *_: Late(0.4, 0.001, 0.0, 1.0, next(moved)))
    loop = InnerLoop(LAW, LAW, depth)
    attitude = Attitude(1_000_000, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    assert loop.answer(attitude) is None
    law = loop.answer(attitude)
    assert law is not None
    assert omega0(law, depth) < omega0(LAW, depth)


@pytest.mark.parametrize(
    "told", [{"inner_loop": "told"}, {"lag_s": 0.05}, {"dead_time_s": 0.02}, {"form": "state_feedback"}]
)
def test_what_is_told_is_left_as_it_is(told: dict[str, object]) -> None:
    own = LAW.model_copy(update=told)
    loop = InnerLoop(own, own, "rate")
    assert loop.law == own
    assert shaken(loop, 0.15) == []


def test_torque_is_left_as_it_is() -> None:
    loop = InnerLoop(LawParams(), LawParams(), "torque")
    assert loop.law == LawParams()
    assert shaken(loop, 0.15) == []


def test_gains_that_are_told_are_flown_with_the_delay_that_is_found() -> None:
    own = LAW.model_copy(update={"omega0_rad_s": 2.0})
    loop = InnerLoop(own, own, "rate")
    assert loop.law == own
    law = shaken(loop, 0.15)[0]
    assert omega0(law) == 2.0
    assert counted_s(law) == pytest.approx(0.15, rel=0.15)


def leaning(north: float, west: float, yaw_rad: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a vehicle whose thrust points there: r3 = (sp cr, -sr, cp cr) as seen from its yaw."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    ahead, left = c * north + s * west, c * west - s * north
    return -math.asin(left), math.atan2(ahead, math.sqrt(1.0 - ahead**2 - left**2)), yaw_rad


def test_a_turn_in_wind_is_no_slow_answer() -> None:
    law = LawParams().of("px4")
    loop = InnerLoop(law, law, "attitude")
    spec = tuning(law, "attitude").horizontal.spec
    told_s = spec.dead_us * 1e-6 + spec.lag_s
    rng, north, west = random.Random(4), 0.7, 0.0
    asked = (north, west)

    def yaw_rad(k: int) -> float:
        return 0.8 * (1.0 - math.cos(math.pi * min(max(k - 150, 0) / 200, 1.0)))

    behind = [asked] * round(0.6 * told_s * 100)
    left = math.exp(-0.01 / (0.4 * told_s))
    for k in range(400):
        stamp_us = 1_000_000 + k * STEP_US
        loop.answer(Attitude(stamp_us, *leaning(north, west, yaw_rad(k)), (0.0, 0.0, 0.0)))
        asked = tuple(
            0.8 * was + 0.2 * mean + rng.gauss(0.0, 0.01) for was, mean in zip(asked, (0.7, 0.0), strict=True)
        )
        # The yaw that is asked for is ahead of the vehicle's.
        loop.command(AttitudeCommand(*leaning(*asked, yaw_rad(k + 40)), 9.81), stamp_us)
        behind.append(asked)
        north, west = (left * is_ + (1.0 - left) * late for is_, late in zip((north, west), behind.pop(0), strict=True))
    assert loop.words == ""
    assert loop.law == law
