"""What each further measurement buys, at each depth: `python tests/bench/measurements.py`.

Rotor lag 50 ms, 100 Hz without jitter, 30 ms of delay of which the law knows 25, 3 mm of white noise on 5 cm of wander. RMS
against the measured frame from 5 s to 20 s, cm, the median of three seeds. Wind: 5 m/s with gusts of 1.5 m/s over 1 s. The
extra delay is the largest that a step of 1 m survives, within 0.3 m of its goal after 12 s, to 5 ms.
"""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.control.params import LawParams
from mavquad.control.reference import Pose, hold
from mavquad.types import Depth, ReferencePoint
from tests.unit.control.ideal import quiet
from tests.unit.control.plant import Link, Vehicle, fly

DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
MEASUREMENTS = ("position_yaw", "position_attitude", "full")
VEHICLE = Vehicle(rotor_lag_s=0.05)
DELAY_S = 0.030
SEEDS = (1, 2, 3)
HOVER = hold(Pose((0.0, 0.0, 0.0), 0.0))
STEP_MS, LARGEST_MS = 5, 400


def wave(size: float, rate: float, time_s: float) -> tuple[float, ...]:
    return tuple(size * rate**k * math.sin(rate * time_s + 0.5 * k * math.pi) for k in range(5))


def eight(time_s: float) -> ReferencePoint:
    """x = 1.25 sin t, z = 0.75 sin 2t."""
    still = (0.0,) * 5
    return ReferencePoint(wave(0.75, 2.0, time_s), still, wave(1.25, 1.0, time_s), still)


def rms(depth: Depth, measured: str, reference: Callable[[float], ReferencePoint], **conditions: object) -> str:
    found = []
    for seed in SEEDS:
        flight = fly(
            LawParams(measurements=measured), reference, 20.0, depth=depth, vehicle=VEHICLE, link=Link(delay_s=DELAY_S),
            seed=seed, **conditions,
        )  # fmt: skip
        found.append(math.inf if flight.crashed else flight.rms_m(5.0))
    middle = statistics.median(found)
    return f"{100 * middle:.1f}" if math.isfinite(middle) else "diverges"


def survives(depth: Depth, measured: str, extra_ms: int) -> bool:
    goal = hold(Pose((1.0, 0.0, 0.0), 0.0))
    link = quiet(100.0, DELAY_S + 1e-3 * extra_ms)
    flight = fly(LawParams(measurements=measured), lambda _: goal, 12.0, depth=depth, vehicle=VEHICLE, link=link)
    return not flight.crashed and flight.max_m(11.0) < 0.3


def largest_extra_ms(depth: Depth, measured: str) -> int:
    """By halving: the least that does not survive is taken for the end of what does."""
    low, high = 0, LARGEST_MS
    while high - low > STEP_MS:
        middle = STEP_MS * round((low + high) / 2 / STEP_MS)
        low, high = (middle, high) if survives(depth, measured, middle) else (low, middle)
    return low


def main() -> None:
    gusty = {"wind": (5.0, 0.0, 0.0), "gusts_m_s": 1.5}
    print(
        "| depth | measured | hover | eight | hover, wind | eight, wind | extra delay, ms |\n|---|---|---|---|---|---|---|"
    )
    for depth in DEPTHS:
        for measured in MEASUREMENTS:
            cells = [
                rms(depth, measured, lambda _: HOVER),
                rms(depth, measured, eight),
                rms(depth, measured, lambda _: HOVER, **gusty),
                rms(depth, measured, eight, **gusty),
                str(largest_extra_ms(depth, measured)),
            ]
            print(f"| {depth} | {measured} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
