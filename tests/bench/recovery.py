"""Performance recovery (Freidovich and Khalil, 2008): output feedback against state feedback, over kappa.

    python tests/bench/recovery.py

A step of some 2 m with omega0 = 2 rad/s. State feedback knows friction and the input gain at every attitude; output feedback
has position and yaw, b(0, yaw), and knows of no friction. Ideal: no lag, no delay, no noise, 200 Hz. Real: 100 Hz, 3 mm of
white noise, 20 ms of delay, which the law is told of; the yardstick is the ideal one there, too.
"""

from __future__ import annotations

import math
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mavquad.types import Depth
from tests.unit.control.ideal import distances_m, output_feedback, quiet, state_feedback
from tests.unit.control.plant import Flight, Link

KAPPAS = (3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 64.0)
DEPTHS: tuple[Depth, ...] = ("torque", "rate", "attitude")
IDEAL_HZ, REAL_HZ = 200.0, 100.0
REAL = Link(rate_hz=REAL_HZ, delay_s=0.02, white_m=0.003, wander_m=0.0, yaw_white_rad=0.001)
SEEDS = (1, 2, 3)


def thinned(flight: Flight) -> Flight:
    """The ideal flight at the moments of the real one."""
    return Flight(truth=flight.truth[:: round(IDEAL_HZ / REAL_HZ)])


def cell(flights: list[Flight], yardstick: Flight) -> str:
    """The largest and the RMS distance, cm, the median over the flights."""
    if any(len(flight.truth) != len(yardstick.truth) for flight in flights):
        return "diverges"
    gaps = [distances_m(flight, yardstick) for flight in flights]
    largest = statistics.median(max(gap) for gap in gaps)
    rms = statistics.median(math.sqrt(statistics.fmean(d * d for d in gap)) for gap in gaps)
    return f"{100 * largest:.1f} / {100 * rms:.1f}"


def main() -> None:
    heads = [f"{depth}, {case}" for depth in DEPTHS for case in ("ideal", "real")]
    print("Distance to the state-feedback trajectory, largest / RMS, cm\n")
    print(f"| kappa, rad/s | {' | '.join(heads)} |\n|{'---|' * (len(heads) + 1)}")
    yardsticks = {depth: state_feedback(depth, quiet(IDEAL_HZ)) for depth in DEPTHS}
    for kappa in KAPPAS:
        cells = []
        for depth in DEPTHS:
            cells.append(cell([output_feedback(depth, quiet(IDEAL_HZ), kappa)], yardsticks[depth]))
            real = [output_feedback(depth, REAL, kappa, seed) for seed in SEEDS]
            cells.append(cell(real, thinned(yardsticks[depth])))
        print(f"| {kappa:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
